//! Laws of the classical continuum.

use super::*;
use crate::continuum::classical::{ClassicalStrain, ClassicalStress};
use crate::material::Material;
use crate::material::drucker_prager::Branch;
use crate::material::hencky::{Hencky, HenckyPlasticity, MetricState};
use crate::material::spec::{ElasticModuli, PlasticParameters};

/// A law, a strain, and the state before it.
#[derive(Debug)]
struct Trial {
    elastic: ElasticModuli,
    plastic: PlasticParameters,
    strain: ClassicalStrain,
    old: Vec<f64>,
}

/// Angles from one degree to nearly upright, without dilatancy to associated; softening to 99 % of what is allowed.
fn plastic(random: &mut Random, shear: f64, bulk: f64, frictional: bool) -> PlasticParameters {
    let strength = shear * spread(random, 1e-5, 3e-2);
    let (friction, dilatancy) = if frictional {
        let friction = choice(random, &[1.0, 10.0, 30.0, 45.0, 70.0, 89.0]);
        (
            slope(friction),
            slope(friction * choice(random, &[0.0, 0.0, 1e-3, 0.3, 1.0])),
        )
    } else {
        (0.0, 0.0)
    };
    let hardening = match (positive(random) * 4.0) as usize {
        0 => shear * spread(random, 1e-4, 1.0),
        1 => -0.99 * positive(random) * (3.0 * shear + bulk * friction * dilatancy),
        2 => -shear * spread(random, 1e-4, 1e-1),
        _ => 0.0,
    };
    PlasticParameters {
        friction_slope: friction,
        dilatancy_slope: dilatancy,
        yield_strength: strength,
        hardening_modulus: hardening,
        plastic_length: 0.0,
        tolerance: TOLERANCE,
    }
}

/// A state that flowed before in two of three trials, and a strain that has nothing to do with the one before it.
fn trial(random: &mut Random, components: Components, frictional: bool) -> Trial {
    let shear = spread(random, 1e5, 1e11);
    let lambda = shear * choice(random, &[0.0, 0.5, 1.5, 9.0, 100.0]);
    let elastic = ElasticModuli::without_rotations(lambda, shear);
    let plastic = plastic(random, shear, lambda + 2.0 / 3.0 * shear, frictional);
    let law = HenckyPlasticity::new(&elastic, &plastic, components);
    let mut old = vec![0.0; 8];
    law.initial_state(&mut old);
    let strain = |random: &mut Random, size: f64| ClassicalStrain {
        deformation_gradient: rotation(random, components, 3.0) * stretch(random, components, size),
    };
    if random.number() > -0.3 {
        let before = size(random);
        let worked = strain(random, before);
        let mut new = old.clone();
        // A point that has softened by hundreds of per cent of flow is none that an analysis meets.
        if law
            .respond(&worked, &old, &mut new, &mut ClassicalStress::default())
            .is_ok()
            && new[6] < 2.0
        {
            old = new;
        }
    }
    let size = size(random);
    Trial {
        elastic,
        plastic,
        strain: strain(random, size),
        old,
    }
}

/// The smallest flow along the return for which `f` is not positive, by scanning: whether there is an answer.
fn has_answer(trial: &Trial) -> bool {
    let Trial { elastic, plastic, .. } = trial;
    let old = MetricState::unpack(&trial.old);
    let f = trial.strain.deformation_gradient;
    let strain = half_logarithm(&(f * old.inverse_plastic_metric * f.transpose()));
    let bulk = elastic.lambda + 2.0 / 3.0 * elastic.mu;
    let pressure = bulk * strain.trace();
    let equivalent = (2.0 / 3.0 * deviator(&strain).norm_squared()).sqrt();
    let strength = |chi: f64| plastic.yield_strength + plastic.hardening_modulus * chi;
    let (alpha, beta) = (plastic.friction_slope, plastic.dilatancy_slope);
    let on_cone =
        |dg: f64| 3.0 * elastic.mu * (equivalent - dg) + alpha * (pressure - bulk * beta * dg) - strength(old.chi + dg);
    let at_apex = |d: f64| {
        let multiplier = if beta > 0.0 {
            d / beta
        } else {
            (equivalent.powi(2) + 2.0 / 9.0 * d * d).sqrt()
        };
        alpha * (pressure - bulk * d) - strength(old.chi + multiplier)
    };
    let clear = 1e-9 * (pressure.abs() * alpha + 3.0 * elastic.mu * equivalent + strength(old.chi).abs());
    let end = beta * equivalent;
    on_cone(equivalent) <= -clear
        || alpha > 0.0
            && (-4000..1000)
                .map(|k| end + 10f64.powf(f64::from(k) * 2e-3))
                // A pressure beyond that is no state of a solid.
                .any(|d| strain.trace() - d >= -30.0 && at_apex(d) <= -clear)
}

fn kirchhoff(elastic: &ElasticModuli, strain: &Matrix3<f64>) -> Matrix3<f64> {
    Matrix3::from_diagonal_element(elastic.lambda * strain.trace()) + strain * (2.0 * elastic.mu)
}

