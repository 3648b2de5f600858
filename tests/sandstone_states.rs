//! The sandstone law against an independent implementation (tests/reference/README.md): states and tangents, in MPa and
//! mm.
//!
//! The reference writes the transposes of our tensors: `C = U^T`, `B` conjugate to `C`.

use mpm_petsc::continuum::gradient_micropolar::{
    GradientMicropolar, GradientMicropolarModuli, GradientMicropolarStrain, GradientMicropolarStress,
};
use mpm_petsc::continuum::micropolar::MicropolarStrain;
use mpm_petsc::continuum::tensor::component;
use mpm_petsc::material::sandstone::{Sandstone, SandstoneState};
use mpm_petsc::material::spec::{SandstoneDamage, SandstoneParameters, SandstoneYield};
use mpm_petsc::material::{Components, Material, NoSolution};
use nalgebra::{Matrix3, Vector3};
use serde_json::Value;

const STATE_TOLERANCE: f64 = 1e-9;
/// The reference tangents are central differences of fourth order with relative errors up to 6e-9.
const TANGENT_TOLERANCE: f64 = 1e-6;

fn reference() -> Value {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/reference/sandstone_states.json");
    serde_json::from_str(&std::fs::read_to_string(path).expect("readable")).expect("valid JSON")
}

fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

fn tensor(value: &Value) -> Matrix3<f64> {
    Matrix3::from_fn(|i, j| number(&value[i][j]))
}

/// The law's parameters from the elastic constants, lengths and angles of the reference.
fn parameters(material: &Value) -> SandstoneParameters {
    let get = |key: &str| number(&material[key]);
    let (young, poisson) = (get("E"), get("nu"));
    let shear = young / (2.0 * (1.0 + poisson));
    let gamma = shear * get("lt").powi(2);
    let beta = 4.0 * shear * get("lb").powi(2) - gamma;
    let fit = get("A");
    let (phi, psi) = (get("phi").to_radians(), get("psi").to_radians());
    let slope = |angle: f64| 6.0 * angle.sin() / (3.0 + fit * angle.sin());
    SandstoneParameters {
        shear_modulus: shear,
        bulk_modulus: young / (3.0 * (1.0 - 2.0 * poisson)),
        coupling_modulus: get("GcG") * shear,
        alpha: 2.0 * gamma * (1.0 / get("psi_pol") - 1.0),
        beta,
        gamma,
        plastic: Some(SandstoneYield {
            strength: 6.0 * get("c") * phi.cos() / (3.0 + fit * phi.sin()),
            friction_slope: slope(phi),
            dilatancy_slope: slope(psi),
            hardening_stress: get("hD"),
            hardening_rate: get("hexp"),
            dilation_rate: get("hd"),
            plastic_length: get("lJ2"),
            weights: ["a1", "a2", "a3", "a4"].map(get),
            apex_rounding: get("ah"),
            tolerance: 1e-13,
        }),
        damage: Some(SandstoneDamage {
            length: get("ld"),
            softening_modulus: get("epsf"),
            max_damage: get("omax"),
        }),
    }
}

fn strain_of(state: &Value) -> GradientMicropolarStrain {
    GradientMicropolarStrain {
        micropolar: MicropolarStrain {
            stretch: tensor(&state["C"]).transpose(),
            wryness: tensor(&state["Gamma_JI"]),
        },
        alpha: number(&state["alpha_nl"]),
        alpha_gradient: Vector3::zeros(),
    }
}

/// Whether plane strain can hold a state: nothing out of the plane but the curvature of rotations about axis 3.
fn is_plane(state: &Value) -> bool {
    let (c, gamma) = (tensor(&state["C"]), tensor(&state["Gamma_JI"]));
    let in_plane = c[(2, 2)] == 1.0 && [(0, 2), (1, 2), (2, 0), (2, 1)].iter().all(|&pair| c[pair] == 0.0);
    in_plane && gamma.fixed_rows::<2>(0).norm() == 0.0 && gamma[(2, 2)] == 0.0
}

struct Case {
    law: Sandstone,
    strain: GradientMicropolarStrain,
    old: Vec<f64>,
}

