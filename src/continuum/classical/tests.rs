use super::*;
use crate::continuum::tensor::symmetric;
use crate::continuum::total_length;
use crate::material::check::Random;
use crate::material::drucker_prager::Branch;
use crate::material::hencky::MetricState;
use crate::material::micropolar_law;
use crate::material::spec::{ElasticModuli, MaterialSpec, PlasticParameters};
use crate::material::{Components, Material, classical_law};
use nalgebra::{Rotation3, Vector3};

const LAMBDA: f64 = 5e6;
const MU: f64 = 3e6;

const PLASTIC: PlasticParameters = PlasticParameters {
    friction_slope: 0.98,
    dilatancy_slope: 0.35,
    yield_strength: 42e3,
    hardening_modulus: 100e3,
    plastic_length: 0.0,
    tolerance: 1e-13,
};

fn components<const D: usize>() -> Components {
    if D == 2 { Components::Plane } else { Components::Space }
}

fn elastic_law<const D: usize>() -> Box<dyn Material<Classical>> {
    let moduli = ElasticModuli::without_rotations(LAMBDA, MU);
    classical_law(&MaterialSpec::Elastic(moduli), components::<D>())
}

fn plastic_law<const D: usize>() -> Box<dyn Material<Classical>> {
    let moduli = ElasticModuli::without_rotations(LAMBDA, MU);
    classical_law(&MaterialSpec::Elastoplastic(moduli, PLASTIC), components::<D>())
}

/// A jet whose gradient has this size.
fn random_jet<const D: usize>(random: &mut Random, size: f64) -> Jet<D, D> {
    Jet {
        value: SVector::from_fn(|_, _| random.number()),
        gradient: SMatrix::from_fn(|_, _| random.number() * size),
    }
}

/// A random rotation with random strains of this size.
fn turning_jet<const D: usize>(random: &mut Random, size: f64) -> Jet<D, D> {
    let turn = Vector3::from_fn(|_, _| random.number());
    let turn = if D == 2 { Vector3::new(0.0, 0.0, turn.z) } else { turn };
    let rotation = Rotation3::new(turn).into_inner();
    let stretch = SMatrix::<f64, D, D>::identity() + random_jet::<D>(random, size).gradient;
    let rotation = SMatrix::<f64, D, D>::from_fn(|i, j| rotation[(i, j)]);
    Jet {
        value: SVector::zeros(),
        gradient: rotation * stretch - SMatrix::identity(),
    }
}

fn virgin(law: &dyn Material<Classical>) -> Vec<f64> {
    let mut state = vec![f64::NAN; total_length(law.state_variables())];
    law.initial_state(&mut state);
    state
}

fn answer(law: &dyn Material<Classical>, strain: &ClassicalStrain, old: &[f64]) -> Option<(ClassicalStress, Vec<f64>)> {
    let mut new = vec![0.0; old.len()];
    let mut stress = ClassicalStress::default();
    law.respond(strain, old, &mut new, &mut stress).ok()?;
    Some((stress, new))
}

fn kinematics<const D: usize>(motion: &ClassicalMotion, jet: &Jet<D, D>) -> (ClassicalStrain, ClassicalFrame) {
    <Classical as Fields<D, D>>::strain(motion, jet).expect("inside the domain")
}

fn flux_at<const D: usize>(
    law: &dyn Material<Classical>,
    motion: &ClassicalMotion,
    old: &[f64],
    jet: &Jet<D, D>,
) -> SMatrix<f64, D, D> {
    let (strain, frame) = kinematics(motion, jet);
    let (stress, _) = answer(law, &strain, old).expect("an answer");
    let flux = <Classical as Fields<D, D>>::flux(&frame, &stress);
    assert_eq!(flux.source.norm(), 0.0);
    flux.flux
}

/// The tangent, written over dirt.
fn tangent_at<const D: usize>(
    law: &dyn Material<Classical>,
    motion: &ClassicalMotion,
    old: &[f64],
    jet: &Jet<D, D>,
) -> Tangent<D, D> {
    let (strain, frame) = kinematics(motion, jet);
    let (stress, new) = answer(law, &strain, old).expect("an answer");
    let mut moduli = ClassicalModuli::default();
    law.moduli(&strain, old, &new, &stress, &mut moduli);
    let dirt = SMatrix::from_element(1e9);
    let mut tangent = Tangent {
        source_value: dirt,
        source_gradient: [dirt; D],
        flux_value: [dirt; D],
        flux_gradient: [[dirt; D]; D],
    };
    <Classical as Fields<D, D>>::tangent(&frame, &stress, &moduli, &mut tangent);
    assert_eq!(tangent.source_value.norm(), 0.0);
    assert!(
        tangent
            .source_gradient
            .iter()
            .chain(&tangent.flux_value)
            .all(|block| block.norm() == 0.0)
    );
    tangent
}

