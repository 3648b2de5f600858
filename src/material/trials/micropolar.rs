//! Laws of the micropolar continuum.

use super::*;
use crate::continuum::micropolar::MicropolarStress;
use crate::material::Material;
use crate::material::drucker_prager::{Branch, DruckerPrager, PlasticState};
use crate::material::elastic::Elastic;
use crate::material::spec::{ElasticModuli, PlasticParameters};

/// A law, a strain, and the state before it.
#[derive(Debug)]
struct Trial {
    elastic: ElasticModuli,
    plastic: PlasticParameters,
    strain: MicropolarStrain,
    old: Vec<f64>,
}

/// Lengths from a tenth of the plastic one to three times it; couples of all of the wryness, or of its symmetric deviator
/// alone (bounded stiffness).
fn elastic(random: &mut Random, length: f64) -> ElasticModuli {
    let shear = spread(random, 1e5, 1e11);
    let gamma = shear * (length * spread(random, 0.1, 3.0)).powi(2);
    let bounded = random.number() > 0.0;
    ElasticModuli {
        lambda: shear * choice(random, &[0.0, 0.5, 1.5, 9.0]),
        mu: shear,
        kappa: shear * choice(random, &[0.0, 0.01, 0.3, 1.0, 3.0]),
        alpha: gamma
            * if bounded {
                -2.0 / 3.0
            } else {
                choice(random, &[0.0, 0.4])
            },
        beta: gamma * if bounded { 0.0 } else { choice(random, &[0.0, 0.3, 1.0]) },
        gamma,
    }
}

/// Angles up to 70 degrees, without dilatancy to associated; softening that leaves some of the strength.
fn plastic(random: &mut Random, shear: f64, length: f64, frictional: bool) -> PlasticParameters {
    let (friction, dilatancy) = if frictional {
        let friction = choice(random, &[1.0, 10.0, 30.0, 45.0, 70.0]);
        let share = choice(random, &[0.0, 0.0, 0.1, 0.3, 1.0]);
        (slope(friction), slope(friction * share))
    } else {
        (0.0, 0.0)
    };
    let strength = shear * spread(random, 1e-5, 3e-2);
    let hardening = match (positive(random) * 3.0) as usize {
        0 => shear * spread(random, 1e-4, 1.0),
        1 => -0.2 * positive(random) * strength,
        _ => 0.0,
    };
    PlasticParameters {
        friction_slope: friction,
        dilatancy_slope: dilatancy,
        yield_strength: strength,
        hardening_modulus: hardening,
        plastic_length: length,
        tolerance: TOLERANCE,
    }
}

/// A state that flowed before in two of three trials, and a strain that has nothing to do with the one before it.
fn trial(random: &mut Random, components: Components, frictional: bool) -> Trial {
    let length = spread(random, 1e-4, 1.0);
    let elastic = elastic(random, length);
    let plastic = plastic(random, elastic.mu, length, frictional);
    let law = DruckerPrager::new(&elastic, &plastic, components);
    let mut old = vec![0.0; 20];
    law.initial_state(&mut old);
    let angle = choice(random, &[0.0, 0.1, 0.5]);
    if random.number() > -0.3 {
        let before = 0.2 * size(random);
        let worked = micropolar_strain(random, components, before, [angle, length]);
        let mut new = old.clone();
        if law
            .respond(&worked, &old, &mut new, &mut MicropolarStress::default())
            .is_ok()
        {
            old = new;
        }
    }
    let size = size(random);
    Trial {
        elastic,
        plastic,
        strain: micropolar_strain(random, components, size, [angle, length]),
        old,
    }
}

