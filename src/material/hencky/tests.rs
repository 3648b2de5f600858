use super::*;
use crate::continuum::total_length;
use crate::material::check::{self, Random, Subject, answer, moduli_at, virgin};
use nalgebra::{Rotation3, Vector3};

const LAMBDA: f64 = 5e6;
const MU: f64 = 3e6;

fn elastic() -> ElasticModuli {
    ElasticModuli::without_rotations(LAMBDA, MU)
}

fn hardening() -> PlasticParameters {
    PlasticParameters {
        friction_slope: 0.98,
        dilatancy_slope: 0.35,
        yield_strength: 42e3,
        hardening_modulus: 100e3,
        plastic_length: 0.0,
        tolerance: 1e-13,
    }
}

/// The parameters above and their limits.
fn variants() -> Vec<(&'static str, PlasticParameters)> {
    let base = hardening();
    let with = |change: &dyn Fn(&mut PlasticParameters)| {
        let mut plastic = base;
        change(&mut plastic);
        plastic
    };
    vec![
        ("hardening", base),
        ("perfect", with(&|plastic| plastic.hardening_modulus = 0.0)),
        ("softening", with(&|plastic| plastic.hardening_modulus = -50e3)),
        ("associated", with(&|plastic| plastic.dilatancy_slope = 0.98)),
        ("without dilatancy", with(&|plastic| plastic.dilatancy_slope = 0.0)),
        (
            "perfect without dilatancy",
            with(&|plastic| (plastic.dilatancy_slope, plastic.hardening_modulus) = (0.0, 0.0)),
        ),
        (
            "softening without dilatancy",
            with(&|plastic| (plastic.dilatancy_slope, plastic.hardening_modulus) = (0.0, -50e3)),
        ),
        (
            "without cohesion",
            with(&|plastic| (plastic.yield_strength, plastic.hardening_modulus) = (0.0, 0.0)),
        ),
        (
            "von Mises",
            with(&|plastic| (plastic.friction_slope, plastic.dilatancy_slope) = (0.0, 0.0)),
        ),
    ]
}

fn for_every_law(mut check: impl FnMut(&str, &HenckyPlasticity)) {
    for (name, plastic) in variants() {
        for components in [Components::Plane, Components::Space] {
            check(name, &HenckyPlasticity::new(&elastic(), &plastic, components));
        }
    }
}

/// A tensor with random components, those out of the plane zero in plane strain.
fn random_tensor(random: &mut Random, components: Components) -> Matrix3<f64> {
    let mut tensor = Matrix3::from_fn(|_, _| random.number());
    if components == Components::Plane {
        for k in 0..3 {
            (tensor[(2, k)], tensor[(k, 2)]) = (0.0, 0.0);
        }
    }
    tensor
}

/// A random deformation gradient: a rotation, and strains of the given size with a pressure of either sign.
fn random_strain(random: &mut Random, components: Components, size: f64) -> ClassicalStrain {
    let turn = Vector3::from_fn(|_, _| random.number());
    let turn = match components {
        Components::Plane => Vector3::new(0.0, 0.0, turn.z),
        Components::Space => turn,
    };
    let pressure = random.number() * size;
    let mut stretch = Matrix3::identity() + random_tensor(random, components) * size;
    for k in 0..if components == Components::Plane { 2 } else { 3 } {
        stretch[(k, k)] += pressure;
    }
    ClassicalStrain {
        deformation_gradient: Rotation3::new(turn) * stretch,
    }
}

/// A state that flowed before.
fn worked_state(law: &HenckyPlasticity, random: &mut Random) -> Vec<f64> {
    let old = virgin(law);
    let strain = random_strain(random, law.components, 0.02);
    answer(law, &strain, &old, 0.0).map_or(old, |(_, new)| new)
}

/// `p`, `q` and `f` of an answer.
fn invariants(law: &HenckyPlasticity, stress: &ClassicalStress, chi: f64) -> (f64, f64, f64) {
    let plastic = law.map.plastic;
    let p = stress.kirchhoff.trace() / 3.0;
    let q = (1.5 * (stress.kirchhoff - Matrix3::from_diagonal_element(p)).norm_squared()).sqrt();
    let f = q + plastic.friction_slope * p - plastic.yield_strength - plastic.hardening_modulus * chi;
    (p, q, f)
}

type Situation = check::Situation<Classical>;

