//! The sandstone law, in both of its continua.

use super::*;
use crate::continuum::gradient_micropolar::{GradientMicropolar, GradientMicropolarStrain, GradientMicropolarStress};
use crate::continuum::micropolar::{Micropolar, MicropolarStress};
use crate::material::Material;
use crate::material::sandstone::{Sandstone, SandstoneState};
use crate::material::spec::{SandstoneDamage, SandstoneParameters, SandstoneYield};

/// A law, a strain, and the state before it.
#[derive(Debug)]
struct Trial {
    parameters: SandstoneParameters,
    plastic: SandstoneYield,
    strain: MicropolarStrain,
    /// Nonlocal damage field.
    alpha: f64,
    old: Vec<f64>,
}

/// What is not drawn for each trial.
struct Kind {
    /// Rates at which dilatancy dies out with the flow.
    rates: &'static [f64],
    /// Gradient-enhanced with damage, or micropolar.
    damaged: bool,
}

/// Angles up to 60 degrees, dilatancy none to associated, lasting or dying out.
fn plastic(random: &mut Random, shear: f64, length: f64, rates: &[f64]) -> SandstoneYield {
    let friction = choice(random, &[0.0, 10.0, 30.0, 45.0, 60.0]);
    let strength = shear * spread(random, 1e-5, 3e-2);
    SandstoneYield {
        strength,
        friction_slope: slope(friction),
        dilatancy_slope: slope(friction * choice(random, &[0.0, 0.3, 1.0])),
        hardening_stress: strength * choice(random, &[0.0, 1.0]),
        hardening_rate: 1400.0,
        dilation_rate: choice(random, rates),
        plastic_length: length,
        weights: [0.5, 0.0, 0.5, 0.0],
        apex_rounding: 1e-3 * strength,
        tolerance: TOLERANCE,
    }
}

fn parameters(random: &mut Random, length: f64, kind: &Kind) -> (SandstoneParameters, SandstoneYield) {
    let shear = spread(random, 1e5, 1e11);
    let gamma = shear * (length * spread(random, 0.1, 3.0)).powi(2);
    let bounded = random.number() > 0.0;
    let plastic = plastic(random, shear, length, kind.rates);
    let damage = SandstoneDamage {
        length,
        softening_modulus: 0.1,
        max_damage: 0.99,
    };
    let parameters = SandstoneParameters {
        shear_modulus: shear,
        bulk_modulus: shear * choice(random, &[0.7, 1.3, 3.0, 10.0]),
        coupling_modulus: shear * choice(random, &[0.0, 0.01, 0.3, 1.0, 3.0]),
        alpha: gamma
            * if bounded {
                -2.0 / 3.0
            } else {
                choice(random, &[0.0, 0.4])
            },
        beta: gamma * if bounded { 0.0 } else { choice(random, &[0.0, 0.3, 1.0]) },
        gamma,
        plastic: Some(plastic),
        damage: kind.damaged.then_some(damage),
    };
    (parameters, plastic)
}

/// What the law answers with: that of its own continuum, without the source and the flux of damage.
fn respond(trial: &Trial, components: Components) -> Result<(MicropolarStress, Vec<f64>), NoSolution> {
    let law = Sandstone::new(&trial.parameters, components);
    let mut new = vec![f64::NAN; 20];
    if trial.parameters.damage.is_none() {
        let mut stress = MicropolarStress::default();
        Material::<Micropolar>::respond(&law, &trial.strain, &trial.old, &mut new, &mut stress)?;
        return Ok((stress, new));
    }
    let strain = GradientMicropolarStrain {
        micropolar: trial.strain,
        alpha: trial.alpha,
        ..GradientMicropolarStrain::default()
    };
    let mut stress = GradientMicropolarStress::default();
    Material::<GradientMicropolar>::respond(&law, &strain, &trial.old, &mut new, &mut stress)?;
    Ok((stress.micropolar, new))
}

