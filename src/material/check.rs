//! Laws that every material must obey, one function per continuum, for the tests of the laws.
//!
//! A law is right when its stress and its moduli belong together, when it remembers nothing but its state, when
//! virgin material at rest is free of stress, and when what it cannot answer is an error.

use super::active::{ActiveSet, Pair, PlaneSet, SpaceSet};
use super::{Components, Material};
use crate::continuum::micropolar::{Micropolar, MicropolarModuli, MicropolarStrain, MicropolarStress};
use crate::continuum::tensor::component;
use crate::continuum::total_length;
use nalgebra::{Matrix3, SMatrix};

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
pub struct Subject<'a> {
    pub law: &'a dyn Material<Micropolar>,
    pub components: Components,
    /// Length that makes a wryness a strain [m].
    pub length: f64,
    /// Size of the changes of strain of the Taylor test; the law must be smooth over it.
    pub step: f64,
}

/// A strain and the state before it.
pub struct Situation<'a> {
    pub strain: MicropolarStrain,
    pub old: &'a [f64],
}

/// What a law answers in buffers filled with `dirt`.
pub fn answer(
    law: &dyn Material<Micropolar>,
    strain: &MicropolarStrain,
    old: &[f64],
    dirt: f64,
) -> Option<(MicropolarStress, Vec<f64>)> {
    let mut new = vec![dirt; total_length(law.state_variables())];
    let mut stress = MicropolarStress {
        force: Matrix3::from_element(dirt),
        couple: Matrix3::from_element(dirt),
    };
    law.respond(strain, old, &mut new, &mut stress)
        .ok()
        .map(|()| (stress, new))
}

/// All laws at all situations.
pub fn micropolar(subject: &Subject, situations: &[Situation]) {
    rests_without_stress(subject.law);
    refuses_what_is_not_finite(subject.law);
    assert!(!situations.is_empty());
    for (index, situation) in situations.iter().enumerate() {
        is_pure(subject, situation);
        let mut random = Random::new(index as u64 + 1);
        for _ in 0..4 {
            moduli_are_the_derivative_of_the_stress(subject, situation, &mut random, index);
        }
    }
}

/// Where points that flowed are evaluated again, the moduli that open a step are those of a little more flow. Returns
/// how many points were compared.
pub fn opening_moduli_are_those_of_further_flow(subject: &Subject, situations: &[Situation]) -> usize {
    let law = subject.law;
    let chi: usize = law
        .state_variables()
        .iter()
        .take_while(|variable| variable.name != "chi")
        .map(|variable| variable.length)
        .sum();
    let mut random = Random::new(3);
    let mut compared = 0;
    for Situation { strain, old } in situations {
        let (_, flowed) = answer(law, strain, old, 0.0).expect("an answer");
        let (stress, again) = answer(law, strain, &flowed, 0.0).expect("an answer");
        let mut opening = MicropolarModuli::default();
        let flows_on = law.opening_moduli(strain, &flowed, &again, &stress, &mut opening);
        // Small beside the rounding of an apex, large beside the tolerance of f.
        let change = random.strain(subject.components, 1e-10, 1e-10 / subject.length);
        let further = [1.0, -1.0].into_iter().find_map(|sign| {
            let ahead = MicropolarStrain {
                stretch: strain.stretch + (change.stretch - Matrix3::identity()) * sign,
                wryness: strain.wryness + change.wryness * sign,
            };
            let (stress, new) = answer(law, &ahead, &flowed, 0.0)?;
            (new[chi] > flowed[chi]).then_some((ahead, stress, new))
        });
        let Some((ahead, stress, new)) = further.filter(|_| flows_on) else {
            continue;
        };
        let mut moduli = MicropolarModuli::default();
        law.moduli(&ahead, &flowed, &new, &stress, &mut moduli);
        assert_eq!(opening.coupled, moduli.coupled);
        let direction = random.strain(subject.components, 1.0, 1.0 / subject.length);
        let [left, right] = [&opening, &moduli].map(|moduli| predicted(moduli, subject.components, &direction));
        let size = norm(&right, subject.components, subject.length);
        let error = norm(&difference(&left, &right), subject.components, subject.length);
        // Elastic moduli, or ones without hardening, differ by tens of per cent.
        assert!(error < 1e-2 * size, "{error:e} of {size:e}");
        compared += 1;
    }
    compared
}