impl Case {
    fn new(state: &Value, parameters: &SandstoneParameters, components: Components) -> Self {
        let mut old = vec![0.0; 20];
        let plastic = tensor(&state["Fp_old"]);
        SandstoneState {
            inverse_plastic_deformation: plastic.try_inverse().expect("regular"),
            plastic_wryness: tensor(&state["Gp_old"]),
            chi: number(&state["alpha_p_old"]),
            damage: 0.0,
        }
        .pack(&mut old);
        Self {
            law: Sandstone::new(parameters, components),
            strain: strain_of(state),
            old,
        }
    }

    fn respond(&self) -> Result<(GradientMicropolarStress, Vec<f64>), NoSolution> {
        let mut new = vec![f64::NAN; 20];
        let mut stress = GradientMicropolarStress::default();
        Material::<GradientMicropolar>::respond(&self.law, &self.strain, &self.old, &mut new, &mut stress)?;
        Ok((stress, new))
    }
}

/// Names of what differs from the reference, with the difference.
fn state_differences(state: &Value, case: &Case) -> Vec<String> {
    let (stress, new) = match case.respond() {
        Ok(response) => response,
        Err(failure) => return vec![format!("{failure:?}")],
    };
    let new = SandstoneState::unpack(&new);
    let mut found = Vec::new();
    let mut note = |what: &str, difference: f64, scale: f64| {
        // Written so that what is not a number differs.
        let same = difference <= STATE_TOLERANCE * scale;
        if !same {
            found.push(format!("{what}: {difference:.3e} of {scale:.3e}"));
        }
    };
    let plastic = tensor(&state["Fp"]);
    let wryness_scale = tensor(&state["Gamma_JI"]).norm();
    for (what, ours, theirs, scale) in [
        ("B", stress.micropolar.force.transpose(), tensor(&state["B_KJ"]), 1.0),
        ("M", stress.micropolar.couple, tensor(&state["M_JI"]), 1.0),
        (
            "Fp",
            new.inverse_plastic_deformation.try_inverse().expect("regular"),
            plastic,
            1.0,
        ),
        ("Gp", new.plastic_wryness, tensor(&state["Gp"]), wryness_scale),
    ] {
        note(what, (ours - theirs).norm(), theirs.norm().max(scale * 1e-6));
    }
    let driver = case.strain.alpha - stress.source;
    for (what, ours, theirs) in [
        ("alpha_d", driver, number(&state["alpha_d"])),
        ("alpha_p", new.chi, number(&state["alpha_p"])),
        ("omega", new.damage, number(&state["omega"])),
    ] {
        note(what, (ours - theirs).abs(), theirs.abs().max(1e-6));
    }
    found
}

/// Row and column of our tangent that stand for component `n` of the reference's list `C, Gamma, alpha`.
fn place(n: usize) -> (usize, usize) {
    match n {
        0..9 => (0, component(n % 3, n / 3)),
        9..18 => (1, n - 9),
        _ => (2, 0),
    }
}

/// Our derivative of `B, M, alpha_d` by `C, Gamma, alpha`, in the order of the reference.
fn tangent_entry(moduli: &GradientMicropolarModuli, row: usize, column: usize) -> f64 {
    let coupled = if moduli.micropolar.coupled { 1.0 } else { 0.0 };
    let by = |tensor: &Matrix3<f64>, n: usize| tensor[(n / 3, n % 3)];
    let m = &moduli.micropolar;
    match (place(row), place(column)) {
        ((0, i), (0, j)) => m.force_stretch[(i, j)],
        ((0, i), (1, j)) => coupled * m.force_wryness[(i, j)],
        ((1, i), (0, j)) => coupled * m.couple_stretch[(i, j)],
        ((1, i), (1, j)) => m.couple_wryness[(i, j)],
        ((0, i), _) => by(&moduli.stress_alpha.force, i),
        ((1, i), _) => by(&moduli.stress_alpha.couple, i),
        (_, (0, j)) => -by(&moduli.source_strain.force, j),
        (_, (1, j)) => -by(&moduli.source_strain.couple, j),
        _ => 1.0 - moduli.source_alpha,
    }
}