/// Situations of one kind, by search among random ones.
fn collect(
    law: &HenckyPlasticity,
    size: f64,
    wanted: usize,
    belongs: impl Fn(Branch, f64, f64) -> bool,
) -> Vec<Situation> {
    let mut random = Random::new(11);
    let mut found = Vec::new();
    for _ in 0..20_000 {
        let old = worked_state(law, &mut random);
        let strain = random_strain(&mut random, law.components, size);
        let Some((stress, new)) = answer(law, &strain, &old, 0.0) else {
            continue;
        };
        let state = MetricState::unpack(&new);
        let (_, q, f) = invariants(law, &stress, state.chi);
        if belongs(state.branch, q, f) {
            found.push((strain, old));
        }
        if found.len() == wanted {
            return found;
        }
    }
    panic!("only {} situations of {wanted}", found.len());
}

fn subject(law: &dyn Material<Classical>, components: Components, step: f64) -> Subject<'_, Classical> {
    Subject {
        law,
        components,
        length: 1.0,
        step,
        rounding: 1e-13 * MU,
    }
}

fn check_all(law: &dyn Material<Classical>, components: Components, situations: &[Situation], step: f64) {
    check::obeys(&subject(law, components, step), situations);
}

#[test]
fn the_elastic_law_and_its_moduli_belong_together() {
    for components in [Components::Plane, Components::Space] {
        let law = Hencky::new(&elastic(), components);
        let mut random = Random::new(3);
        for size in [0.0, 1e-9, 1e-3, 0.3] {
            let situations: Vec<_> = (0..4)
                .map(|_| (random_strain(&mut random, components, size), Vec::new()))
                .collect();
            check_all(&law, components, &situations, 1e-4);
        }
    }
}

/// `tau = (lambda + 2 mu) ln(l)` along a stretch, `lambda ln(l)` across it.
#[test]
fn the_elastic_stress_of_a_stretch_is_logarithmic() {
    let law = Hencky::new(&elastic(), Components::Plane);
    for stretch in [1e-2, 0.3, 1.0 - 1e-9, 1.5, 40.0] {
        let strain = ClassicalStrain {
            deformation_gradient: Matrix3::from_diagonal(&Vector3::new(1.0, stretch, 1.0)),
        };
        let (stress, _) = answer(&law, &strain, &[], 0.0).expect("an answer");
        let expected = Vector3::new(LAMBDA, LAMBDA + 2.0 * MU, LAMBDA) * f64::ln(stretch);
        let error = (stress.kirchhoff - Matrix3::from_diagonal(&expected)).norm();
        assert!(error < 1e-15 * MU + 1e-13 * expected.norm(), "{stretch}: {error}");
    }
}

#[test]
fn elastic_points_of_the_plastic_law_and_their_moduli_belong_together() {
    for_every_law(|_, law| {
        let found = collect(law, 0.003, 4, |branch, _, f| branch == Branch::Elastic && f < -2e3);
        check_all(law, law.components, &found, 1e-5);
    });
}

#[test]
fn points_on_the_cone_and_their_moduli_belong_together() {
    for_every_law(|_, law| {
        for size in [0.01, 0.1] {
            let found = collect(law, size, 6, |branch, q, _| branch == Branch::Cone && q > 1.2e4);
            check_all(law, law.components, &found, 1e-5);
        }
    });
}

#[test]
fn points_of_the_cone_near_its_apex_and_their_moduli_belong_together() {
    for_every_law(|name, law| {
        if name != "von Mises" {
            let found = collect(law, 0.02, 3, |branch, q, _| {
                branch == Branch::Cone && q > 1e3 && q < 6e3
            });
            check_all(law, law.components, &found, 2e-6);
        }
    });
}

#[test]
fn points_at_the_apex_and_their_moduli_belong_together() {
    for_every_law(|name, law| {
        if name != "von Mises" {
            for size in [0.02, 0.1] {
                let found = collect(law, size, 4, |branch, _, _| branch == Branch::Apex);
                check_all(law, law.components, &found, 1e-5);
            }
        }
    });
}

/// Equal and nearly equal principal strains, where formulas that divide by their difference lose all digits.
#[test]
fn close_principal_strains_do_no_harm() {
    for_every_law(|name, law| {
        let old = virgin(law);
        let mut random = Random::new(13);
        for gap in [0.0, 1e-15, 1e-12, 1e-8, 1e-4] {
            // In-plane principal strains close to each other; the third differs, so that the point yields.
            let stretch = Matrix3::from_diagonal(&Vector3::new(0.97, 0.97 * (1.0 + gap), 1.0));
            let turn = Rotation3::new(Vector3::new(0.0, 0.0, 0.7));
            let strain = ClassicalStrain {
                deformation_gradient: turn * stretch * turn.inverse(),
            };
            let situation = (strain, old.clone());
            let (_, new) = answer(law, &strain, &old, 0.0).expect("an answer");
            assert_ne!(MetricState::unpack(&new).branch, Branch::Apex, "{name}");
            check_all(law, law.components, &[situation], 1e-6);
        }
        // All three equal.
        let pressed = ClassicalStrain {
            deformation_gradient: Matrix3::identity() * 0.99,
        };
        let elastic = (pressed, old);
        for _ in 0..4 {
            let subject = subject(law, law.components, 1e-7);
            check::moduli_are_the_derivative_of_the_stress(&subject, &elastic, &mut random, 0);
        }
    });
}

