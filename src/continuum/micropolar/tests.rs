use super::*;
use crate::continuum::tensor::symmetric;
use crate::continuum::total_length;
use crate::continuum::{Fields, Flux, Jet, Tangent};
use crate::material::check::{Random, answer};
use crate::material::drucker_prager::{Branch, PlasticState};
use crate::material::spec::{ElasticModuli, MaterialSpec, PlasticParameters};
use crate::material::{Components, Material, micropolar_law};
use nalgebra::Rotation3;

const ELASTIC: ElasticModuli = ElasticModuli {
    lambda: 5e6,
    mu: 3e6,
    kappa: 1e6,
    alpha: 40.0,
    beta: 30.0,
    gamma: 100.0,
};

const PLASTIC: PlasticParameters = PlasticParameters {
    friction_slope: 0.98,
    dilatancy_slope: 0.35,
    yield_strength: 42e3,
    hardening_modulus: 100e3,
    plastic_length: LENGTH,
    tolerance: 1e-13,
};

const LENGTH: f64 = 0.005;

fn elastic_law(components: Components) -> Box<dyn Material<Micropolar>> {
    micropolar_law(&MaterialSpec::Elastic(ELASTIC), components)
}

fn plastic_law(components: Components) -> Box<dyn Material<Micropolar>> {
    micropolar_law(&MaterialSpec::Elastoplastic(ELASTIC, PLASTIC), components)
}

/// A jet whose gradients have these sizes; rotation gradients in units of the length.
fn random_jet<const D: usize, const N: usize>(random: &mut Random, strain: f64, rotation: f64) -> Jet<D, N>
where
    Micropolar: Fields<D, N>,
{
    let is_translation = <Micropolar as Fields<D, N>>::IS_TRANSLATION;
    let mut jet = Jet::zero();
    for (a, is_translation) in is_translation.into_iter().enumerate() {
        jet.value[a] = random.number() * rotation;
        for k in 0..D {
            jet.gradient[(a, k)] = random.number() * if is_translation { strain } else { strain / LENGTH };
        }
    }
    jet
}

/// The motion after two random steps.
fn moved<const D: usize, const N: usize>(random: &mut Random, strain: f64, rotation: f64) -> MicropolarMotion
where
    Micropolar: Fields<D, N>,
{
    (0..2).fold(MicropolarMotion::default(), |motion, _| {
        Micropolar::advance(&motion, &random_jet::<D, N>(random, strain, rotation))
    })
}

fn flux_norm<const D: usize, const N: usize>(flux: &Flux<D, N>) -> f64 {
    let mut sum = 0.0;
    for a in 0..N {
        // Forces and reaction couples in pascals, couples over the length.
        let scale = if a < D { 1.0 } else { LENGTH };
        sum += flux.source[a].powi(2) + (flux.flux.row(a) / scale).norm_squared();
    }
    sum.sqrt()
}

fn along<const D: usize, const N: usize>(tangent: &Tangent<D, N>, jet: &Jet<D, N>) -> Flux<D, N> {
    let mut out = Flux {
        source: tangent.source_value * jet.value,
        flux: SMatrix::zeros(),
    };
    for k in 0..D {
        out.source += tangent.source_gradient[k] * jet.gradient.column(k);
    }
    for j in 0..D {
        let mut column = tangent.flux_value[j] * jet.value;
        for k in 0..D {
            column += tangent.flux_gradient[j][k] * jet.gradient.column(k);
        }
        out.flux.set_column(j, &column);
    }
    out
}

fn moved_jet<const D: usize, const N: usize>(jet: &Jet<D, N>, direction: &Jet<D, N>, h: f64) -> Jet<D, N> {
    Jet {
        value: jet.value + direction.value * h,
        gradient: jet.gradient + direction.gradient * h,
    }
}