fn initial(law: &dyn Material<Micropolar>) -> Vec<f64> {
    let mut state = vec![f64::NAN; total_length(law.state_variables())];
    law.initial_state(&mut state);
    assert!(
        state.iter().all(|value| value.is_finite()),
        "the whole initial state is written"
    );
    state
}

fn rests_without_stress(law: &dyn Material<Micropolar>) {
    let old = initial(law);
    let (stress, new) = answer(law, &MicropolarStrain::default(), &old, 7.0).expect("an answer at rest");
    assert_eq!(stress, MicropolarStress::default());
    assert_eq!(new, old);
}

fn refuses_what_is_not_finite(law: &dyn Material<Micropolar>) {
    let old = initial(law);
    for broken in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e200, -1e300, f64::MAX] {
        for place in 0..9 {
            let (mut bent, mut turned) = (MicropolarStrain::default(), MicropolarStrain::default());
            bent.stretch[place] = broken;
            turned.wryness[place] = broken;
            let spoiled = old.iter().map(|_| broken).collect::<Vec<_>>();
            for (strain, state) in [(bent, &old), (turned, &old), (MicropolarStrain::default(), &spoiled)] {
                // Either an error or numbers.
                if let Some((stress, new)) = answer(law, &strain, state, 0.0) {
                    assert!(stress.force.iter().chain(&stress.couple).all(|value| value.is_finite()));
                    let mut moduli = MicropolarModuli::default();
                    law.moduli(&strain, state, &new, &stress, &mut moduli);
                }
            }
        }
    }
}