/// Every answer lies on the surface with a multiplier that does not fall, the plastic volume grows as the flow rule has
/// it, and every strain has an answer.
#[test]
fn answers_satisfy_the_flow_rule() {
    for_every_law(|name, law| {
        let plastic = law.map.plastic;
        let mut random = Random::new(23);
        let (mut failures, mut branches) = (0, [0; 3]);
        for size in [0.005, 0.02, 0.08] {
            for _ in 0..400 {
                let old = worked_state(law, &mut random);
                let strain = random_strain(&mut random, law.components, size);
                let Some((stress, new)) = answer(law, &strain, &old, 0.0) else {
                    failures += 1;
                    continue;
                };
                let (before, after) = (MetricState::unpack(&old), MetricState::unpack(&new));
                let (p, q, f) = invariants(law, &stress, after.chi);
                branches[after.branch.code() as usize] += 1;
                let tolerance = 1e-9 * (p.abs() + q + plastic.yield_strength) + 1e-6;
                let multiplier = after.chi - before.chi;
                // det Cp^-1 is the inverse square of the plastic volume.
                let volume = |state: &MetricState| -0.5 * state.inverse_plastic_metric.determinant().ln();
                let volume_flow = volume(&after) - volume(&before);
                match after.branch {
                    Branch::Elastic => assert!(
                        f <= tolerance
                            && before
                                == MetricState {
                                    branch: before.branch,
                                    ..after
                                }
                    ),
                    Branch::Cone => {
                        assert!(f.abs() <= tolerance && multiplier > 0.0, "{name}: f = {f:e}");
                        assert!(
                            (volume_flow - plastic.dilatancy_slope * multiplier).abs() < 1e-13,
                            "{name}"
                        );
                    }
                    Branch::Apex => {
                        assert!(
                            q <= tolerance && f.abs() <= tolerance && multiplier > 0.0,
                            "{name}: {q:e} {f:e}"
                        );
                        let associated = plastic.dilatancy_slope * multiplier;
                        assert!(
                            plastic.dilatancy_slope == 0.0 || (volume_flow - associated).abs() < 1e-13,
                            "{name}"
                        );
                        assert!(volume_flow >= -1e-13, "{name}: {volume_flow:e}");
                    }
                }
            }
        }
        // A material that softens at the apex faster than its pressure can fall has no answer there.
        assert!(
            failures == 0 || name == "softening without dilatancy",
            "{name}: {failures} failures"
        );
        assert!(branches[0] > 0 && branches[1] > 200, "{name}: {branches:?}");
        assert!(branches[2] > 10 || name == "von Mises", "{name}: {branches:?}");
    });
}

/// Where the two returns meet: stress and chi are continuous along a path from the cone to the apex.
#[test]
fn cone_and_apex_meet() {
    for (name, plastic) in variants().into_iter().filter(|(name, _)| *name != "von Mises") {
        let law = HenckyPlasticity::new(&elastic(), &plastic, Components::Plane);
        let old = virgin(&law);
        let at = |amount: f64| {
            let strain = ClassicalStrain {
                deformation_gradient: Matrix3::new(1.0 + amount, 0.04, 0.0, 0.0, 1.0 + amount, 0.0, 0.0, 0.0, 1.0),
            };
            let (stress, new) = answer(&law, &strain, &old, 0.0).expect("an answer");
            (stress, MetricState::unpack(&new))
        };
        let (mut cone, mut apex) = (-0.001, 0.15);
        assert_eq!(
            (at(cone).1.branch, at(apex).1.branch),
            (Branch::Cone, Branch::Apex),
            "{name}"
        );
        while apex - cone > 1e-12 {
            let middle = 0.5 * (cone + apex);
            if at(middle).1.branch == Branch::Apex {
                apex = middle
            } else {
                cone = middle
            }
        }
        let (left, right) = (at(cone), at(apex));
        assert_eq!(left.1.branch, Branch::Cone, "{name}");
        let jump = (left.0.kirchhoff - right.0.kirchhoff).norm();
        assert!(jump < 1e-3, "{name}: a jump of {jump} Pa over a strain of 1e-12");
        assert!(
            (left.1.chi - right.1.chi).abs() < 1e-9,
            "{name}: {} {}",
            left.1.chi,
            right.1.chi
        );
    }
}