/// Whether the strength at the apex falls faster with the flow than the stress: then strains beyond the cone have no answer.
/// In large strains the stress falls as slowly as with a third of the stiffness.
fn apex_is_unstable(trial: &Trial) -> bool {
    let Trial { elastic, plastic, .. } = trial;
    let softening = -plastic.hardening_modulus;
    let stiffness = plastic.friction_slope * (elastic.lambda + 2.0 / 3.0 * elastic.mu) / 3.0;
    let fall = if plastic.dilatancy_slope > 0.0 {
        stiffness * plastic.dilatancy_slope
    } else {
        stiffness
    };
    plastic.friction_slope > 0.0 && softening >= fall
}

fn map(x: &Matrix3<f64>, trace: f64, symmetric: f64, skew: f64) -> Matrix3<f64> {
    Matrix3::identity() * (trace * x.trace()) + (x + x.transpose()) * symmetric + (x - x.transpose()) * skew
}

fn force(elastic: &ElasticModuli, stretch: &Matrix3<f64>) -> Matrix3<f64> {
    map(
        &(stretch - Matrix3::identity()),
        elastic.lambda,
        elastic.mu,
        elastic.kappa,
    )
}

fn couple(elastic: &ElasticModuli, wryness: &Matrix3<f64>) -> Matrix3<f64> {
    map(wryness, elastic.alpha, elastic.gamma, elastic.beta)
}

/// What a step did, from the states before and after it.
struct Step {
    /// `D`, from `exp(D) = Ue* Ue^-1`.
    flow: Matrix3<f64>,
    /// `Gammae* - Gammae`.
    bend: Matrix3<f64>,
    multiplier: f64,
    branch: Branch,
    /// Size of the strains.
    strains: f64,
}

/// Checks the stress, and that the flow is symmetric.
fn step(trial: &Trial, stress: &MicropolarStress, new: &[f64]) -> Result<Step, String> {
    let Trial {
        elastic,
        plastic,
        strain,
        ..
    } = trial;
    let (before, after) = (PlasticState::unpack(&trial.old), PlasticState::unpack(new));
    let start = strain.stretch * before.inverse_plastic_deformation;
    let end = strain.stretch * after.inverse_plastic_deformation;
    let near = |what, value, scale| near(what, value, scale, 1e-6);
    let expected = force(elastic, &end) * after.inverse_plastic_deformation.transpose();
    near(
        "force",
        (expected - stress.force).norm(),
        stress.force.norm() + plastic.yield_strength,
    )?;
    let (wryness, bend) = (
        strain.wryness - after.plastic_wryness,
        after.plastic_wryness - before.plastic_wryness,
    );
    let size = elastic.gamma * (wryness.norm() + strain.wryness.norm());
    near("couple", (couple(elastic, &wryness) - stress.couple).norm(), size)?;
    let relative = start * end.try_inverse().ok_or("a singular elastic stretch")?;
    near(
        "symmetric flow",
        (relative - relative.transpose()).norm(),
        relative.norm(),
    )?;
    let flow = half_logarithm(&(relative * relative));
    let multiplier = after.chi - before.chi;
    if multiplier < 0.0 {
        return Err(format!("chi falls by {multiplier:e}"));
    }
    let strains = (start - Matrix3::identity()).norm() + flow.norm() + strain.wryness.norm() * plastic.plastic_length;
    Ok(Step {
        flow,
        bend,
        multiplier,
        branch: after.branch,
        // Times 1e-6: the tolerance of the law, which is one of strains, a few times.
        strains: strains + multiplier + 4e-3,
    })
}

