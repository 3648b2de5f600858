use super::*;
use crate::material::check::{self, Random, Situation, Subject, answer};

const LENGTH: f64 = 0.005;

fn elastic() -> ElasticModuli {
    ElasticModuli {
        lambda: 5e6,
        mu: 3e6,
        kappa: 1e6,
        alpha: 40.0,
        beta: 30.0,
        gamma: 100.0,
    }
}

fn hardening() -> PlasticParameters {
    PlasticParameters {
        friction_slope: 0.98,
        dilatancy_slope: 0.35,
        yield_strength: 42e3,
        hardening_modulus: 100e3,
        plastic_length: LENGTH,
        tolerance: 1e-13,
    }
}

/// The parameters above and their limits.
fn variants() -> Vec<(&'static str, PlasticParameters)> {
    let base = hardening();
    vec![
        ("hardening", base),
        (
            "perfect",
            PlasticParameters {
                hardening_modulus: 0.0,
                ..base
            },
        ),
        (
            "softening",
            PlasticParameters {
                hardening_modulus: -50e3,
                ..base
            },
        ),
        (
            "associated",
            PlasticParameters {
                dilatancy_slope: 0.98,
                ..base
            },
        ),
        (
            "without dilatancy",
            PlasticParameters {
                dilatancy_slope: 0.0,
                ..base
            },
        ),
        (
            "without cohesion",
            PlasticParameters {
                yield_strength: 0.0,
                hardening_modulus: 0.0,
                ..base
            },
        ),
        (
            "steep",
            PlasticParameters {
                friction_slope: 2.5,
                dilatancy_slope: 2.0,
                ..base
            },
        ),
        (
            "von Mises",
            PlasticParameters {
                friction_slope: 0.0,
                dilatancy_slope: 0.0,
                ..base
            },
        ),
    ]
}

fn pressed(mut strain: MicropolarStrain, components: Components, amount: f64) -> MicropolarStrain {
    let directions = if components == Components::Plane { 2 } else { 3 };
    for i in 0..directions {
        strain.stretch[(i, i)] += amount;
    }
    strain
}

/// A random strain: stretch of the given size, wryness from none to many times it, pressure of either sign.
fn random_strain(random: &mut Random, components: Components, size: f64) -> MicropolarStrain {
    let bend = [0.0, 1.0, 10.0][(random.number().abs() * 3.0) as usize % 3];
    let strain = random.strain(components, size, bend * size / LENGTH);
    pressed(strain, components, random.number() * size)
}

/// A state that flowed before.
fn worked_state(law: &DruckerPrager, random: &mut Random) -> Vec<f64> {
    let mut state = vec![0.0; 20];
    law.initial_state(&mut state);
    let strain = random_strain(random, law.components, 0.02);
    answer(law, &strain, &state, 0.0).map_or(state, |(_, new)| new)
}

/// Kirchhoff invariants `p`, `q` and `f` of an answer, from what leaves the law.
fn invariants(law: &DruckerPrager, strain: &MicropolarStrain, stress: &MicropolarStress, chi: f64) -> (f64, f64, f64) {
    let tau = stress.force * strain.stretch.transpose();
    let nu = stress.couple * strain.stretch.transpose();
    let p = tau.trace() / 3.0;
    let s = symmetric(&tau) - Matrix3::from_diagonal_element(p);
    let q = (1.5 * (s.norm_squared() + nu.norm_squared() / LENGTH.powi(2))).sqrt();
    (p, q, q + law.plastic.friction_slope * p - law.strength(chi))
}

/// Situations of one kind, by search among random ones.
fn collect(
    law: &DruckerPrager,
    size: f64,
    wanted: usize,
    belongs: impl Fn(Branch, f64, f64) -> bool,
) -> Vec<(MicropolarStrain, Vec<f64>)> {
    let mut random = Random::new(11);
    let mut found = Vec::new();
    for _ in 0..20_000 {
        let old = worked_state(law, &mut random);
        let strain = random_strain(&mut random, law.components, size);
        let Some((stress, new)) = answer(law, &strain, &old, 0.0) else {
            continue;
        };
        let state = PlasticState::unpack(&new);
        let (_, q, f) = invariants(law, &strain, &stress, state.chi);
        if belongs(state.branch, q, f) {
            found.push((strain, old));
        }
        if found.len() == wanted {
            return found;
        }
    }
    panic!("only {} situations of {wanted}", found.len());
}