/// Taylor test of the flux of a law at a jet: the error of the linear prediction falls by four with half the step.
fn taylor<const D: usize, const N: usize>(
    law: &dyn Material<Micropolar>,
    motion: &MicropolarMotion,
    old: &[f64],
    jet: &Jet<D, N>,
    direction: &Jet<D, N>,
    step: f64,
) where
    Micropolar: Fields<D, N>,
{
    let flux_at = |jet: &Jet<D, N>| {
        let (strain, frame) = <Micropolar as Fields<D, N>>::strain(motion, jet).expect("inside the domain");
        let (stress, _) = answer(law, &strain, old, 0.0).expect("an answer");
        <Micropolar as Fields<D, N>>::flux(&frame, &stress)
    };
    let (strain, frame) = <Micropolar as Fields<D, N>>::strain(motion, jet).expect("inside the domain");
    let (stress, new) = answer(law, &strain, old, 0.0).expect("an answer");
    // Dirt shows what is added to instead of written.
    let mut moduli = MicropolarModuli::default();
    law.moduli(&strain, old, &new, &stress, &mut moduli);
    let mut tangent = Tangent::<D, N>::zero();
    tangent.source_value.fill(1e9);
    tangent.source_gradient[D - 1].fill(1e9);
    tangent.flux_value[0].fill(1e9);
    tangent.flux_gradient[0][D - 1].fill(1e9);
    <Micropolar as Fields<D, N>>::tangent(&frame, &stress, &moduli, &mut tangent);
    let (base, slope) = (flux_at(jet), along(&tangent, direction));
    let size = flux_norm(&slope);
    let error = |h: f64| {
        let ahead = flux_at(&moved_jet(jet, direction, h));
        flux_norm(&Flux {
            source: ahead.source - base.source - slope.source * h,
            flux: ahead.flux - base.flux - slope.flux * h,
        })
    };
    let errors = [1.0, 0.5, 0.25].map(|part| error(step * part));
    let rounding = 1e-9 * step * size + 1e-12 * flux_norm(&base);
    for pair in errors.windows(2) {
        assert!(
            pair[1] <= pair[0] / 3.5 || pair[1] <= rounding,
            "{errors:?} at slope {size:e}"
        );
    }
    assert!(errors[2] < 0.05 * step * size + rounding, "{errors:?} against {size:e}");
}

fn taylor_with_elastic_law<const D: usize, const N: usize>(components: Components)
where
    Micropolar: Fields<D, N>,
{
    let law = elastic_law(components);
    let mut random = Random::new(7);
    for rotation in [0.0, 1e-5, 0.3, 0.57, 0.9, 1.5] {
        for _ in 0..4 {
            let motion = moved::<D, N>(&mut random, 0.2, 0.8);
            let jet = random_jet::<D, N>(&mut random, 0.2, rotation);
            let direction = random_jet::<D, N>(&mut random, 1.0, 1.0);
            taylor(&*law, &motion, &[], &jet, &direction, 1e-3);
        }
    }
}

#[test]
fn tangent_is_the_derivative_of_the_flux_for_an_elastic_law() {
    taylor_with_elastic_law::<2, 3>(Components::Plane);
    taylor_with_elastic_law::<3, 6>(Components::Space);
}

/// Random steps from a state that flowed, sorted by the branch of the law.
fn taylor_with_plastic_law<const D: usize, const N: usize>(components: Components)
where
    Micropolar: Fields<D, N>,
{
    let law = plastic_law(components);
    let mut random = Random::new(17);
    let mut counts = [0; 3];
    for number in 0..2_000 {
        let mut state = vec![0.0; total_length(law.state_variables())];
        law.initial_state(&mut state);
        let mut motion = MicropolarMotion::default();
        let mut jet = random_jet::<D, N>(&mut random, 0.02, 0.5);
        // A common rotation of body and points, or the micro-rotation alone would strain them beyond reason.
        follow_rotation::<D, N>(&mut jet);
        let Some((strain, _)) = <Micropolar as Fields<D, N>>::strain(&motion, &jet) else {
            continue;
        };
        let Some((_, flowed)) = answer(&*law, &strain, &state, 0.0) else {
            continue;
        };
        motion = Micropolar::advance(&motion, &jet);
        state = flowed;
        let mut jet = random_jet::<D, N>(&mut random, 0.003 * (1 + number % 5) as f64, 0.3);
        follow_rotation::<D, N>(&mut jet);
        let Some((strain, _)) = <Micropolar as Fields<D, N>>::strain(&motion, &jet) else {
            continue;
        };
        let Some((stress, new)) = answer(&*law, &strain, &state, 0.0) else {
            continue;
        };
        let branch = PlasticState::unpack(&new).branch;
        let count = &mut counts[branch.code() as usize];
        if *count >= 8 || !is_clear_of_borders(&strain, &stress, branch) {
            continue;
        }
        *count += 1;
        let direction = random_jet::<D, N>(&mut random, 1.0, 1.0);
        taylor(&*law, &motion, &state, &jet, &direction, 1e-5);
    }
    assert_eq!(counts, [8, 8, 8], "too few of a branch");
}

