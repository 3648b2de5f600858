use super::*;
use crate::continuum::tensor::component;
use crate::material::check::{self, Random, Situation, Subject, driven};
use crate::material::spec::{SandstoneDamage, SandstoneYield};
use nalgebra::Vector3;

/// The paper's Table 1 in SI units, with a coupling, weights and couple stiffnesses that leave no term out.
pub fn general() -> SandstoneParameters {
    let shear = 13.0e9 / 2.7;
    let gamma = shear * 3.0e-6;
    SandstoneParameters {
        shear_modulus: shear,
        bulk_modulus: 13.0e9 / 0.9,
        coupling_modulus: 0.4 * shear,
        alpha: -0.4 * gamma,
        beta: 0.3 * gamma,
        gamma,
        plastic: Some(SandstoneYield {
            strength: 11.9e6,
            friction_slope: 0.857,
            dilatancy_slope: 0.614,
            hardening_stress: 11.0e6,
            hardening_rate: 1400.0,
            dilation_rate: 20.0,
            plastic_length: 1.0e-3,
            weights: [0.4, 0.1, 0.35, 0.15],
            apex_rounding: 1.0e4,
            tolerance: 1e-13,
        }),
        damage: Some(SandstoneDamage {
            length: 1.0e-3,
            softening_modulus: 0.11,
            max_damage: 0.99,
        }),
    }
}

fn plastic(mut parameters: SandstoneParameters, change: impl Fn(&mut SandstoneYield)) -> SandstoneParameters {
    parameters.plastic.iter_mut().for_each(change);
    parameters
}

/// The parameters above, those of the paper and limits of them.
fn variants() -> Vec<(&'static str, SandstoneParameters)> {
    let general = general();
    let paper = SandstoneParameters {
        coupling_modulus: general.shear_modulus,
        alpha: -2.0 / 3.0 * general.gamma,
        beta: 0.0,
        ..plastic(general, |p| p.weights = [0.5, 0.0, 0.5, 0.0])
    };
    vec![
        ("general", general),
        ("paper", paper),
        ("without hardening", plastic(general, |p| p.hardening_stress = 0.0)),
        ("without dilatancy", plastic(general, |p| p.dilatancy_slope = 0.0)),
        ("without friction", plastic(general, |p| p.friction_slope = 0.0)),
        ("literal apex", plastic(general, |p| p.apex_rounding = 0.0)),
        ("blunt apex", plastic(general, |p| p.apex_rounding = 2.0e6)),
        (
            "without coupling",
            SandstoneParameters {
                coupling_modulus: 0.0,
                ..general
            },
        ),
    ]
}

fn material(law: &Sandstone) -> &dyn Material<GradientMicropolar> {
    law
}

fn respond(
    law: &Sandstone,
    strain: &GradientMicropolarStrain,
    old: &[f64],
) -> Result<(GradientMicropolarStress, Vec<f64>), NoSolution> {
    let mut new = vec![f64::NAN; 20];
    let mut stress = GradientMicropolarStress::default();
    material(law).respond(strain, old, &mut new, &mut stress)?;
    Ok((stress, new))
}

fn virgin() -> Vec<f64> {
    let mut state = vec![0.0; 20];
    SandstoneState::default().pack(&mut state);
    state
}

/// A strain: compression along all axes by `compression`, `size` of everything else.
fn strain(random: &mut Random, components: Components, compression: f64, size: f64) -> GradientMicropolarStrain {
    let mut micropolar = random.strain(components, size, size / 1.0e-3);
    let (stretches, _) = driven(components);
    for &(i, j) in stretches.iter().filter(|(i, j)| i == j) {
        micropolar.stretch[(i, j)] -= compression;
    }
    GradientMicropolarStrain {
        micropolar,
        alpha: 0.02,
        alpha_gradient: Vector3::new(0.3, -0.2, 0.1),
    }
}

