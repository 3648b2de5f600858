//! The elastoplastic law against an independent implementation (tests/reference/README.md).

use mpm_petsc::continuum::micropolar::{Micropolar, MicropolarStrain, MicropolarStress};
use mpm_petsc::continuum::total_length;
use mpm_petsc::material::drucker_prager::{Branch, DruckerPrager, PlasticState};
use mpm_petsc::material::spec::{ElasticModuli, PlasticParameters};
use mpm_petsc::material::{Components, Material, NoSolution};
use nalgebra::Matrix3;
use serde_json::Value;

/// Tolerance of the reference itself is 2e-13; rounding in its deformation gradients adds a few digits.
const TOLERANCE: f64 = 1e-8;
/// Of the return to the apex.
const APEX_TOLERANCE: f64 = 1e-6;

fn reference() -> Value {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/reference/point_states.json");
    serde_json::from_str(&std::fs::read_to_string(path).expect("readable")).expect("valid JSON")
}

fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

fn tensor(value: &Value) -> Matrix3<f64> {
    Matrix3::from_fn(|i, j| number(&value[i][j]))
}

fn parameters(material: &Value) -> (ElasticModuli, PlasticParameters) {
    let get = |key: &str| number(&material[key]);
    let elastic = ElasticModuli {
        lambda: get("lam"),
        mu: get("mu"),
        kappa: get("kappa"),
        alpha: get("alpha"),
        beta: get("beta"),
        gamma: get("gamma"),
    };
    let plastic = PlasticParameters {
        friction_slope: get("alphaDP"),
        dilatancy_slope: get("betaDP"),
        yield_strength: get("k"),
        hardening_modulus: get("H"),
        plastic_length: get("lp"),
        tolerance: 1e-13,
    };
    (elastic, plastic)
}

/// What the reference tells of a response, made from ours.
struct Outcome {
    kirchhoff: Matrix3<f64>,
    couple: Matrix3<f64>,
    elastic_deformation: Matrix3<f64>,
    elastic_wryness: Matrix3<f64>,
    multiplier: f64,
    pressure: f64,
    shear: f64,
    state: PlasticState,
}

fn respond(
    law: &DruckerPrager,
    plastic: &PlasticParameters,
    rotation: &Matrix3<f64>,
    strain: &MicropolarStrain,
    old: &PlasticState,
) -> Result<Outcome, NoSolution> {
    let length = total_length(Material::<Micropolar>::state_variables(law));
    let (mut before, mut after) = (vec![0.0; length], vec![f64::NAN; length]);
    old.pack(&mut before);
    let mut stress = MicropolarStress::default();
    law.respond(strain, &before, &mut after, &mut stress)?;
    let state = PlasticState::unpack(&after);
    let push = |conjugate: &Matrix3<f64>| rotation * conjugate * strain.stretch.transpose() * rotation.transpose();
    let (kirchhoff, couple) = (push(&stress.force), push(&stress.couple));
    let pressure = kirchhoff.trace() / 3.0;
    let deviator = (kirchhoff + kirchhoff.transpose()) / 2.0 - Matrix3::identity() * pressure;
    let couples = couple.norm_squared() / plastic.plastic_length.powi(2);
    Ok(Outcome {
        kirchhoff,
        couple,
        elastic_deformation: rotation * strain.stretch * state.inverse_plastic_deformation,
        elastic_wryness: strain.wryness - state.plastic_wryness,
        multiplier: state.chi - old.chi,
        pressure,
        shear: (1.5 * (deviator.norm_squared() + couples)).sqrt(),
        state,
    })
}

/// Inputs of a reference state in our variables: rotation, strain, old state.
fn inputs(input: &Value) -> (Matrix3<f64>, MicropolarStrain, PlasticState) {
    let rotation = tensor(&input["Q"]);
    let strain = MicropolarStrain {
        stretch: rotation.transpose() * tensor(&input["F"]),
        wryness: tensor(&input["Gamma"]),
    };
    let old_inverse = tensor(&input["F_prev"]).try_inverse().expect("regular");
    let old = PlasticState {
        inverse_plastic_deformation: old_inverse * tensor(&input["Fe_prev"]),
        plastic_wryness: tensor(&input["Gamma_p_prev"]),
        chi: number(&input["chi_prev"]),
        branch: Branch::Elastic,
    };
    (rotation, strain, old)
}

/// Names of what differs, with the relative difference.
fn differences(outcome: &Outcome, expected: &Value, strength: f64, tolerance: f64) -> Vec<String> {
    let mut found = Vec::new();
    let mut note = |what: &str, difference: f64, scale: f64| {
        // Written so that what is not a number differs.
        let same = difference <= tolerance * scale;
        if !same {
            found.push(format!("{what}: {difference:.3e} of {scale:.3e}"));
        }
    };
    for (what, ours) in [
        ("tau", &outcome.kirchhoff),
        ("nu", &outcome.couple),
        ("Fe", &outcome.elastic_deformation),
        ("Gamma_e", &outcome.elastic_wryness),
    ] {
        let theirs = tensor(&expected[what]);
        note(what, (ours - theirs).norm(), theirs.norm());
    }
    for (what, ours, least) in [
        ("chi", outcome.state.chi, 0.0),
        ("dgamma", outcome.multiplier, 0.0),
        ("p", outcome.pressure, 0.0),
        ("q", outcome.shear, strength),
    ] {
        let theirs = number(&expected[what]);
        note(what, (ours - theirs).abs(), theirs.abs().max(least));
    }
    found
}