fn check_all(law: &DruckerPrager, step: f64, found: &[(MicropolarStrain, Vec<f64>)]) {
    let subject = Subject {
        law,
        components: law.components,
        length: LENGTH,
        step,
    };
    let situations: Vec<_> = found
        .iter()
        .map(|(strain, old)| Situation { strain: *strain, old })
        .collect();
    check::micropolar(&subject, &situations);
}

fn for_every_law(mut check: impl FnMut(&str, &DruckerPrager)) {
    for (name, plastic) in variants() {
        for components in [Components::Plane, Components::Space] {
            check(name, &DruckerPrager::new(&elastic(), &plastic, components));
        }
    }
}

#[test]
fn elastic_points_obey_the_laws_of_materials() {
    for_every_law(|_, law| {
        let found = collect(law, 0.003, 4, |branch, _, f| branch == Branch::Elastic && f < -2e3);
        check_all(law, 1e-5, &found);
    });
}

#[test]
fn points_on_the_cone_obey_the_laws_of_materials() {
    for_every_law(|_, law| {
        for size in [0.01, 0.1] {
            let found = collect(law, size, 6, |branch, q, _| branch == Branch::Cone && q > 2e4);
            check_all(law, 1e-5, &found);
        }
    });
}

#[test]
fn points_of_the_cone_near_its_apex_obey_the_laws_of_materials() {
    for_every_law(|name, law| {
        if name != "von Mises" {
            let found = collect(law, 0.02, 3, |branch, q, _| {
                branch == Branch::Cone && q > 1e3 && q < 6e3
            });
            check_all(law, 2e-6, &found);
        }
    });
}

#[test]
fn points_at_the_apex_obey_the_laws_of_materials() {
    for_every_law(|name, law| {
        if name != "von Mises" {
            for size in [0.02, 0.1] {
                let found = collect(law, size, 4, |branch, _, _| branch == Branch::Apex);
                check_all(law, 1e-5, &found);
            }
        }
    });
}

/// Every answer lies on the surface with a multiplier that does not fall, and nearly every strain has one.
#[test]
fn answers_satisfy_the_flow_rule() {
    for_every_law(|name, law| {
        let mut random = Random::new(23);
        let (mut answers, mut failures, mut branches) = (0, 0, [0; 3]);
        for size in [0.005, 0.02, 0.08] {
            for _ in 0..400 {
                let old = worked_state(law, &mut random);
                let strain = random_strain(&mut random, law.components, size);
                let Some((stress, new)) = answer(law, &strain, &old, 0.0) else {
                    failures += 1;
                    continue;
                };
                answers += 1;
                let (before, after) = (PlasticState::unpack(&old), PlasticState::unpack(&new));
                let (p, q, f) = invariants(law, &strain, &stress, after.chi);
                branches[after.branch.code() as usize] += 1;
                let tolerance = 1e-9 * (p.abs() + q + law.strength(after.chi).abs()) + 1e-6;
                assert!(f <= tolerance, "{name}: f = {f:e}");
                match after.branch {
                    Branch::Elastic => assert_eq!(after.chi, before.chi),
                    Branch::Cone => assert!(f.abs() <= tolerance && after.chi > before.chi, "{name}: f = {f:e}"),
                    Branch::Apex => assert!(q <= tolerance && after.chi >= before.chi, "{name}: q = {q:e}"),
                }
            }
        }
        assert!(failures <= 2, "{name}: {failures} failures, {answers} answers");
        assert!(branches[0] > 0 && branches[1] > 200, "{name}: {branches:?}");
        assert!(branches[2] > 10 || name == "von Mises", "{name}: {branches:?}");
    });
}

/// Where the two returns meet: the stress is continuous along a path from the cone to the apex.
#[test]
fn cone_and_apex_meet() {
    for (name, plastic) in variants().into_iter().filter(|(name, _)| *name != "von Mises") {
        let law = DruckerPrager::new(&elastic(), &plastic, Components::Plane);
        let old = {
            let mut state = vec![0.0; 20];
            law.initial_state(&mut state);
            state
        };
        let mut base = Random::new(2).strain(Components::Plane, 0.01, 0.3 / LENGTH * 0.01);
        base.stretch[(0, 1)] += 0.03;
        let at = |amount: f64| {
            let strain = pressed(base, Components::Plane, amount);
            answer(&law, &strain, &old, 0.0).map(|(stress, new)| (stress, PlasticState::unpack(&new)))
        };
        let branch = |amount: f64| at(amount).expect("an answer").1.branch;
        let (mut cone, mut apex) = (-0.001, 0.15);
        assert_eq!((branch(cone), branch(apex)), (Branch::Cone, Branch::Apex), "{name}");
        while apex - cone > 1e-9 {
            let middle = 0.5 * (cone + apex);
            if branch(middle) == Branch::Apex {
                apex = middle
            } else {
                cone = middle
            }
        }
        let (left, right) = (at(cone).expect("an answer"), at(apex).expect("an answer"));
        assert_eq!(left.1.branch, Branch::Cone, "{name}");
        let jump = (left.0.force - right.0.force).norm() + (left.0.couple - right.0.couple).norm() / LENGTH;
        // The play of the condition (1e-6 of the flow) leaves a few tenths of a pascal.
        assert!(jump < 1.0, "{name}: a jump of {jump} Pa over a strain of 1e-9");
        assert!(
            (left.1.chi - right.1.chi).abs() < 1e-5 * (1.0 + right.1.chi),
            "{name}: {} {}",
            left.1.chi,
            right.1.chi
        );
    }
}