/// Micropolar strains for the common checks: elastic, plastic from virgin material, plastic again, tension.
fn situations(law: &Sandstone, components: Components) -> Vec<(MicropolarStrain, Vec<f64>)> {
    let mut random = Random::new(7);
    let old = virgin();
    let mut list = Vec::new();
    for (compression, size) in [(0.002, 1e-4), (0.004, 4e-3), (0.01, 0.02), (0.05, 0.1), (-0.002, 1e-3)] {
        let first = strain(&mut random, components, compression, size).micropolar;
        let mut new = vec![0.0; 20];
        let mut stress = MicropolarStress::default();
        let law: &dyn Material<Micropolar> = law;
        if law.respond(&first, &old, &mut new, &mut stress).is_err() {
            continue;
        }
        list.push((first, old.clone()));
        let mut second = first;
        second.stretch += random.tensor(driven(components).0) * (0.3 * size);
        second.wryness += random.tensor(driven(components).1) * (0.3 * size / 1.0e-3);
        let mut newer = vec![0.0; 20];
        if law.respond(&second, &new, &mut newer, &mut stress).is_ok() {
            list.push((second, new));
        }
    }
    list
}

#[test]
fn obeys_the_laws_of_materials_without_damage() {
    for (name, parameters) in variants() {
        for components in [Components::Plane, Components::Space] {
            let law = Sandstone::new(&parameters, components);
            let list = situations(&law, components);
            println!("{name}, {components:?}: {} situations", list.len());
            assert!(list.len() >= 6, "{name}, {components:?}: {}", list.len());
            let situations: Vec<_> = list
                .iter()
                .map(|(strain, old)| Situation { strain: *strain, old })
                .collect();
            let subject = Subject {
                law: &law,
                components,
                length: 1.0e-3,
                step: 1e-5,
            };
            check::micropolar(&subject, &situations);
        }
    }
}

/// Derivative of all of the stress along a direction, by the moduli, in the active components: force, couple divided by
/// the length, source, flux.
fn along(
    moduli: &GradientMicropolarModuli,
    components: Components,
    direction: &GradientMicropolarStrain,
) -> GradientMicropolarStress {
    let (stretches, wrynesses) = driven(components);
    let mut out = GradientMicropolarStress::default();
    let m = &moduli.micropolar;
    let at = |pair: (usize, usize)| component(pair.0, pair.1);
    let coupled = if m.coupled { 1.0 } else { 0.0 };
    let d = &direction.micropolar;
    for &row in stretches {
        for &column in stretches {
            out.micropolar.force[row] += m.force_stretch[(at(row), at(column))] * d.stretch[column];
        }
        for &column in wrynesses.iter().filter(|_| m.coupled) {
            out.micropolar.force[row] += m.force_wryness[(at(row), at(column))] * d.wryness[column];
        }
        out.micropolar.force[row] += moduli.stress_alpha.force[row] * direction.alpha;
        out.source += moduli.source_strain.force[row] * d.stretch[row] * coupled;
    }
    for &row in wrynesses {
        for &column in stretches.iter().filter(|_| m.coupled) {
            out.micropolar.couple[row] += m.couple_stretch[(at(row), at(column))] * d.stretch[column];
        }
        for &column in wrynesses {
            out.micropolar.couple[row] += m.couple_wryness[(at(row), at(column))] * d.wryness[column];
        }
        out.micropolar.couple[row] += moduli.stress_alpha.couple[row] * direction.alpha;
        out.source += moduli.source_strain.couple[row] * d.wryness[row];
    }
    out.source += moduli.source_alpha * direction.alpha;
    out.flux = direction.alpha_gradient * moduli.flux_gradient;
    out
}

fn moved(strain: &GradientMicropolarStrain, direction: &GradientMicropolarStrain, h: f64) -> GradientMicropolarStrain {
    GradientMicropolarStrain {
        micropolar: MicropolarStrain {
            stretch: strain.micropolar.stretch + direction.micropolar.stretch * h,
            wryness: strain.micropolar.wryness + direction.micropolar.wryness * h,
        },
        alpha: strain.alpha + direction.alpha * h,
        alpha_gradient: strain.alpha_gradient + direction.alpha_gradient * h,
    }
}