/// All differences of all states but the one beyond the cone, with parameters changed by `change`.
fn compare_states(change: impl Fn(&mut PlasticParameters)) -> (usize, Vec<String>) {
    let reference = reference();
    let mut count = 0;
    let mut found = Vec::new();
    for (index, state) in reference["states"].as_array().expect("a list").iter().enumerate() {
        if state["output"]["converged"] == false {
            continue;
        }
        let (elastic, mut plastic) = parameters(&reference["materials"][state["material"].as_str().expect("a name")]);
        change(&mut plastic);
        let law = DruckerPrager::new(&elastic, &plastic, Components::Space);
        let (rotation, strain, old) = inputs(&state["input"]);
        count += 1;
        match respond(&law, &plastic, &rotation, &strain, &old) {
            Ok(outcome) => {
                let plastic_there = state["output"]["plastic"].as_bool().expect("a flag");
                assert_eq!(outcome.state.branch != Branch::Elastic, plastic_there, "state {index}");
                let list = differences(&outcome, &state["output"], plastic.yield_strength, TOLERANCE);
                found.extend(list.into_iter().map(|what| format!("state {index}: {what}")));
            }
            Err(failure) => found.push(format!("state {index}: {failure:?}")),
        }
    }
    (count, found)
}

#[test]
fn states_agree_with_the_reference() {
    let (count, found) = compare_states(|_| {});
    assert_eq!(count, 12);
    assert!(found.is_empty(), "{found:#?}");
}

/// The comparison is not vacuous: each of these slips must be noticed.
#[test]
fn comparison_notices_slips_in_the_law() {
    type Slip = (&'static str, fn(&mut PlasticParameters));
    let slips: [Slip; 4] = [
        ("sign of the pressure term", |p| p.friction_slope = -p.friction_slope),
        ("sign of hardening", |p| p.hardening_modulus = -p.hardening_modulus),
        ("associated flow", |p| p.dilatancy_slope = p.friction_slope),
        ("internal length", |p| p.plastic_length *= 1.000001),
    ];
    for (what, slip) in slips {
        let (_, found) = compare_states(slip);
        assert!(!found.is_empty(), "{what} goes unnoticed");
    }
}

#[test]
fn tension_beyond_the_cone_returns_to_the_apex() {
    let reference = reference();
    let state = &reference["states"][7];
    assert_eq!(state["output"]["converged"], false);
    let (elastic, plastic) = parameters(&reference["materials"]["soil"]);
    let law = DruckerPrager::new(&elastic, &plastic, Components::Space);
    let (rotation, strain, old) = inputs(&state["input"]);
    let outcome = respond(&law, &plastic, &rotation, &strain, &old).expect("a return to the apex");
    assert_eq!(outcome.state.branch, Branch::Apex);
    let yield_value = outcome.shear + plastic.friction_slope * outcome.pressure - plastic.yield_strength;
    assert!(yield_value <= 1e-9 * plastic.yield_strength, "{yield_value}");
    let expected = &state["output_with_apex_return"];
    let found = differences(&outcome, expected, plastic.yield_strength, APEX_TOLERANCE);
    assert!(found.is_empty(), "{found:#?}");
}

/// A path from virgin material in ours, step by step; wryness zero.
fn compare_path(name: &str, material: &str, components: Components) {
    let reference = reference();
    let (elastic, plastic) = parameters(&reference["materials"][material]);
    let law = DruckerPrager::new(&elastic, &plastic, components);
    let path = reference["paths"][name].as_array().expect("a list");
    assert_eq!(path.len(), 20);
    let mut state = PlasticState::default();
    for row in path {
        let step = &row["step"];
        let rotation = tensor(&row["Q"]);
        let strain = MicropolarStrain {
            stretch: rotation.transpose() * tensor(&row["F"]),
            wryness: Matrix3::zeros(),
        };
        let outcome = respond(&law, &plastic, &rotation, &strain, &state).expect("a response");
        for (what, ours) in [("tau", outcome.kirchhoff), ("Fe", outcome.elastic_deformation)] {
            let theirs = tensor(&row[what]);
            let difference = (ours - theirs).norm();
            assert!(
                difference <= TOLERANCE * theirs.norm(),
                "{name}, step {step}, {what}: {difference:e}"
            );
        }
        for (what, ours) in [
            ("chi", outcome.state.chi),
            ("p", outcome.pressure),
            ("q", outcome.shear),
        ] {
            let theirs = number(&row[what]);
            let difference = (ours - theirs).abs();
            assert!(
                difference <= TOLERANCE * theirs.abs(),
                "{name}, step {step}, {what}: {difference:e}"
            );
        }
        state = outcome.state;
    }
    assert!(state.chi > 0.0, "the path must flow");
}

#[test]
fn paths_agree_with_the_reference() {
    for components in [Components::Space, Components::Plane] {
        compare_path("shear_Q1", "shear", components);
        compare_path("compression", "shear", components);
    }
}