/// The same strain in both sets of components gives the same answer.
#[test]
fn plane_equals_space() {
    for (name, plastic) in variants() {
        let plane = DruckerPrager::new(&elastic(), &plastic, Components::Plane);
        let space = DruckerPrager::new(&elastic(), &plastic, Components::Space);
        let mut random = Random::new(31);
        let mut compared = 0;
        for _ in 0..100 {
            let old = worked_state(&plane, &mut random);
            let strain = random_strain(&mut random, Components::Plane, 0.02);
            let answers = (answer(&plane, &strain, &old, 0.0), answer(&space, &strain, &old, 0.0));
            let (Some((left, left_state)), Some((right, right_state))) = answers else {
                continue;
            };
            compared += 1;
            let size = right.force.norm() + 1e3;
            assert!((left.force - right.force).norm() < 1e-8 * size, "{name}");
            assert!((left.couple - right.couple).norm() < 1e-8 * size * LENGTH, "{name}");
            assert!((left_state[18] - right_state[18]).abs() < 1e-9, "{name}");
            let at = |out: &mut MicropolarModuli, law: &DruckerPrager, state: &[f64]| {
                law.moduli(&strain, &old, state, &left, out);
            };
            let (mut in_plane, mut in_space) = (MicropolarModuli::default(), MicropolarModuli::default());
            at(&mut in_plane, &plane, &left_state);
            at(&mut in_space, &space, &left_state);
            for &(k, l) in PlaneSet::DRIVEN_STRETCH {
                for &(i, j) in PlaneSet::DRIVEN_STRETCH {
                    let entry = (component(i, j), component(k, l));
                    let difference = in_plane.force_stretch[entry] - in_space.force_stretch[entry];
                    assert!(difference.abs() < 1e-5 * elastic().mu, "{name} {entry:?}: {difference}");
                }
            }
        }
        assert!(compared > 95, "{name}");
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
            let size = stress.force.norm() + law.plastic.yield_strength;
            assert!((again.force - stress.force).norm() < 1e-9 * size, "{name}");
            assert!(
                (after[18] - new[18]).abs() < 1e-10,
                "{name}: {} and {}",
                after[18],
                new[18]
            );
        }
    });
}

/// With the tolerance that analyses use the answer agrees with the exact one far better than asked.
#[test]
fn default_tolerance_is_sharp() {
    for (name, plastic) in variants() {
        let exact = DruckerPrager::new(&elastic(), &plastic, Components::Plane);
        let loose = PlasticParameters {
            tolerance: 1e-9,
            ..plastic
        };
        let loose = DruckerPrager::new(&elastic(), &loose, Components::Plane);
        for (strain, old) in collect(&exact, 0.02, 50, |branch, q, _| branch == Branch::Cone && q > 4e3) {
            let (left, _) = answer(&exact, &strain, &old, 0.0).expect("an answer");
            let (right, _) = answer(&loose, &strain, &old, 0.0).expect("an answer");
            let difference = (left.force - right.force).norm();
            assert!(difference < 1e-9 * elastic().mu, "{name}: {difference} Pa");
        }
    }
}

#[test]
fn state_survives_packing() {
    let mut state = PlasticState {
        chi: 0.25,
        branch: Branch::Apex,
        ..PlasticState::default()
    };
    state.inverse_plastic_deformation[(0, 1)] = 0.5;
    state.plastic_wryness[(2, 0)] = 7.0;
    let mut packed = vec![f64::NAN; crate::continuum::total_length(PlasticState::VARIABLES)];
    state.pack(&mut packed);
    assert_eq!(PlasticState::unpack(&packed), state);
    assert_eq!(
        (packed[1], packed[9 + 6], packed[18], packed[19]),
        (0.5, 7.0, 0.25, 2.0)
    );
}