/// Checks stress, yield function and flow rule from strain and state alone; the branch by name.
fn verify(trial: &Trial, stress: &ClassicalStress, new: &[f64]) -> Result<&'static str, String> {
    let Trial { elastic, plastic, .. } = trial;
    let near = |what, value, scale| near(what, value, scale, 1e-7);
    let (before, after) = (MetricState::unpack(&trial.old), MetricState::unpack(new));
    let f = trial.strain.deformation_gradient;
    let logarithm = |state: &MetricState| half_logarithm(&(f * state.inverse_plastic_metric * f.transpose()));
    let (start, end) = (logarithm(&before), logarithm(&after));
    let tau = kirchhoff(elastic, &end);
    let size = (elastic.lambda + elastic.mu) * (start.norm() + end.norm()) + plastic.yield_strength;
    near("stress", (tau - stress.kirchhoff).norm(), size)?;
    let (p, s) = (tau.trace() / 3.0, deviator(&tau));
    let q = 1.5f64.sqrt() * s.norm();
    let value = q + plastic.friction_slope * p - plastic.yield_strength - plastic.hardening_modulus * after.chi;
    let scale = size * (1.0 + plastic.friction_slope) + plastic.hardening_modulus.abs() * after.chi;
    let flow = start - end;
    let multiplier = after.chi - before.chi;
    let equivalent = (2.0 / 3.0 * deviator(&flow).norm_squared()).sqrt();
    let strains = start.norm() + end.norm() + multiplier;
    let dilatancy = flow.trace() - plastic.dilatancy_slope * multiplier;
    if multiplier < 0.0 {
        return Err(format!("chi falls by {multiplier:e}"));
    }
    match after.branch {
        Branch::Elastic => {
            near("f", value.max(0.0), scale)?;
            near("flow", flow.norm() + multiplier, strains)?;
            Ok("elastic")
        }
        Branch::Cone => {
            near("f", value, scale)?;
            near("dilatancy", dilatancy, strains)?;
            near("multiplier", equivalent - multiplier, strains)?;
            let across = deviator(&flow) * q - s * (1.5 * multiplier);
            near("direction", across.norm(), strains * size)?;
            Ok("cone")
        }
        Branch::Apex => {
            near("f", value, scale)?;
            near("q", q, size)?;
            near("admissible flow", (equivalent - multiplier).max(0.0), strains)?;
            if plastic.dilatancy_slope > 0.0 {
                near("dilatancy", dilatancy, strains)?;
            } else {
                near("multiplier", (2.0f64 / 3.0).sqrt() * flow.norm() - multiplier, strains)?;
                near("volume", flow.trace().min(0.0), strains)?;
            }
            Ok("apex")
        }
    }
}

/// All trials of a law; every answer is verified.
fn tally(components: Components, frictional: bool) -> Tally {
    let respond = |trial: &Trial| {
        let law = HenckyPlasticity::new(&trial.elastic, &trial.plastic, components);
        let mut new = vec![f64::NAN; 8];
        let mut stress = ClassicalStress::default();
        law.respond(&trial.strain, &trial.old, &mut new, &mut stress)?;
        Ok(verify(trial, &stress, &new))
    };
    let make = |random: &mut Random| trial(random, components, frictional);
    Tally::of(components, make, respond, has_answer)
}

#[test]
fn drucker_and_pragers_cone_of_the_classical_continuum() {
    for components in [Components::Plane, Components::Space] {
        let tally = tally(components, true);
        assert!(tally.share() >= 0.9999, "{tally:?}");
        assert_eq!(tally.returned.len(), 3, "elastic, cone and apex: {tally:?}");
    }
}

#[test]
fn von_mises_cylinder_of_the_classical_continuum() {
    for components in [Components::Plane, Components::Space] {
        let tally = tally(components, false);
        assert!(tally.share() >= 0.9999, "{tally:?}");
        assert_eq!(tally.returned.len(), 2, "elastic and cylinder: {tally:?}");
    }
}

/// `tau = lambda tr(eps) I + 2 mu eps` for every strain there is.
#[test]
fn hencky_elasticity() {
    for components in [Components::Plane, Components::Space] {
        let mut random = Random::new(67);
        for index in 0..trials() {
            let trial = trial(&mut random, components, false);
            let law = Hencky::new(&trial.elastic, components);
            let mut stress = ClassicalStress::default();
            law.respond(&trial.strain, &[], &mut [], &mut stress)
                .expect("an answer");
            let f = trial.strain.deformation_gradient;
            let strain = half_logarithm(&(f * f.transpose()));
            let expected = kirchhoff(&trial.elastic, &strain);
            let error = (stress.kirchhoff - expected).norm();
            // The second term is the rounding of F.
            let modulus = trial.elastic.lambda + trial.elastic.mu;
            let bound = modulus * (1e-9 * strain.norm() + 1e-14);
            assert!(error <= bound, "trial {index}: {trial:?}");
        }
    }
}