/// Norms of force over the shear modulus, couple over modulus and length, source, flux.
fn norms(stress: &GradientMicropolarStress, parameters: &SandstoneParameters, components: Components) -> [f64; 4] {
    let (stretches, wrynesses) = driven(components);
    let sum = |pairs: &[(usize, usize)], tensor: &Matrix3<f64>| pairs.iter().map(|&p| tensor[p].powi(2)).sum::<f64>();
    let modulus = parameters.shear_modulus;
    [
        sum(stretches, &stress.micropolar.force).sqrt() / modulus,
        sum(wrynesses, &stress.micropolar.couple).sqrt() / (modulus * 1.0e-3),
        stress.source.abs(),
        stress.flux.norm() / 1.0e-3,
    ]
}

fn minus(a: &GradientMicropolarStress, b: &GradientMicropolarStress) -> GradientMicropolarStress {
    GradientMicropolarStress {
        micropolar: MicropolarStress {
            force: a.micropolar.force - b.micropolar.force,
            couple: a.micropolar.couple - b.micropolar.couple,
        },
        source: a.source - b.source,
        flux: a.flux - b.flux,
    }
}

/// Taylor test by central differences of all of the stress: their error falls as the square of the step.
fn taylor(
    law: &Sandstone,
    components: Components,
    strain: &GradientMicropolarStrain,
    old: &[f64],
    step: f64,
    random: &mut Random,
) -> Result<(), String> {
    let parameters = &law.parameters;
    let (stress, new) = respond(law, strain, old).map_err(|failure| format!("{failure:?}"))?;
    let mut moduli = GradientMicropolarModuli::default();
    material(law).moduli(strain, old, &new, &stress, &mut moduli);
    let (stretches, wrynesses) = driven(components);
    let direction = GradientMicropolarStrain {
        micropolar: MicropolarStrain {
            stretch: random.tensor(stretches),
            wryness: random.tensor(wrynesses) * 1.0e3,
        },
        alpha: random.number(),
        alpha_gradient: Vector3::from_fn(|_, _| random.number()) * 1.0e3,
    };
    let exact = along(&moduli, components, &direction);
    let sizes = norms(&exact, parameters, components);
    let error = |h: f64| -> Result<[f64; 4], String> {
        let side = |h: f64| respond(law, &moved(strain, &direction, h), old).map_err(|failure| format!("{failure:?}"));
        let ((ahead, _), (behind, _)) = (side(h)?, side(-h)?);
        let mut slope = minus(&ahead, &behind);
        slope.micropolar.force /= 2.0 * h;
        slope.micropolar.couple /= 2.0 * h;
        slope.source /= 2.0 * h;
        slope.flux /= 2.0 * h;
        Ok(norms(&minus(&slope, &exact), parameters, components))
    };
    let (wide, narrow) = (error(step)?, error(0.25 * step)?);
    for k in 0..4 {
        let rounding = 1e-13 / step;
        let right = narrow[k] <= wide[k] / 8.0 + rounding && narrow[k] <= 1e-2 * sizes[k] + rounding;
        if !right {
            return Err(format!("part {k}: {} then {} of {}", wide[k], narrow[k], sizes[k]));
        }
    }
    Ok(())
}