#[test]
fn the_same_strain_has_the_same_answer_in_plane_and_space() {
    for (name, plastic) in variants() {
        let plane = HenckyPlasticity::new(&elastic(), &plastic, Components::Plane);
        let space = HenckyPlasticity::new(&elastic(), &plastic, Components::Space);
        let mut random = Random::new(31);
        for _ in 0..100 {
            let old = worked_state(&plane, &mut random);
            let strain = random_strain(&mut random, Components::Plane, 0.02);
            let answers = (answer(&plane, &strain, &old, 0.0), answer(&space, &strain, &old, 0.0));
            assert_eq!(answers.0, answers.1, "{name}");
            if answers.0.is_none() {
                continue;
            }
            let (in_plane, in_space) = (
                moduli_at(&plane, &strain, &old, 0.0),
                moduli_at(&space, &strain, &old, 0.0),
            );
            for row in [0, 1, 3] {
                for column in [0, 1, 3] {
                    let difference = in_plane.corotational[row][column] - in_space.corotational[row][column];
                    assert!(difference.abs() < 1e-9 * MU, "{name}: {difference}");
                }
            }
        }
    }
}

/// A point that is evaluated again where it stands stays elastic and keeps its stress.
#[test]
fn accepted_points_do_not_flow_again() {
    for_every_law(|name, law| {
        let mut random = Random::new(41);
        for _ in 0..100 {
            let old = worked_state(law, &mut random);
            let strain = random_strain(&mut random, law.components, 0.02);
            let Some((stress, new)) = answer(law, &strain, &old, 0.0) else {
                continue;
            };
            let (again, after) = answer(law, &strain, &new, 0.0).expect("an answer");
            let size = stress.kirchhoff.norm() + 42e3;
            assert!((again.kirchhoff - stress.kirchhoff).norm() < 1e-9 * size, "{name}");
            assert!((after[6] - new[6]).abs() < 1e-12, "{name}: {} and {}", after[6], new[6]);
        }
    });
}

/// Where points that flowed are evaluated again, the moduli that open a step are those of a little more flow.
#[test]
fn steps_open_with_further_flow() {
    for_every_law(|name, law| {
        let mut random = Random::new(5);
        let mut compared = 0;
        for (strain, old) in collect(law, 0.02, 40, |branch, q, _| branch == Branch::Cone && q > 1e4) {
            let (_, flowed) = answer(law, &strain, &old, 0.0).expect("an answer");
            let (stress, again) = answer(law, &strain, &flowed, 0.0).expect("an answer");
            let mut opening = ClassicalModuli {
                corotational: [[0.0; 6]; 6],
            };
            let flows_on = law.opening_moduli(&strain, &flowed, &again, &stress, &mut opening);
            let change = random_tensor(&mut random, law.components) * 1e-8;
            let further = [1.0, -1.0].into_iter().find_map(|sign| {
                let deformation_gradient = (Matrix3::identity() + change * sign) * strain.deformation_gradient;
                let ahead = ClassicalStrain { deformation_gradient };
                let (_, new) = answer(law, &ahead, &flowed, 0.0)?;
                (new[6] > flowed[6]).then_some(ahead)
            });
            let Some(ahead) = further.filter(|_| flows_on) else {
                continue;
            };
            let moduli = moduli_at(law, &ahead, &flowed, 0.0);
            for (left, right) in opening.corotational.iter().zip(&moduli.corotational) {
                for (left, right) in left.iter().zip(right) {
                    assert!((left - right).abs() < 1e-4 * MU, "{name}: {left} {right}");
                }
            }
            compared += 1;
        }
        assert!(compared > 30, "{name}: {compared}");
    });
}

/// The elastic strain of a body turned inside out in one direction, or of nothing, has no logarithm or another one: an
/// error or numbers.
#[test]
fn volumes_turned_inside_out_do_no_harm() {
    for_every_law(|_, law| {
        let old = virgin(law);
        for place in 0..9 {
            for number in [-2.0, 0.0] {
                let mut strain = ClassicalStrain::default();
                strain.deformation_gradient[place] = number;
                if let Some((stress, new)) = answer(law, &strain, &old, 0.0) {
                    assert!(stress.kirchhoff.iter().chain(&new).all(|value| value.is_finite()));
                    law.moduli(&strain, &old, &new, &stress, &mut ClassicalModuli::default());
                }
            }
        }
    });
}

#[test]
fn state_survives_packing() {
    let mut state = MetricState {
        chi: 0.25,
        branch: Branch::Apex,
        ..MetricState::default()
    };
    (
        state.inverse_plastic_metric[(0, 1)],
        state.inverse_plastic_metric[(1, 0)],
    ) = (0.5, 0.5);
    let mut packed = vec![f64::NAN; total_length(MetricState::VARIABLES)];
    state.pack(&mut packed);
    assert_eq!(MetricState::unpack(&packed), state);
    assert_eq!((packed[3], packed[6], packed[7]), (0.5, 0.25, 2.0));
}