/// Adds to the displacement gradient what turns the material with its points.
fn follow_rotation<const D: usize, const N: usize>(jet: &mut Jet<D, N>) {
    let w = if D == 2 {
        Vector3::new(0.0, 0.0, jet.value[2])
    } else {
        Vector3::new(jet.value[3], jet.value[4], jet.value[5])
    };
    let rotation = Rotation3::new(w).into_inner();
    let turned = rotation - Matrix3::identity();
    for i in 0..D {
        for k in 0..D {
            jet.gradient[(i, k)] += turned[(i, k)];
        }
    }
}

fn is_clear_of_borders(strain: &MicropolarStrain, stress: &MicropolarStress, branch: Branch) -> bool {
    let tau = stress.force * strain.stretch.transpose();
    let nu = stress.couple * strain.stretch.transpose();
    let p = tau.trace() / 3.0;
    let s = symmetric(&tau) - Matrix3::from_diagonal_element(p);
    let q = (1.5 * (s.norm_squared() + nu.norm_squared() / LENGTH.powi(2))).sqrt();
    match branch {
        Branch::Elastic => q + PLASTIC.friction_slope * p < 0.9 * PLASTIC.yield_strength,
        Branch::Cone => q > 1e4,
        Branch::Apex => true,
    }
}

#[test]
fn tangent_is_the_derivative_of_the_flux_for_a_plastic_law() {
    taylor_with_plastic_law::<2, 3>(Components::Plane);
    taylor_with_plastic_law::<3, 6>(Components::Space);
}

#[test]
fn elastic_tangent_is_symmetric_in_plane_strain() {
    let law = elastic_law(Components::Plane);
    let mut random = Random::new(19);
    for _ in 0..10 {
        let motion = moved::<2, 3>(&mut random, 0.2, 0.5);
        let jet = random_jet::<2, 3>(&mut random, 0.2, 1.0);
        let (strain, frame) = <Micropolar as Fields<2, 3>>::strain(&motion, &jet).expect("inside");
        let (stress, _) = answer(&*law, &strain, &[], 0.0).expect("an answer");
        let mut moduli = MicropolarModuli::default();
        law.moduli(&strain, &[], &[], &stress, &mut moduli);
        let mut tangent = Tangent::<2, 3>::zero();
        <Micropolar as Fields<2, 3>>::tangent(&frame, &stress, &moduli, &mut tangent);
        let size = tangent.flux_gradient[0][0].norm();
        for j in 0..2 {
            let skew = tangent.flux_value[j] - tangent.source_gradient[j].transpose();
            assert!(skew.norm() < 1e-12 * size);
            for k in 0..2 {
                let skew = tangent.flux_gradient[j][k] - tangent.flux_gradient[k][j].transpose();
                assert!(skew.norm() < 1e-12 * size);
            }
        }
    }
}

/// Body and points turned alike, by a large rotation in several steps: no strain, no flux.
#[test]
fn rigid_motion_gives_no_strain() {
    let law = elastic_law(Components::Space);
    let mut random = Random::new(23);
    let mut motion = MicropolarMotion::default();
    for _ in 0..6 {
        let mut jet = random_jet::<3, 6>(&mut random, 0.0, 1.2);
        jet.gradient.fill(0.0);
        follow_rotation(&mut jet);
        let (strain, frame) = <Micropolar as Fields<3, 6>>::strain(&motion, &jet).expect("inside");
        assert!((strain.stretch - Matrix3::identity()).norm() < 1e-14);
        assert_eq!(strain.wryness, Matrix3::zeros());
        let (stress, _) = answer(&*law, &strain, &[], 0.0).expect("an answer");
        let flux = <Micropolar as Fields<3, 6>>::flux(&frame, &stress);
        assert!(flux_norm(&flux) < 1e-7, "{}", flux_norm(&flux));
        motion = Micropolar::advance(&motion, &jet);
        let seen = <Micropolar as Fields<3, 6>>::observe_fields(&motion, &stress);
        assert!((seen.volume_ratio - 1.0).abs() < 1e-13);
        let rotation = Rotation3::new(seen.rotation.expect("a rotation")).into_inner();
        assert!((rotation - motion.deformation_gradient).norm() < 1e-13);
    }
}