/// Largest difference between our tangent and the reference's, in each of its nine blocks relative to the largest entry.
fn tangent_difference(state: &Value, case: &Case, components: Components) -> f64 {
    let Ok((stress, new)) = case.respond() else {
        return f64::INFINITY;
    };
    let mut moduli = GradientMicropolarModuli::default();
    Material::<GradientMicropolar>::moduli(&case.law, &case.strain, &case.old, &new, &stress, &mut moduli);
    let theirs = &state["tangent_d_B_M_ad__d_C_Gamma_an"];
    let driven = |n: usize| match components {
        Components::Space => true,
        // C_11, C_12, C_21, C_22; Gamma_31, Gamma_32; alpha.
        Components::Plane => [0, 1, 3, 4, 15, 16, 18].contains(&n),
    };
    let mut largest = [[0.0f64; 3]; 3];
    let mut worst = [[0.0f64; 3]; 3];
    for row in (0..19).filter(|&n| driven(n)) {
        for column in (0..19).filter(|&n| driven(n)) {
            let theirs = number(&theirs[row][column]);
            let difference = (tangent_entry(&moduli, row, column) - theirs).abs();
            let (i, j) = (place(row).0, place(column).0);
            largest[i][j] = largest[i][j].max(theirs.abs());
            worst[i][j] = if difference.is_nan() {
                f64::INFINITY
            } else {
                worst[i][j].max(difference)
            };
        }
    }
    // Blocks that vanish hold what rounding leaves of stresses of 1e4 MPa.
    let relative = |(worst, largest): (&f64, &f64)| worst / largest.max(1e-5);
    worst
        .iter()
        .flatten()
        .zip(largest.iter().flatten())
        .map(relative)
        .fold(0.0, f64::max)
}

/// All differences of all states, with parameters changed by `change`.
fn compare(change: impl Fn(&mut SandstoneParameters)) -> (usize, Vec<String>) {
    let reference = reference();
    let mut count = 0;
    let mut found = Vec::new();
    for state in reference["states"].as_array().expect("a list") {
        let name = state["name"].as_str().expect("a name");
        let mut parameters = parameters(&reference["parameters"][state["parameters"].as_str().expect("a name")]);
        change(&mut parameters);
        for components in [Components::Space, Components::Plane] {
            if components == Components::Plane && !is_plane(state) {
                continue;
            }
            let case = Case::new(state, &parameters, components);
            count += 1;
            let differences = state_differences(state, &case);
            found.extend(
                differences
                    .into_iter()
                    .map(|what| format!("{name}, {components:?}: {what}")),
            );
            let tangent = tangent_difference(state, &case, components);
            if tangent > TANGENT_TOLERANCE {
                found.push(format!("{name}, {components:?}: tangent {tangent:.3e}"));
            }
        }
    }
    (count, found)
}

#[test]
fn states_and_tangents_agree_with_the_reference() {
    let (count, found) = compare(|_| {});
    assert_eq!(count, 17);
    assert!(found.is_empty(), "{found:#?}");
}

/// The comparison is not vacuous: each of these slips must be noticed.
#[test]
fn comparison_notices_slips_in_the_law() {
    type Slip = (&'static str, fn(&mut SandstoneParameters));
    fn plastic(parameters: &mut SandstoneParameters) -> &mut SandstoneYield {
        parameters.plastic.as_mut().expect("a yield surface")
    }
    let slips: [Slip; 7] = [
        ("dilatancy with the other sign", |p| plastic(p).dilatancy_slope *= -1.0),
        ("friction with the other sign", |p| plastic(p).friction_slope *= -1.0),
        ("constant dilatancy", |p| plastic(p).dilation_rate = 0.0),
        ("symmetric deviator", |p| plastic(p).weights = [0.25, 0.25, 0.5, 0.0]),
        ("coupling with the other sign", |p| p.coupling_modulus *= -1.0),
        ("another softening", |p| {
            p.damage.as_mut().expect("damage").softening_modulus *= -1.0
        }),
        ("rounded apex", |p| plastic(p).apex_rounding = 0.1),
    ];
    for (what, slip) in slips {
        let (_, found) = compare(slip);
        assert!(!found.is_empty(), "{what} is not noticed");
    }
}