/// A state that flowed before in two of three trials, and a strain that has nothing to do with the one before it.
fn trial(random: &mut Random, components: Components, kind: &Kind) -> Trial {
    let length = spread(random, 1e-4, 1.0);
    let (parameters, plastic) = parameters(random, length, kind);
    let angle = choice(random, &[0.0, 0.1, 0.5]);
    let mut old = vec![0.0; 20];
    SandstoneState::default().pack(&mut old);
    let before = 0.2 * size(random);
    let mut trial = Trial {
        parameters,
        plastic,
        strain: micropolar_strain(random, components, before, [angle, length]),
        alpha: 0.1 * random.number(),
        old,
    };
    if random.number() > -0.3
        && let Ok((_, new)) = respond(&trial, components)
    {
        trial.old = new;
    }
    let size = size(random);
    trial.strain = micropolar_strain(random, components, size, [angle, length]);
    trial
}

/// Stresses of the elastic state: the deviator of the Mandel stress, the mean stress, the couple-stress and `q`.
fn stresses(trial: &Trial, stretch: &Matrix3<f64>, wryness: &Matrix3<f64>) -> (Matrix3<f64>, f64, Matrix3<f64>, f64) {
    let Trial {
        parameters, plastic, ..
    } = trial;
    let j = stretch.determinant();
    let v = stretch / j.cbrt();
    let (g, gc) = (parameters.shear_modulus, parameters.coupling_modulus);
    let s = deviator(&(v.transpose() * v * (g + gc) - (v * v).transpose() * gc));
    let p = 0.25 * parameters.bulk_modulus * (j * j - 1.0 / (j * j));
    let m = wryness * (parameters.gamma + parameters.beta)
        + wryness.transpose() * (parameters.gamma - parameters.beta)
        + Matrix3::from_diagonal_element(parameters.alpha * wryness.trace());
    let [a1, a2, a3, a4] = plastic.weights;
    let couples = (a3 * m.dot(&m) + a4 * m.dot(&m.transpose())) / plastic.plastic_length.powi(2);
    let j2 = a1 * s.dot(&s) + a2 * s.dot(&s.transpose()) + couples;
    (s, p, m, (3.0 * j2 + plastic.apex_rounding.powi(2)).sqrt())
}

/// Dilatancy after hardening.
fn dilatancy(plastic: &SandstoneYield, chi: f64) -> f64 {
    plastic.dilatancy_slope * (-plastic.dilation_rate * chi).exp()
}

/// `f` without `q`.
fn rest_of_yield(plastic: &SandstoneYield, pressure: f64, chi: f64) -> f64 {
    let hardening = -plastic.hardening_stress * (-plastic.hardening_rate * chi).exp_m1();
    plastic.friction_slope * pressure - plastic.strength - hardening
}

/// Whether some amount of flow may bring `f` to zero: `q` falls by no more than the stiffness times the flow, and never
/// below its rounding at the apex; the mean stress follows from the flow alone.
fn may_have_answer(trial: &Trial) -> bool {
    let Trial {
        parameters, plastic, ..
    } = trial;
    let old = SandstoneState::unpack(&trial.old);
    let stretch = trial.strain.stretch * old.inverse_plastic_deformation;
    let (.., q) = stresses(trial, &stretch, &(trial.strain.wryness - old.plastic_wryness));
    let volume = stretch.determinant();
    let largest = stretch.singular_values().max() / volume.cbrt();
    let forces = 3.0 * (parameters.shear_modulus + 2.0 * parameters.coupling_modulus) * largest.powi(2);
    let stiffest = (2.0 * parameters.gamma)
        .max(2.0 * parameters.beta)
        .max(3.0 * parameters.alpha + 2.0 * parameters.gamma);
    let fall = forces + 1.5 * stiffest / plastic.plastic_length.powi(2);
    (-3000..=500).any(|k| {
        let multiplier = 10f64.powf(f64::from(k) * 2e-3);
        let chi = old.chi + multiplier;
        let grown = volume * (-dilatancy(plastic, chi) * multiplier).exp();
        let pressure = 0.25 * parameters.bulk_modulus * (grown.powi(2) - grown.powi(-2));
        (q - fall * multiplier).max(plastic.apex_rounding) + rest_of_yield(plastic, pressure, chi) <= 0.0
    })
}