/// Taylor test: the error of the linear prediction falls by four with half the step.
fn taylor<const D: usize>(
    law: &dyn Material<Classical>,
    motion: &ClassicalMotion,
    old: &[f64],
    jet: &Jet<D, D>,
    direction: &Jet<D, D>,
    step: f64,
) {
    let base = flux_at(law, motion, old, jet);
    let tangent = tangent_at(law, motion, old, jet);
    let mut slope = SMatrix::<f64, D, D>::zeros();
    for j in 0..D {
        for k in 0..D {
            let change = tangent.flux_gradient[j][k] * direction.gradient.column(k);
            slope.set_column(j, &(slope.column(j) + change));
        }
    }
    let error = |h: f64| {
        let ahead = Jet {
            value: jet.value,
            gradient: jet.gradient + direction.gradient * h,
        };
        (flux_at(law, motion, old, &ahead) - base - slope * h).norm()
    };
    let errors = [1.0, 0.5, 0.25].map(|part| error(step * part));
    let size = slope.norm().max(1e-3 * MU);
    let rounding = 1e-9 * step * size + 1e-12 * (base.norm() + MU * 1e-2);
    for pair in errors.windows(2) {
        assert!(
            pair[1] <= pair[0] / 3.5 || pair[1] <= rounding,
            "{errors:?} at slope {size:e}, rounding {rounding:e}"
        );
    }
    assert!(errors[2] < 0.05 * step * size + rounding, "{errors:?} against {size:e}");
}

fn taylor_with_elastic_law<const D: usize>() {
    let law = elastic_law::<D>();
    let mut random = Random::new(7);
    for size in [0.0, 1e-6, 0.1, 0.3] {
        for _ in 0..6 {
            let motion =
                <Classical as Fields<D, D>>::advance(&ClassicalMotion::default(), &turning_jet::<D>(&mut random, size));
            let jet = turning_jet::<D>(&mut random, size);
            let direction = random_jet::<D>(&mut random, 1.0);
            taylor(&*law, &motion, &[], &jet, &direction, 1e-3);
        }
    }
}

#[test]
fn tangent_is_the_derivative_of_the_flux_for_the_elastic_law() {
    taylor_with_elastic_law::<2>();
    taylor_with_elastic_law::<3>();
}

/// Random steps from a state that flowed, sorted by the branch of the law.
fn taylor_with_plastic_law<const D: usize>() {
    let law = plastic_law::<D>();
    let mut random = Random::new(17);
    let mut counts = [0; 3];
    for number in 0..2_000 {
        let first = turning_jet::<D>(&mut random, 0.02);
        let (strain, _) = kinematics(&ClassicalMotion::default(), &first);
        let (_, state) = answer(&*law, &strain, &virgin(&*law)).expect("an answer");
        let motion = <Classical as Fields<D, D>>::advance(&ClassicalMotion::default(), &first);
        let jet = turning_jet::<D>(&mut random, 0.003 * (1 + number % 5) as f64);
        let (strain, _) = kinematics(&motion, &jet);
        let (stress, new) = answer(&*law, &strain, &state).expect("an answer");
        let branch = MetricState::unpack(&new).branch;
        let count = &mut counts[branch.code() as usize];
        if *count >= 8 || !is_clear_of_borders(&stress, branch) {
            continue;
        }
        *count += 1;
        let direction = random_jet::<D>(&mut random, 1.0);
        taylor(&*law, &motion, &state, &jet, &direction, 1e-5);
    }
    assert_eq!(counts, [8, 8, 8], "too few of a branch");
}

fn is_clear_of_borders(stress: &ClassicalStress, branch: Branch) -> bool {
    let p = stress.kirchhoff.trace() / 3.0;
    let q = (1.5f64).sqrt() * (stress.kirchhoff - Matrix3::from_diagonal_element(p)).norm();
    match branch {
        Branch::Elastic => q + PLASTIC.friction_slope * p < 0.9 * PLASTIC.yield_strength,
        Branch::Cone => q > 1e4,
        Branch::Apex => true,
    }
}