/// Checks stress, yield function and flow rule from strain and state alone; the branch by name.
fn verify(trial: &Trial, stress: &MicropolarStress, new: &[f64]) -> Result<&'static str, String> {
    let plastic = &trial.plastic;
    let Step {
        flow,
        bend,
        multiplier,
        branch,
        strains,
    } = step(trial, stress, new)?;
    let near = |what, value, scale| near(what, value, scale, 1e-6);
    let (u, length) = (trial.strain.stretch, plastic.plastic_length);
    let (tau, nu) = (stress.force * u.transpose(), stress.couple * u.transpose());
    let p = tau.trace() / 3.0;
    let s = deviator(&((tau + tau.transpose()) * 0.5));
    let q = (1.5 * (s.norm_squared() + nu.norm_squared() / length.powi(2))).sqrt();
    let hardened = plastic.hardening_modulus * new[18];
    let value = q + plastic.friction_slope * p - plastic.yield_strength - hardened;
    let scale = tau.norm() * (1.0 + plastic.friction_slope) + q + plastic.yield_strength + hardened.abs();
    let dilatancy = flow.trace() - plastic.dilatancy_slope * multiplier;
    match branch {
        Branch::Elastic => {
            near("f", value.max(0.0), scale)?;
            near("flow", flow.norm() + multiplier + bend.norm() * length, strains)?;
            Ok("elastic")
        }
        Branch::Cone => {
            near("f", value, scale)?;
            near("dilatancy", dilatancy, strains)?;
            let across = deviator(&flow) * q - s * (1.5 * multiplier);
            near("direction", across.norm(), strains * scale)?;
            let across = bend * (q * length) - nu * u * (1.5 * multiplier / length);
            near("direction of the wryness", across.norm(), strains * scale)?;
            Ok("cone")
        }
        Branch::Apex => {
            near("f", value, scale)?;
            near("q", q, scale)?;
            let norm = |flow: &Matrix3<f64>| (2.0f64 / 3.0).sqrt() * flow.norm();
            if plastic.dilatancy_slope > 0.0 {
                near("dilatancy", dilatancy, strains)?;
                near(
                    "admissible flow",
                    (norm(&deviator(&flow)) - multiplier).max(0.0),
                    10.0 * strains,
                )?;
            } else {
                near("volume", flow.trace().min(0.0), 10.0 * strains)?;
                near("multiplier", (norm(&flow) - multiplier).max(0.0), strains)?;
            }
            Ok("apex")
        }
    }
}

/// All trials of a law; every answer is verified.
fn tally(components: Components, frictional: bool) -> Tally {
    let respond = |trial: &Trial| {
        let law = DruckerPrager::new(&trial.elastic, &trial.plastic, components);
        let mut new = vec![f64::NAN; 20];
        let mut stress = MicropolarStress::default();
        law.respond(&trial.strain, &trial.old, &mut new, &mut stress)?;
        Ok(verify(trial, &stress, &new))
    };
    let make = |random: &mut Random| trial(random, components, frictional);
    Tally::of(components, make, respond, |trial| !apex_is_unstable(trial))
}

#[test]
fn drucker_and_pragers_cone_of_the_micropolar_continuum() {
    for components in [Components::Plane, Components::Space] {
        let tally = tally(components, true);
        assert!(tally.share() >= 0.999, "{tally:?}");
        assert_eq!(tally.returned.len(), 3, "elastic, cone and apex: {tally:?}");
    }
}

#[test]
fn von_mises_cylinder_of_the_micropolar_continuum() {
    for components in [Components::Plane, Components::Space] {
        let tally = tally(components, false);
        assert!(tally.share() >= 0.999, "{tally:?}");
        assert_eq!(tally.returned.len(), 2, "elastic and cylinder: {tally:?}");
    }
}

#[test]
fn micropolar_elasticity() {
    for components in [Components::Plane, Components::Space] {
        let mut random = Random::new(67);
        for index in 0..trials() {
            let Trial { elastic, strain, .. } = trial(&mut random, components, false);
            let law = Elastic::new(&elastic, components);
            let mut stress = MicropolarStress::default();
            law.respond(&strain, &[], &mut [], &mut stress).expect("an answer");
            let (force, couple) = (force(&elastic, &strain.stretch), couple(&elastic, &strain.wryness));
            let error = (stress.force - force).norm() + (stress.couple - couple).norm();
            assert!(
                error <= 1e-13 * (force.norm() + couple.norm()),
                "trial {index}: {elastic:?} {strain:?}"
            );
        }
    }
}