/// Checks stress, yield function and flow rule from strain and state alone; the kind of response by name.
fn verify(trial: &Trial, stress: &MicropolarStress, new: &[f64]) -> Result<&'static str, String> {
    let Trial {
        parameters,
        plastic,
        strain,
        ..
    } = trial;
    let near = |what, value, scale| near(what, value, scale, 1e-6);
    let (before, after) = (SandstoneState::unpack(&trial.old), SandstoneState::unpack(new));
    let start = strain.stretch * before.inverse_plastic_deformation;
    let end = strain.stretch * after.inverse_plastic_deformation;
    let wryness = strain.wryness - after.plastic_wryness;
    let (s, p, m, q) = stresses(trial, &end, &wryness);
    let intact = match parameters.damage {
        Some(damage) => (-trial.alpha / damage.softening_modulus).exp().clamp(0.01, 1.0),
        None => 1.0,
    };
    // Ue^T B Fp^T is the Mandel stress.
    let mandel = s * intact + Matrix3::from_diagonal_element(p);
    let inverse = end.try_inverse().ok_or("a singular elastic stretch")?;
    let force = inverse.transpose() * mandel * after.inverse_plastic_deformation.transpose();
    // Times 1e-6: what strains within a hundredth of the tolerance of the law make.
    let rounding = 1e-5 * (parameters.bulk_modulus + parameters.shear_modulus + parameters.coupling_modulus);
    near("force", (force - stress.force).norm(), force.norm() + rounding)?;
    let couples = parameters.gamma * (strain.wryness.norm() + wryness.norm());
    near("couple", (m * intact - stress.couple).norm(), couples)?;
    let value = q + rest_of_yield(plastic, p, after.chi);
    let scale = q + plastic.friction_slope * p.abs() + plastic.strength + plastic.hardening_stress + rounding;
    let multiplier = after.chi - before.chi;
    let bend = after.plastic_wryness - before.plastic_wryness;
    if multiplier == 0.0 {
        near("f", value.max(0.0), scale)?;
        near(
            "flow",
            (end - start).norm() + bend.norm() * plastic.plastic_length,
            start.norm(),
        )?;
        return Ok("elastic");
    }
    near("f", value, scale)?;
    near("multiplier", multiplier.min(0.0), 0.0)?;
    let [a1, a2, a3, a4] = plastic.weights;
    let direction = (s * (2.0 * a1) + s.transpose() * (2.0 * a2)) * (1.5 / q);
    let spherical = Matrix3::from_diagonal_element(dilatancy(plastic, after.chi) / 3.0);
    let exponential = ((direction + spherical) * multiplier).exp();
    near(
        "flow",
        (end * exponential - start).norm(),
        start.norm() * (1.0 + multiplier),
    )?;
    let length_squared = plastic.plastic_length.powi(2);
    let direction = (m * (2.0 * a3) + m.transpose() * (2.0 * a4)) * (1.5 / (q * length_squared));
    near(
        "wryness",
        (bend - direction * multiplier).norm(),
        strain.wryness.norm() + bend.norm(),
    )?;
    Ok("plastic")
}

/// All trials in one of the continua; every answer is verified.
fn tally(components: Components, kind: &Kind) -> Tally {
    let respond = |trial: &Trial| {
        let (stress, new) = respond(trial, components)?;
        Ok(verify(trial, &stress, &new))
    };
    let make = |random: &mut Random| trial(random, components, kind);
    Tally::of(components, make, respond, may_have_answer)
}

#[test]
fn sandstone_with_lasting_dilatancy() {
    for components in [Components::Plane, Components::Space] {
        for damaged in [false, true] {
            let rates = &[0.0, 1.0];
            let tally = tally(components, &Kind { rates, damaged });
            assert!(tally.share() >= 0.999, "{tally:?}");
            assert_eq!(tally.returned.len(), 2, "elastic and plastic: {tally:?}");
        }
    }
}

/// Where dilatancy dies out soon, the bound of `f` does not tell for all refused states that they have no stress.
#[test]
fn sandstone_whose_dilatancy_dies_out() {
    for components in [Components::Plane, Components::Space] {
        let rates = &[20.0];
        let tally = tally(components, &Kind { rates, damaged: true });
        assert!(tally.share() >= 0.98, "{tally:?}");
        assert_eq!(tally.returned.len(), 2, "elastic and plastic: {tally:?}");
    }
}