#[test]
fn tangent_is_the_derivative_of_the_flux_for_the_plastic_law() {
    taylor_with_plastic_law::<2>();
    taylor_with_plastic_law::<3>();
}

fn elastic_tangent_is_symmetric<const D: usize>() {
    let law = elastic_law::<D>();
    let mut random = Random::new(19);
    for _ in 0..10 {
        let motion =
            <Classical as Fields<D, D>>::advance(&ClassicalMotion::default(), &turning_jet::<D>(&mut random, 0.3));
        let tangent = tangent_at(&*law, &motion, &[], &turning_jet::<D>(&mut random, 0.3));
        for j in 0..D {
            for k in 0..D {
                let skew = tangent.flux_gradient[j][k] - tangent.flux_gradient[k][j].transpose();
                assert!(skew.norm() < 1e-8 * MU, "{}", skew.norm());
            }
        }
    }
}

#[test]
fn the_tangent_of_the_elastic_law_is_symmetric() {
    elastic_tangent_is_symmetric::<2>();
    elastic_tangent_is_symmetric::<3>();
}

/// A rotation of the body makes no stress, and a further one turns the forces and nothing else.
fn objectivity<const D: usize>() {
    let law = elastic_law::<D>();
    let mut random = Random::new(29);
    let rigid = turning_jet::<D>(&mut random, 0.0);
    assert!(flux_at(&*law, &ClassicalMotion::default(), &[], &rigid).norm() < 1e-14 * MU);
    let motion = <Classical as Fields<D, D>>::advance(&ClassicalMotion::default(), &turning_jet::<D>(&mut random, 0.2));
    let jet = turning_jet::<D>(&mut random, 0.2);
    let rotation = rigid.gradient + SMatrix::identity();
    let turned = Jet {
        value: jet.value,
        gradient: rotation * (jet.gradient + SMatrix::identity()) - SMatrix::identity(),
    };
    let expected = rotation * flux_at(&*law, &motion, &[], &jet);
    let flux = flux_at(&*law, &motion, &[], &turned);
    assert!((flux - expected).norm() < 1e-13 * MU);
}

#[test]
fn rigid_motions_make_no_stress_and_forces_turn_with_the_body() {
    objectivity::<2>();
    objectivity::<3>();
}

/// The flux is the derivative of `1/2 lambda tr(eps)^2 + mu eps:eps` per reference volume: the power of the forces is the
/// rate of the energy.
#[test]
fn forces_of_the_elastic_law_do_the_work_of_its_energy() {
    let law = elastic_law::<3>();
    let mut random = Random::new(31);
    let motion = <Classical as Fields<3, 3>>::advance(&ClassicalMotion::default(), &turning_jet::<3>(&mut random, 0.3));
    let jet = turning_jet::<3>(&mut random, 0.3);
    let direction = random_jet::<3>(&mut random, 1.0);
    let energy = |h: f64| {
        let moved = Jet {
            value: jet.value,
            gradient: jet.gradient + direction.gradient * h,
        };
        let f = kinematics(&motion, &moved).0.deformation_gradient;
        let eigenvalues = symmetric(&(f * f.transpose())).symmetric_eigenvalues();
        let strains = eigenvalues.map(|value| 0.5 * value.ln());
        0.5 * LAMBDA * strains.sum().powi(2) + MU * strains.norm_squared()
    };
    let h = 1e-4;
    let rate = (energy(h) - energy(-h)) / (2.0 * h);
    let power = flux_at(&*law, &motion, &[], &jet).dot(&direction.gradient);
    // The difference has an error of h^2 times the third derivative of the energy, some 10 MU.
    assert!((rate - power).abs() < 1e-6 * MU, "{rate} {power}");
}