/// Wryness of a field of rotations by its definition, the derivative by central differences of step `h`.
fn wryness_by_differences(rotation: impl Fn(&Vector3<f64>) -> Matrix3<f64>, h: f64) -> Matrix3<f64> {
    let here = rotation(&Vector3::zeros());
    Matrix3::from_columns(&std::array::from_fn::<_, 3, _>(|b| {
        let step = Vector3::ith(b, h);
        let rate = (rotation(&step) - rotation(&-step)) / (2.0 * h);
        // -1/2 eps_acd (Q^T Q_,b)_cd
        super::super::tensor::permutation_product(&here.tr_mul(&rate)) * -0.5
    }))
}

/// The update is exact for a rotation vector that varies linearly, on top of any field before it: the only error is
/// that of the differences.
#[test]
fn wryness_follows_its_definition() {
    let (before, w) = (Vector3::new(0.4, -0.7, 0.5), Vector3::new(-0.6, 0.9, 0.8));
    let first = Matrix3::new(0.3, -0.5, 0.2, 0.8, 0.1, -0.4, 0.6, -0.2, 0.7);
    let second = Matrix3::new(-0.4, 0.3, 0.9, 0.2, -0.6, 0.5, 0.1, 0.7, -0.3);
    let f_old = Matrix3::new(1.2, 0.1, -0.2, 0.05, 0.9, 0.3, -0.1, 0.2, 1.1);
    let old_field = |x: &Vector3<f64>| Rotation3::new(before + first * x).into_inner();
    // Gradients of the step are taken on the coordinates at its start, x~ = F~ X.
    let new_field = |x: &Vector3<f64>| Rotation3::new(w + second * f_old * x).into_inner() * old_field(x);
    let update = |h: f64| {
        let motion = MicropolarMotion {
            deformation_gradient: f_old,
            rotation: UnitQuaternion::from_scaled_axis(before),
            wryness: wryness_by_differences(old_field, h),
            twist: Vector3::zeros(),
        };
        let mut jet = Jet::<3, 6>::zero();
        jet.value.fixed_rows_mut::<3>(3).copy_from(&w);
        jet.gradient.fixed_rows_mut::<3>(3).copy_from(&second);
        let (strain, _) = <Micropolar as Fields<3, 6>>::strain(&motion, &jet).expect("inside");
        let advanced = <Micropolar as Fields<3, 6>>::advance(&motion, &jet);
        assert!((advanced.wryness - strain.wryness).norm() < 1e-13);
        (strain.wryness - wryness_by_differences(new_field, h)).norm()
    };
    let errors = [1e-2, 5e-3, 2.5e-3].map(update);
    assert!(errors[0] / errors[1] > 3.9 && errors[1] / errors[2] > 3.9, "{errors:?}");
    assert!(errors[2] < 1e-4, "{errors:?}");
    assert!(update(1e-5) < 1e-9, "{}", update(1e-5));
}

