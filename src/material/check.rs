//! Laws that every material of any continuum must obey, for the tests of the laws.
//!
//! A law is right when its stress and its moduli belong together, when it remembers nothing but its state, when a rotation
//! of the body turns its stress and changes nothing else, when virgin material at rest is free of stress, and when what it
//! cannot answer is an error.

mod continua;

use super::active::{ActiveSet, Pair, PlaneSet, SpaceSet};
use super::driver::{Deformation, Driven};
use super::{Components, Material};
use crate::continuum::micropolar::MicropolarStrain;
use crate::continuum::{Continuum, Observation, total_length};
pub use continua::Checked;
use nalgebra::{Matrix3, Rotation3, Vector3};

/// Numbers in (-1, 1), the same in every run (Marsaglia's xorshift).
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1)
    }

    pub fn number(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    /// A tensor with these components random and the others zero.
    pub fn tensor(&mut self, pairs: &[Pair]) -> Matrix3<f64> {
        let mut tensor = Matrix3::zeros();
        for &pair in pairs {
            tensor[pair] = self.number();
        }
        tensor
    }

    pub fn strain(&mut self, components: Components, stretch: f64, wryness: f64) -> MicropolarStrain {
        let (stretches, wrynesses) = driven(components);
        MicropolarStrain {
            stretch: Matrix3::identity() + self.tensor(stretches) * stretch,
            wryness: self.tensor(wrynesses) * wryness,
        }
    }
}

/// Components of stretch and wryness that a motion can change.
pub fn driven(components: Components) -> (&'static [Pair], &'static [Pair]) {
    match components {
        Components::Plane => (PlaneSet::DRIVEN_STRETCH, PlaneSet::DRIVEN_WRYNESS),
        Components::Space => (SpaceSet::DRIVEN_STRETCH, SpaceSet::DRIVEN_WRYNESS),
    }
}

/// A law with the units in which its strains are of one size.
pub struct Subject<'a, C: Continuum> {
    pub law: &'a dyn Material<C>,
    pub components: Components,
    /// Length that makes a wryness a strain [m].
    pub length: f64,
    /// Size of the changes of strain of the Taylor test; the law must be smooth over it.
    pub step: f64,
    /// Rounding of stresses beside that of their own digits [Pa].
    pub rounding: f64,
}

/// A strain and the state before it.
pub type Situation<C> = (<C as Continuum>::Strain, Vec<f64>);

/// What a law answers in buffers filled with `dirt`.
pub fn answer<C: Checked>(
    law: &dyn Material<C>,
    strain: &C::Strain,
    old: &[f64],
    dirt: f64,
) -> Option<(C::Stress, Vec<f64>)> {
    let mut new = vec![dirt; total_length(law.state_variables())];
    let mut stress = C::dirty_stress(dirt);
    law.respond(strain, old, &mut new, &mut stress)
        .ok()
        .map(|()| (stress, new))
}

/// The moduli of a strain that has an answer, in a buffer filled with `dirt`.
pub fn moduli_at<C: Checked>(law: &dyn Material<C>, strain: &C::Strain, old: &[f64], dirt: f64) -> C::Moduli {
    let (stress, new) = answer(law, strain, old, 0.0).expect("an answer");
    let mut moduli = C::dirty_moduli(dirt);
    law.moduli(strain, old, &new, &stress, &mut moduli);
    moduli
}

/// All laws at all situations.
pub fn obeys<C: Checked>(subject: &Subject<C>, situations: &[Situation<C>]) {
    rests_without_stress(subject.law);
    refuses_what_is_not_finite(subject.law);
    assert!(!situations.is_empty());
    for (index, situation) in situations.iter().enumerate() {
        is_pure(subject, situation);
        let mut random = Random::new(index as u64 + 1);
        for _ in 0..4 {
            moduli_are_the_derivative_of_the_stress(subject, situation, &mut random, index);
            is_objective(subject, situation, &mut random, index);
        }
    }
}