#[test]
fn moduli_are_the_derivative_of_all_of_the_stress() {
    let mut count = 0;
    for (name, parameters) in variants() {
        for components in [Components::Plane, Components::Space] {
            let law = Sandstone::new(&parameters, components);
            for (index, (micropolar, old)) in situations(&law, components).into_iter().enumerate() {
                // Intact, damaged, beyond the largest damage.
                for alpha in [-0.01, 0.02, 0.9] {
                    let strain = GradientMicropolarStrain {
                        micropolar,
                        alpha,
                        alpha_gradient: Vector3::new(1.0, 2.0, 3.0),
                    };
                    let mut random = Random::new(11 + index as u64);
                    let result = taylor(&law, components, &strain, &old, 4e-6, &mut random);
                    assert_eq!(
                        result,
                        Ok(()),
                        "{name}, {components:?}, situation {index}, alpha {alpha}"
                    );
                    count += 1;
                }
            }
        }
    }
    assert!(count > 200, "{count}");
}

/// In tension beyond the apex the literal law has no stress and says so; rounded, it has one, with its moduli.
#[test]
fn apex_is_reached_where_it_is_rounded() {
    for components in [Components::Plane, Components::Space] {
        let mut random = Random::new(3);
        let rounded = Sandstone::new(&plastic(general(), |p| p.apex_rounding = 1.0e5), components);
        let literal = Sandstone::new(&plastic(general(), |p| p.apex_rounding = 0.0), components);
        for size in [0.0, 1e-5, 3e-4] {
            let strain = strain(&mut random, components, -0.004, size);
            let (stress, new) = respond(&rounded, &strain, &virgin()).expect("a return to the rounded apex");
            let failure = respond(&literal, &strain, &virgin());
            assert!(failure.is_err(), "{size}: {failure:?}");
            let state = SandstoneState::unpack(&new);
            assert!(state.chi > 0.0 && stress.source < strain.alpha);
            let mut near = strain;
            near.alpha = 0.01;
            assert_eq!(
                taylor(&rounded, components, &near, &virgin(), 1e-6, &mut random),
                Ok(()),
                "{size}"
            );
        }
    }
}

#[test]
fn refuses_what_is_not_finite() {
    for components in [Components::Plane, Components::Space] {
        let law = Sandstone::new(&general(), components);
        for broken in [f64::NAN, f64::INFINITY, -1e300, 1e200] {
            for place in 0..4 {
                let mut strain = strain(&mut Random::new(1), components, 0.0, 0.0);
                match place {
                    0 => strain.micropolar.stretch[(0, 1)] = broken,
                    1 => strain.micropolar.wryness[(2, 0)] = broken,
                    2 => strain.alpha = broken,
                    _ => strain.alpha_gradient.x = broken,
                }
                if let Ok((stress, _)) = respond(&law, &strain, &virgin()) {
                    assert!(stress.source.is_finite() && stress.flux.sum().is_finite());
                    assert!(stress.micropolar.force.sum().is_finite() && stress.micropolar.couple.sum().is_finite());
                }
            }
        }
    }
}

/// All plastic trial states of the literal law that have a point on the cone are solved; so are all that do not once the
/// apex is rounded.
#[test]
fn every_trial_state_is_returned() {
    for components in [Components::Plane, Components::Space] {
        let mut random = Random::new(19);
        // A dilatancy that dies out soon could not bring all volumes back.
        let lasting = |rounding: f64| {
            let change = |p: &mut SandstoneYield| (p.dilation_rate, p.apex_rounding) = (1.0, rounding);
            Sandstone::new(&plastic(general(), change), components)
        };
        let (rounded, literal) = (lasting(1.0e4), lasting(0.0));
        let mut plastic = 0;
        for index in 0..2000 {
            let size = 0.02 * random.number().abs();
            let compression = size * (0.5 + 0.5 * random.number());
            let strain = strain(&mut random, components, compression, size);
            match respond(&rounded, &strain, &virgin()) {
                Ok((_, new)) => plastic += usize::from(SandstoneState::unpack(&new).chi > 0.0),
                Err(failure) => panic!("{components:?}, state {index} of size {size}: {failure:?}"),
            }
            if compression > size {
                respond(&literal, &strain, &virgin()).expect("a point of the cone");
            }
        }
        assert!(plastic > 1800, "{plastic}");
    }
}