/// A rotation laid over body and points leaves the strain and turns the Kirchhoff stresses with it.
#[test]
fn superposed_rotation_turns_the_stress() {
    let law = plastic_law(Components::Space);
    let mut random = Random::new(29);
    let mut state = vec![0.0; total_length(law.state_variables())];
    law.initial_state(&mut state);
    for _ in 0..20 {
        let motion = moved::<3, 6>(&mut random, 0.005, 0.005);
        let jet = random_jet::<3, 6>(&mut random, 0.01, 0.01);
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(random.number(), random.number(), random.number()));
        let r = turn.to_rotation_matrix().into_inner();
        let turned_motion = MicropolarMotion {
            deformation_gradient: r * motion.deformation_gradient,
            rotation: turn * motion.rotation,
            ..motion
        };
        let mut turned_jet = jet;
        for first in [0, 3] {
            let gradient = r * jet.gradient.fixed_rows::<3>(first) * r.transpose();
            let value = r * jet.value.fixed_rows::<3>(first);
            turned_jet.gradient.fixed_rows_mut::<3>(first).copy_from(&gradient);
            turned_jet.value.fixed_rows_mut::<3>(first).copy_from(&value);
        }
        let observe = |motion: &MicropolarMotion, jet: &Jet<3, 6>| {
            let (strain, _) = <Micropolar as Fields<3, 6>>::strain(motion, jet).expect("inside");
            let (stress, _) = answer(&*law, &strain, &state, 0.0).expect("an answer");
            (strain, Micropolar::observe(&Micropolar::advance(motion, jet), &stress))
        };
        let (strain, seen) = observe(&motion, &jet);
        let (turned_strain, turned_seen) = observe(&turned_motion, &turned_jet);
        assert!((strain.stretch - turned_strain.stretch).norm() < 1e-13);
        assert!((strain.wryness - turned_strain.wryness).norm() < 1e-12);
        let expected = r * seen.stress * r.transpose();
        assert!((turned_seen.stress - expected).norm() < 1e-8 * expected.norm());
        let couple = seen.couple_stress.expect("micropolar");
        let expected = r * couple * r.transpose();
        let difference = (turned_seen.couple_stress.expect("micropolar") - expected).norm();
        // Couples vanish at the apex.
        assert!(difference < 1e-8 * (expected.norm() + PLASTIC.yield_strength * LENGTH));
    }
}

/// `P : grad u' + c . w' + M : grad w' = B : U' + S : Gamma'` for spins `w'`, the right side by differences.
#[test]
fn work_is_balanced_for_spins() {
    let mut random = Random::new(37);
    for _ in 0..10 {
        let motion = moved::<3, 6>(&mut random, 0.2, 0.5);
        let jet = random_jet::<3, 6>(&mut random, 0.2, 0.8);
        let (_, frame) = <Micropolar as Fields<3, 6>>::strain(&motion, &jet).expect("inside");
        let stress = MicropolarStress {
            force: random.strain(Components::Space, 1.0, 1.0).stretch,
            couple: random.strain(Components::Space, 1.0, 1.0).wryness * LENGTH,
        };
        let flux = <Micropolar as Fields<3, 6>>::flux(&frame, &stress);

        // Spins are w' = Jl(w) dw, so that grad w' = Jl dK + dJl[dw] K + dJl[K_k] dw.
        let direction = random_jet::<3, 6>(&mut random, 1.0, 1.0);
        let w = jet.value.fixed_rows::<3>(3).into_owned();
        let dw = direction.value.fixed_rows::<3>(3).into_owned();
        let k = jet.gradient.fixed_rows::<3>(3).into_owned();
        let dk = direction.gradient.fixed_rows::<3>(3).into_owned();
        let jl = |w: &Vector3<f64>| RotationIncrement::new(*w).left_differential();
        let spin = jl(&w) * dw;
        let h = 1e-6;
        let mut spin_gradient = Matrix3::zeros();
        for axis in 0..3 {
            let spin_at = |x: f64| jl(&(w + k.column(axis) * x)) * (dw + dk.column(axis) * x);
            spin_gradient.set_column(axis, &((spin_at(h) - spin_at(-h)) / (2.0 * h)));
        }
        let gradient = direction.gradient.fixed_rows::<3>(0);
        let outer = flux.flux.fixed_rows::<3>(0).dot(&gradient)
            + flux.flux.fixed_rows::<3>(3).dot(&spin_gradient)
            + flux.source.fixed_rows::<3>(3).dot(&spin);

        let strain_at = |x: f64| {
            let (strain, _) =
                <Micropolar as Fields<3, 6>>::strain(&motion, &moved_jet(&jet, &direction, x)).expect("inside");
            strain
        };
        let (ahead, behind) = (strain_at(h), strain_at(-h));
        let inner = stress.force.dot(&((ahead.stretch - behind.stretch) / (2.0 * h)))
            + stress.couple.dot(&((ahead.wryness - behind.wryness) / (2.0 * h)));
        assert!(
            (outer - inner).abs() < 1e-7 * (1.0 + inner.abs()),
            "{outer} and {inner}"
        );
        assert!(flux.source.fixed_rows::<3>(0).norm() == 0.0);
    }
}