/// Plane strain gives in-plane forces and moduli of the same motion in space, and the stress across the plane.
#[test]
fn plane_strain_is_the_motion_in_space_without_the_third_direction() {
    let (plane, space) = (plastic_law::<2>(), plastic_law::<3>());
    let mut random = Random::new(43);
    for _ in 0..50 {
        let flat = turning_jet::<2>(&mut random, 0.02);
        let mut full = Jet::<3, 3>::zero();
        full.gradient.fixed_view_mut::<2, 2>(0, 0).copy_from(&flat.gradient);
        let motion = ClassicalMotion::default();
        let old = virgin(&*plane);
        let (left, right) = (
            flux_at(&*plane, &motion, &old, &flat),
            flux_at(&*space, &motion, &old, &full),
        );
        assert!((left - right.fixed_view::<2, 2>(0, 0)).norm() < 1e-12 * MU);
        let (left, right) = (
            tangent_at(&*plane, &motion, &old, &flat),
            tangent_at(&*space, &motion, &old, &full),
        );
        for j in 0..2 {
            for k in 0..2 {
                let part = right.flux_gradient[j][k].fixed_view::<2, 2>(0, 0).into_owned();
                assert!((left.flux_gradient[j][k] - part).norm() < 1e-9 * MU);
            }
        }
        let (strain, _) = kinematics(&motion, &flat);
        let (stress, _) = answer(&*plane, &strain, &old).expect("an answer");
        let moved = <Classical as Fields<2, 2>>::advance(&motion, &flat);
        let seen = Classical::observe(&moved, &stress);
        assert!((seen.stress * seen.volume_ratio - stress.kirchhoff).norm() < 1e-9);
        assert!(seen.stress.m33 != 0.0 && seen.rotation.is_none() && seen.couple_stress.is_none());
    }
}

#[test]
fn what_turns_a_volume_inside_out_or_is_not_finite_is_outside() {
    for broken in [-2.0, f64::NAN, f64::INFINITY, 1e308] {
        let mut jet = Jet::<3, 3>::zero();
        jet.gradient[(1, 1)] = broken;
        if broken > 1e300 {
            jet.gradient[(0, 0)] = broken;
        }
        assert!(<Classical as Fields<3, 3>>::strain(&ClassicalMotion::default(), &jet).is_none());
    }
}

/// A micropolar body without coupling, curvature stiffness and rotation is a classical one: for small strains, where
/// `B = lambda tr(U - I) I + 2 mu sym(U - I)` and the Hencky law agree to the order of the strain squared, so do the
/// stresses along a path of loading, flow and unloading. The strength is scaled with the strain; what is left is of the
/// order of the modulus times the largest strain squared, with a factor for the several moduli and steps.
#[test]
fn micropolar_without_coupling_and_lengths_is_classical() {
    let plastic = |size: f64| PlasticParameters {
        yield_strength: size * MU,
        hardening_modulus: 0.1 * MU,
        plastic_length: 1.0,
        ..PLASTIC
    };
    let moduli = ElasticModuli::without_rotations(LAMBDA, MU);
    for size in [1e-3, 1e-5] {
        let spec = MaterialSpec::Elastoplastic(moduli, plastic(size));
        let classical = classical_law(&spec, Components::Space);
        let micropolar = micropolar_law(&spec, Components::Space);
        let mut random = Random::new(53);
        let mut flowed = 0;
        for _ in 0..20 {
            let target = SMatrix::<f64, 3, 3>::from_fn(|_, _| random.number() * size);
            let target = symmetric(&target);
            // The largest strain of the path is twice the target.
            let strain_squared = 4.0 * target.norm_squared();
            let mut left = virgin(&*classical);
            let mut right = vec![0.0; total_length(micropolar.state_variables())];
            micropolar.initial_state(&mut right);
            for factor in [0.4, 1.2, 2.0, 1.5, -0.5] {
                let f = Matrix3::identity() + target * factor;
                let strain = ClassicalStrain {
                    deformation_gradient: f,
                };
                let (stress, new) = answer(&*classical, &strain, &left).expect("an answer");
                left = new;
                let strain = crate::continuum::micropolar::MicropolarStrain {
                    stretch: f,
                    ..Default::default()
                };
                let (other, new) =
                    crate::material::check::answer(&*micropolar, &strain, &right, 0.0).expect("an answer");
                right = new;
                let tau = other.force * f.transpose();
                let difference = (stress.kirchhoff - tau).norm();
                assert!(
                    difference < 10.0 * strain_squared * MU,
                    "{difference:e} Pa at {strain_squared:e}"
                );
                let chi = MetricState::unpack(&left).chi;
                let other_chi = crate::material::drucker_prager::PlasticState::unpack(&right).chi;
                assert!((chi - other_chi).abs() < 10.0 * strain_squared, "{chi:e} {other_chi:e}");
                flowed += usize::from(chi > 0.1 * size);
            }
        }
        assert!(flowed > 40, "{flowed}");
    }
}