fn is_pure(subject: &Subject, situation: &Situation) {
    let clean = answer(subject.law, &situation.strain, situation.old, 0.0).expect("an answer");
    let dirty = answer(subject.law, &situation.strain, situation.old, 3e7).expect("an answer");
    assert_eq!(clean, dirty, "reused buffers change the answer");
    let (stress, new) = clean;
    let evaluate = |dirt: f64| {
        let block = SMatrix::from_element(dirt);
        let mut moduli = MicropolarModuli {
            force_stretch: block,
            force_wryness: block,
            couple_stretch: block,
            couple_wryness: block,
            coupled: dirt != 0.0,
        };
        subject
            .law
            .moduli(&situation.strain, situation.old, &new, &stress, &mut moduli);
        moduli
    };
    let (clean, dirty) = (evaluate(0.0), evaluate(5e9));
    assert_eq!(clean.coupled, dirty.coupled);
    for_active_entries(subject.components, |name, entry| {
        let value = |moduli: &MicropolarModuli| block(moduli, name).map(|block| block[entry]);
        assert_eq!(value(&clean), value(&dirty), "{name:?} {entry:?} depends on the buffer");
    });
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Block {
    ForceStretch,
    ForceWryness,
    CoupleStretch,
    CoupleWryness,
}

/// A block, unless it is one that is not to be read.
fn block(moduli: &MicropolarModuli, name: Block) -> Option<&SMatrix<f64, 9, 9>> {
    match name {
        Block::ForceStretch => Some(&moduli.force_stretch),
        Block::CoupleWryness => Some(&moduli.couple_wryness),
        Block::ForceWryness => moduli.coupled.then_some(&moduli.force_wryness),
        Block::CoupleStretch => moduli.coupled.then_some(&moduli.couple_stretch),
    }
}

fn for_active_entries(components: Components, mut check: impl FnMut(Block, (usize, usize))) {
    let (stretches, wrynesses) = driven(components);
    for (name, rows, columns) in [
        (Block::ForceStretch, stretches, stretches),
        (Block::ForceWryness, stretches, wrynesses),
        (Block::CoupleStretch, wrynesses, stretches),
        (Block::CoupleWryness, wrynesses, wrynesses),
    ] {
        for &(k, l) in columns {
            for &(i, j) in rows {
                check(name, (component(i, j), component(k, l)));
            }
        }
    }
}

/// Change of the stress by the moduli, in the active components.
fn predicted(moduli: &MicropolarModuli, components: Components, direction: &MicropolarStrain) -> MicropolarStress {
    let mut change = MicropolarStress::default();
    let at = |n: usize| (n / 3, n % 3);
    for_active_entries(components, |name, (row, column)| {
        let Some(block) = block(moduli, name) else { return };
        let by = match name {
            Block::ForceStretch | Block::CoupleStretch => direction.stretch[at(column)],
            Block::ForceWryness | Block::CoupleWryness => direction.wryness[at(column)],
        };
        let of = match name {
            Block::ForceStretch | Block::ForceWryness => &mut change.force[at(row)],
            Block::CoupleStretch | Block::CoupleWryness => &mut change.couple[at(row)],
        };
        *of += block[(row, column)] * by;
    });
    change
}

/// Norm over the active components, couples divided by the length.
fn norm(stress: &MicropolarStress, components: Components, length: f64) -> f64 {
    let (stretches, wrynesses) = driven(components);
    let force: f64 = stretches.iter().map(|&pair| stress.force[pair].powi(2)).sum();
    let couple: f64 = wrynesses
        .iter()
        .map(|&pair| (stress.couple[pair] / length).powi(2))
        .sum();
    (force + couple).sqrt()
}

fn difference(left: &MicropolarStress, right: &MicropolarStress) -> MicropolarStress {
    MicropolarStress {
        force: left.force - right.force,
        couple: left.couple - right.couple,
    }
}

/// Taylor test: the error of the linear prediction falls by four where the step is halved.
fn moduli_are_the_derivative_of_the_stress(
    subject: &Subject,
    situation: &Situation,
    random: &mut Random,
    index: usize,
) {
    let (law, components, length) = (subject.law, subject.components, subject.length);
    let strain = &situation.strain;
    let (stress, new) = answer(law, strain, situation.old, 0.0).expect("an answer");
    let mut moduli = MicropolarModuli::default();
    law.moduli(strain, situation.old, &new, &stress, &mut moduli);
    let rest = random.strain(components, 1.0, 1.0 / length);
    let direction = MicropolarStrain {
        stretch: rest.stretch - Matrix3::identity(),
        ..rest
    };
    let slope = predicted(&moduli, components, &direction);
    let size = norm(&slope, components, length);
    let error = |h: f64| {
        let ahead = MicropolarStrain {
            stretch: strain.stretch + direction.stretch * h,
            wryness: strain.wryness + direction.wryness * h,
        };
        let (moved, _) = answer(law, &ahead, situation.old, 0.0).expect("an answer nearby");
        let linear = MicropolarStress {
            force: stress.force + slope.force * h,
            couple: stress.couple + slope.couple * h,
        };
        norm(&difference(&moved, &linear), components, length)
    };
    let errors = [1.0, 0.5, 0.25].map(|part| error(subject.step * part));
    // Rounding of the stress itself; a law that is linear has no other error.
    let rounding = 1e-9 * subject.step * size + 1e-13 * norm(&stress, components, length);
    for pair in errors.windows(2) {
        let falls = pair[1] <= pair[0] / 3.5 || pair[1] <= rounding;
        assert!(
            falls,
            "situation {index}: errors {errors:?} at slope {size:e}, rounding {rounding:e}"
        );
    }
    assert!(
        errors[2] < 0.05 * subject.step * size + rounding,
        "situation {index}: {errors:?} against {size:e}"
    );
}