/// The plane version against the space version of the same motion: strain, flux, tangent, next motion.
#[test]
fn plane_equals_space() {
    let place = [0, 1, 5];
    let mut random = Random::new(43);
    let (plane_law, space_law) = (plastic_law(Components::Plane), plastic_law(Components::Space));
    let mut old = vec![0.0; 20];
    plane_law.initial_state(&mut old);
    let mut branches = [0; 3];
    for number in 0..60 {
        let motion = moved::<2, 3>(&mut random, 0.002, 0.002);
        let jet = random_jet::<2, 3>(&mut random, 0.004 * (1 + number % 4) as f64, 0.01);
        let mut wide = Jet::<3, 6>::zero();
        for (a, &wide_a) in place.iter().enumerate() {
            wide.value[wide_a] = jet.value[a];
            for k in 0..2 {
                wide.gradient[(wide_a, k)] = jet.gradient[(a, k)];
            }
        }
        let (strain, frame) = <Micropolar as Fields<2, 3>>::strain(&motion, &jet).expect("inside");
        let (wide_strain, wide_frame) = <Micropolar as Fields<3, 6>>::strain(&motion, &wide).expect("inside");
        assert!((strain.stretch - wide_strain.stretch).norm() < 1e-14);
        assert!((strain.wryness - wide_strain.wryness).norm() < 1e-12);
        let (stress, new) = answer(&*space_law, &strain, &old, 0.0).expect("an answer");
        branches[new[19] as usize] += 1;
        let flux = <Micropolar as Fields<2, 3>>::flux(&frame, &stress);
        let wide_flux = <Micropolar as Fields<3, 6>>::flux(&wide_frame, &stress);
        let mut moduli = MicropolarModuli::default();
        space_law.moduli(&strain, &old, &new, &stress, &mut moduli);
        let (mut tangent, mut wide_tangent) = (Tangent::<2, 3>::zero(), Tangent::<3, 6>::zero());
        <Micropolar as Fields<2, 3>>::tangent(&frame, &stress, &moduli, &mut tangent);
        <Micropolar as Fields<3, 6>>::tangent(&wide_frame, &stress, &moduli, &mut wide_tangent);
        let same = |left: f64, right: f64| assert!((left - right).abs() < 1e-11 * ELASTIC.mu, "{left} and {right}");
        for (a, &wide_a) in place.iter().enumerate() {
            same(flux.source[a], wide_flux.source[wide_a]);
            for (b, &wide_b) in place.iter().enumerate() {
                let at = (wide_a, wide_b);
                same(tangent.source_value[(a, b)], wide_tangent.source_value[at]);
                for j in 0..2 {
                    same(flux.flux[(a, j)], wide_flux.flux[(wide_a, j)]);
                    same(tangent.source_gradient[j][(a, b)], wide_tangent.source_gradient[j][at]);
                    same(tangent.flux_value[j][(a, b)], wide_tangent.flux_value[j][at]);
                    for k in 0..2 {
                        same(
                            tangent.flux_gradient[j][k][(a, b)],
                            wide_tangent.flux_gradient[j][k][at],
                        );
                    }
                }
            }
        }
        let (next, wide_next) = (Micropolar::advance(&motion, &jet), Micropolar::advance(&motion, &wide));
        assert!((next.deformation_gradient - wide_next.deformation_gradient).norm() < 1e-15);
        assert_eq!((next.rotation, next.twist), (wide_next.rotation, wide_next.twist));
        assert!((next.wryness - wide_next.wryness).norm() < 1e-12);
    }
    assert!(branches.iter().all(|count| *count > 3), "{branches:?}");
}