/// Where points that flowed are evaluated again, the moduli that open a step are those of a little more flow. Returns
/// how many points were compared.
pub fn opening_moduli_are_those_of_further_flow<C: Checked>(
    subject: &Subject<C>,
    situations: &[Situation<C>],
) -> usize {
    /// Small beside the rounding of an apex, large beside the tolerance of f.
    const CHANGE: f64 = 1e-10;
    let (law, components, length) = (subject.law, subject.components, subject.length);
    let chi: usize = law
        .state_variables()
        .iter()
        .take_while(|variable| variable.name != "chi")
        .map(|variable| variable.length)
        .sum();
    let mut random = Random::new(3);
    let mut compared = 0;
    for (strain, old) in situations {
        let (_, flowed) = answer(law, strain, old, 0.0).expect("an answer");
        let (stress, again) = answer(law, strain, &flowed, 0.0).expect("an answer");
        let mut opening = C::Moduli::default();
        let flows_on = law.opening_moduli(strain, &flowed, &again, &stress, &mut opening);
        let change = C::change(&mut random, components, length);
        let further = [CHANGE, -CHANGE].into_iter().find_map(|amount| {
            let ahead = C::moved(strain, &change, amount);
            let (_, new) = answer(law, &ahead, &flowed, 0.0)?;
            (new[chi] > flowed[chi]).then_some(ahead)
        });
        let Some(ahead) = further.filter(|_| flows_on) else {
            continue;
        };
        let moduli = moduli_at(law, &ahead, &flowed, 0.0);
        let direction = C::change(&mut random, components, length);
        let [left, right] = [&opening, &moduli].map(|moduli| {
            let rate = C::predicted(moduli, &stress, components, &direction);
            C::parts(&rate, components, length)
        });
        for (left, right) in left.iter().zip(&right) {
            let (size, error) = (norm(right), norm(&combined(left, right, -1.0)));
            // Elastic moduli, or ones without hardening, differ by tens of per cent.
            assert!(error <= 1e-2 * size, "{error:e} of {size:e}");
        }
        compared += 1;
    }
    compared
}

/// The state of virgin material.
pub fn virgin<C: Continuum>(law: &dyn Material<C>) -> Vec<f64> {
    let mut state = vec![f64::NAN; total_length(law.state_variables())];
    law.initial_state(&mut state);
    assert!(
        state.iter().all(|value| value.is_finite()),
        "the whole initial state is written"
    );
    state
}

fn rests_without_stress<C: Checked>(law: &dyn Material<C>) {
    let old = virgin(law);
    let (stress, new) = answer(law, &C::Strain::default(), &old, 7.0).expect("an answer at rest");
    assert_eq!(stress, C::Stress::default());
    assert_eq!(new, old);
}

fn refuses_what_is_not_finite<C: Checked>(law: &dyn Material<C>) {
    let old = virgin(law);
    for number in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e200, -1e300, f64::MAX] {
        let spoiled = vec![number; old.len()];
        let broken = C::broken(number).into_iter().map(|strain| (strain, &old));
        for (strain, state) in broken.chain([(C::Strain::default(), &spoiled)]) {
            // Either an error or numbers.
            if let Some((stress, new)) = answer(law, &strain, state, 0.0) {
                assert!(
                    C::all_of(&stress).iter().all(|value| value.is_finite()),
                    "{strain:?} {stress:?}"
                );
                law.moduli(&strain, state, &new, &stress, &mut C::Moduli::default());
            }
        }
    }
}

fn is_pure<C: Checked>(subject: &Subject<C>, (strain, old): &Situation<C>) {
    let law = subject.law;
    let clean = answer(law, strain, old, 0.0).expect("an answer");
    let dirty = answer(law, strain, old, 3e7).expect("an answer");
    assert_eq!(clean, dirty, "reused buffers change the answer");
    let [clean, dirty] = [0.0, 5e9].map(|dirt| C::active(&moduli_at(law, strain, old, dirt), subject.components));
    assert_eq!(clean, dirty, "moduli depend on the buffer");
}