#[test]
fn strain_refuses_what_lies_outside() {
    let motion = MicropolarMotion::default();
    let plane = |change: &dyn Fn(&mut Jet<2, 3>)| {
        let mut jet = Jet::zero();
        change(&mut jet);
        <Micropolar as Fields<2, 3>>::strain(&motion, &jet).is_some()
    };
    let space = |change: &dyn Fn(&mut Jet<3, 6>)| {
        let mut jet = Jet::zero();
        change(&mut jet);
        <Micropolar as Fields<3, 6>>::strain(&motion, &jet).is_some()
    };
    assert!(plane(&|_| {}) && space(&|_| {}));
    assert!(plane(&|jet| jet.value[2] = 3.1) && space(&|jet| jet.value[4] = -3.1));
    assert!(!plane(&|jet| jet.value[2] = -3.2) && !space(&|jet| jet.value[4] = 3.2));
    assert!(!plane(&|jet| jet.gradient[(0, 0)] = -1.0) && !space(&|jet| jet.gradient[(2, 2)] = -1.1));
    for broken in [f64::NAN, f64::INFINITY] {
        for a in 0..3 {
            assert!(!plane(&|jet| jet.gradient[(a, 1)] = broken), "{a}");
        }
        for a in 0..6 {
            assert!(!space(&|jet| jet.gradient[(a, 1)] = broken), "{a}");
        }
        assert!(!plane(&|jet| jet.value[2] = broken) && !space(&|jet| jet.value[3] = broken));
    }
}

/// Many small steps about one axis, past two turns: the twist counts them, the principal vector cannot.
#[test]
fn twist_passes_full_turns() {
    let mut motion = MicropolarMotion::default();
    let mut jet = Jet::<2, 3>::zero();
    jet.value[2] = 0.7;
    for _ in 0..20 {
        follow_rotation(&mut jet);
        motion = Micropolar::advance(&motion, &jet);
        jet.gradient.fill(0.0);
    }
    let stress = MicropolarStress::default();
    let plane = <Micropolar as Fields<2, 3>>::observe_fields(&motion, &stress);
    let space = <Micropolar as Fields<3, 6>>::observe_fields(&motion, &stress);
    assert!((plane.twist.expect("a twist").z - 14.0).abs() < 1e-12);
    assert!((plane.rotation.expect("a rotation").z - 14.0).abs() < 1e-12);
    let principal = space.rotation.expect("a rotation").z;
    assert!(
        (principal.abs() - (14.0 - 4.0 * std::f64::consts::PI)).abs() < 1e-12,
        "{principal}"
    );
    assert!((motion.rotation.quaternion().norm() - 1.0).abs() < 1e-15);
}

#[test]
fn motion_and_stress_survive_packing() {
    let mut random = Random::new(47);
    let motion = moved::<3, 6>(&mut random, 0.3, 1.0);
    let mut packed = vec![f64::NAN; Micropolar::MOTION.iter().map(|part| part.length).sum()];
    Micropolar::pack_motion(&motion, &mut packed);
    assert_eq!(Micropolar::unpack_motion(&packed), motion);
    assert_eq!(packed[1], motion.deformation_gradient[(0, 1)]);
    assert_eq!(packed[9], motion.rotation.quaternion().w);
    let stress = MicropolarStress {
        force: motion.deformation_gradient,
        couple: motion.wryness,
    };
    let mut packed = vec![f64::NAN; Micropolar::STRESS.iter().map(|part| part.length).sum()];
    Micropolar::pack_stress(&stress, &mut packed);
    assert_eq!(Micropolar::unpack_stress(&packed), stress);
    assert_eq!(packed[9 + 6], motion.wryness[(2, 0)]);
}

/// `sigma = tau/J` with `tau = Q B U^T Q^T`, and the couple-stress alike.
#[test]
fn observation_gives_cauchy_stresses() {
    let mut random = Random::new(53);
    let motion = moved::<3, 6>(&mut random, 0.2, 0.6);
    let stress = MicropolarStress {
        force: random.strain(Components::Space, 1.0, 1.0).stretch,
        couple: random.strain(Components::Space, 1.0, 1.0).wryness,
    };
    let seen = Micropolar::observe(&motion, &stress);
    let q = Rotation3::from(motion.rotation).into_inner();
    let stretch = q.transpose() * motion.deformation_gradient;
    let volume = motion.deformation_gradient.determinant();
    for (cauchy, conjugate) in [
        (seen.stress, stress.force),
        (seen.couple_stress.expect("micropolar"), stress.couple),
    ] {
        let expected = q * conjugate * stretch.transpose() * q.transpose() / volume;
        assert!((cauchy - expected).norm() < 1e-14 * expected.norm());
    }
    assert!((seen.volume_ratio - volume).abs() < 1e-15);
    assert_eq!(seen.wryness, Some(motion.wryness));
}