/// A rotation of the body, and of its micro-rotation, turns Cauchy's stresses, and leaves the state as it is.
fn is_objective<C: Checked>(subject: &Subject<C>, (strain, old): &Situation<C>, random: &mut Random, index: usize) {
    let vector = match subject.components {
        Components::Plane => Vector3::new(0.0, 0.0, 3.0 * random.number()),
        Components::Space => Vector3::from_fn(|_, _| 1.7 * random.number()),
    };
    let turn = Rotation3::new(vector).into_inner();
    let deformation = C::deformation(strain);
    let turned = Deformation {
        gradient: turn * deformation.gradient,
        rotation: vector,
        ..deformation
    };
    let (before, state) = observed::<C>(subject.law, &deformation, old);
    let (after, turned_state) = observed::<C>(subject.law, &turned, old);
    let floor = subject.rounding + f64::MIN_POSITIVE;
    let same = |left: &Matrix3<f64>, right: &Matrix3<f64>, floor: f64| {
        let expected = turn * left * turn.transpose();
        let error = (right - expected).norm();
        assert!(
            error <= 1e-9 * left.norm() + 1e4 * floor,
            "situation {index}: {right} is not {expected}"
        );
    };
    same(&before.stress, &after.stress, floor);
    if let (Some(before), Some(after)) = (before.couple_stress, after.couple_stress) {
        same(&before, &after, floor * subject.length);
    }
    let size = norm(&state);
    for (left, right) in state.iter().zip(&turned_state) {
        assert!(
            (left - right).abs() <= 1e-10 * size,
            "situation {index}: {state:?} becomes {turned_state:?}"
        );
    }
}

/// What is seen of a point after a step to this deformation, and its state.
fn observed<C: Driven>(law: &dyn Material<C>, deformation: &Deformation, old: &[f64]) -> (Observation, Vec<f64>) {
    let (strain, motion) = C::prescribe(deformation);
    let mut new = vec![0.0; old.len()];
    let mut stress = C::Stress::default();
    law.respond(&strain, old, &mut new, &mut stress).expect("an answer");
    (C::observe(&motion, &stress), new)
}

fn norm(values: &[f64]) -> f64 {
    values.iter().map(|value| value * value).sum::<f64>().sqrt()
}

/// `left + factor right`.
fn combined(left: &[f64], right: &[f64], factor: f64) -> Vec<f64> {
    left.iter()
        .zip(right)
        .map(|(left, right)| left + factor * right)
        .collect()
}

/// Taylor test: the error of the linear prediction falls by four where the step is halved.
pub fn moduli_are_the_derivative_of_the_stress<C: Checked>(
    subject: &Subject<C>,
    (strain, old): &Situation<C>,
    random: &mut Random,
    index: usize,
) {
    let (law, components, length) = (subject.law, subject.components, subject.length);
    let (stress, _) = answer(law, strain, old, 0.0).expect("an answer");
    let moduli = moduli_at(law, strain, old, 0.0);
    let change = C::change(random, components, length);
    let parts = |stress: &C::Stress| C::parts(stress, components, length);
    let (base, slope) = (
        parts(&stress),
        parts(&C::predicted(&moduli, &stress, components, &change)),
    );
    let steps = [1.0, 0.5, 0.25].map(|part| part * subject.step);
    let moved = steps.map(|h| {
        let ahead = C::moved(strain, &change, h);
        parts(&answer(law, &ahead, old, 0.0).expect("an answer nearby").0)
    });
    for (part, (base, slope)) in base.iter().zip(&slope).enumerate() {
        let error = |n: usize| norm(&combined(&combined(&moved[n][part], base, -1.0), slope, -steps[n]));
        let errors = [0, 1, 2].map(error);
        let size = norm(slope);
        // Rounding of the stress itself; a law that is linear has no other error. Parts after the first are pure numbers.
        let floor = if part == 0 { subject.rounding } else { 1e-14 };
        let rounding = 1e-9 * subject.step * size + 1e-13 * norm(base) + floor;
        for pair in errors.windows(2) {
            let falls = pair[1] <= pair[0] / 3.5 || pair[1] <= rounding;
            assert!(
                falls,
                "situation {index}, part {part}: errors {errors:?} at slope {size:e}, rounding {rounding:e}"
            );
        }
        assert!(
            errors[2] < 0.05 * subject.step * size + rounding || errors[2] == 0.0,
            "situation {index}, part {part}: {errors:?} against {size:e}"
        );
    }
}
