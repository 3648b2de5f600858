//! `mpm-petsc point`: paths through the program against the reference, and what it says when a path ends early.

use crate::common::launch::Launch;
use crate::common::results::Table;
use nalgebra::Matrix3;
use serde_json::Value;

fn reference() -> Value {
    serde_json::from_str(include_str!("../reference/point_states.json")).expect("valid JSON")
}

fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

/// The angle whose slope is `6 sin / (3 - sin)`, in degrees.
fn angle(slope: &Value) -> f64 {
    let slope = number(slope);
    (3.0 * slope / (6.0 + slope)).asin().to_degrees()
}

/// The material of the reference paths, and a path to the given end.
fn scene(kinematics: &str, end: &str) -> String {
    let all = reference();
    let m = &all["materials"]["shear"];
    format!(
        "materials:\n  rock: {{law: drucker_prager, lame_lambda: {:e}, shear_modulus: {:e}, coupling_modulus: {:e}, alpha: {:e}, \
         beta: {:e}, gamma: {:e},\n    friction_angle: {:?}, dilatancy_angle: {:?}, yield_strength: {:e}, plastic_length: {:e}}}\n\
         solver: {{return_map_tolerance: 1.0e-13}}\n\
         path: {{material: rock, kinematics: {kinematics}, {end}}}\n",
        number(&m["lam"]),
        number(&m["mu"]),
        number(&m["kappa"]),
        number(&m["alpha"]),
        number(&m["beta"]),
        number(&m["gamma"]),
        angle(&m["alphaDP"]),
        angle(&m["betaDP"]),
        number(&m["k"]),
        number(&m["lp"]),
    )
}

fn table(text: &str) -> Table {
    let folder = crate::common::folder::Folder::new();
    Table::read(&folder.write("path.csv", text))
}

fn tensor(table: &Table, name: &str, row: usize) -> Matrix3<f64> {
    const AXES: [&str; 3] = ["x", "y", "z"];
    Matrix3::from_fn(|i, j| table.column(&format!("{name}_{}{}", AXES[i], AXES[j]))[row])
}

#[test]
fn paths_agree_with_the_reference() {
    let all = reference();
    for (name, end) in [
        ("shear_Q1", "[[1.0, 0.2], [0.0, 1.0]]"),
        ("compression", "[[1.0, 0.0], [0.0, 0.9]]"),
    ] {
        let expected = all["paths"][name].as_array().expect("a path");
        let text = scene("plane_strain", &format!("steps: 20, deformation_gradient: {end}"));
        let run = Launch::point(&text).run().completed();
        let found = table(&run.stdout);
        assert_eq!(found.rows.len(), expected.len());
        for (row, expected) in expected.iter().enumerate() {
            let theirs = |key: &str| Matrix3::from_fn(|i, j| number(&expected[key][i][j]));
            let f = tensor(&found, "F", row);
            assert!((f - theirs("F")).norm() < 1e-14, "{name} {row}");
            assert!((tensor(&found, "Q", row) - theirs("Q")).norm() < 1e-15, "{name} {row}");
            let volume = f.determinant();
            let (ours, tau) = (tensor(&found, "stress", row) * volume, theirs("tau"));
            assert!((ours - tau).norm() <= 1e-8 * tau.norm(), "{name} {row}: {ours} {tau}");
            for (column, key, scale) in [
                ("chi", "chi", 1.0),
                ("pressure", "p", volume),
                ("von_mises", "q", volume),
            ] {
                let (ours, theirs) = (found.column(column)[row] * scale, number(&expected[key]));
                assert!(
                    (ours - theirs).abs() <= 1e-8 * theirs.abs(),
                    "{name} {row} {column}: {ours} {theirs}"
                );
            }
            let iterations = found.column("local_iterations")[row];
            assert_eq!(
                iterations > 0.0,
                number(&expected["chi"]) > 0.0,
                "{name} {row}: {iterations}"
            );
        }
    }
}

/// What is printed can be read as a file of states, which gives the same again.
#[test]
fn a_printed_path_can_be_driven_again() {
    let end = "steps: 7, deformation_gradient: [[1.0, 0.1, 0.02], [0.03, 1.1, 0.0], [0.0, 0.0, 0.95]], \
               rotation: [0.1, -0.2, 0.3], wryness: [[1.0, 2.0, 0.0], [0.0, 3.0, 0.0], [4.0, 0.0, 0.0]]";
    let first = Launch::point(&scene("three_dimensional", end)).run().completed();
    let again = Launch::point(&scene("three_dimensional", "file: states.csv"))
        .beside("states.csv", &first.stdout)
        .run()
        .completed();
    assert_eq!(first.stdout, again.stdout);
    assert_eq!(first.stdout.lines().count(), 8);
}

#[test]
fn classical_laws_and_whole_scenes_are_driven_too() {
    let text = "
model: {kinematics: three_dimensional, continuum: classical}
materials: {steel: {law: von_mises, youngs_modulus: 2.0e11, poisson_ratio: 0.3, yield_strength: 1.0e8}}
path: {material: steel, steps: 4, deformation_gradient: [[1.01, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]}
stages: [{name: not read, steps: many}]
";
    let run = Launch::point(text).run().completed();
    let found = table(&run.stdout);
    assert!(!run.stdout.contains("couple_stress"));
    // q of the Kirchhoff stress is the strength; p = K ln J.
    let row = 3;
    assert!((found.column("von_mises")[row] * 1.01 - 1.0e8).abs() < 1.0);
    let bulk = 2.0e11 / (3.0 * (1.0 - 2.0 * 0.3));
    let pressure = bulk * 1.01_f64.ln() / 1.01;
    assert!((found.column("pressure")[row] - pressure).abs() < 1e-9 * pressure);
}

/// The sandstone states from virgin material in SI units through the command, with the nonlocal field at its end. The
/// reference is in MPa and mm, and writes the transposes of our stretches.
#[test]
fn sandstone_with_a_damage_field_agrees_with_the_reference() {
    let all: Value = serde_json::from_str(include_str!("../reference/sandstone_states.json")).expect("valid JSON");
    let states = all["states"].as_array().expect("a list");
    let mut flowing = 0;
    for state in states.iter().filter(|state| number(&state["alpha_p_old"]) == 0.0) {
        let parameters = &all["parameters"][state["parameters"].as_str().expect("a name")];
        let name = state["name"].as_str().expect("a name");
        let run = Launch::point(&sandstone_scene(state, parameters)).run().completed();
        let found = table(&run.stdout);
        assert_eq!(found.rows.len(), 1);
        let theirs = |key: &str| Matrix3::from_fn(|i, j| number(&state[key][i][j]));
        // Without a micro-rotation the gradient is the stretch; B^T is the first Piola stress, M that of the couples.
        let (gradient, volume) = (theirs("C").transpose(), theirs("C").determinant());
        let stress = theirs("B_KJ").transpose() * gradient.transpose() * (1.0e6 / volume);
        let couple = theirs("M_JI") * gradient.transpose() * (1.0e3 / volume);
        for (name, ours, theirs) in [
            ("stress", tensor(&found, "stress", 0), stress),
            ("couple_stress", tensor(&found, "couple_stress", 0), couple),
        ] {
            let difference = (ours - theirs).norm();
            assert!(difference <= 1e-9 * theirs.norm() + 1e-3, "{name}: {ours} {theirs}");
        }
        for (column, key) in [("chi", "alpha_p"), ("alpha", "alpha_nl"), ("damage", "omega")] {
            let (ours, theirs) = (found.column(column)[0], number(&state[key]));
            assert!(
                (ours - theirs).abs() <= 1e-9 * theirs.abs(),
                "{name}, {column}: {ours} {theirs}"
            );
        }
        let flows = number(&state["alpha_p"]) > 0.0;
        flowing += usize::from(flows);
        assert_eq!(found.column("local_iterations")[0] > 0.0, flows, "{name}");
    }
    assert!(flowing >= 3, "{flowing}");
}

/// One step to a state of the reference.
fn sandstone_scene(state: &Value, parameters: &Value) -> String {
    let p = |key: &str| number(&parameters[key]);
    let rows = |key: &str, transposed: bool, factor: f64| {
        let entry = |i: usize, j: usize| {
            factor * number(&state[key][if transposed { j } else { i }][if transposed { i } else { j }])
        };
        let row = |i: usize| format!("[{:?}, {:?}, {:?}]", entry(i, 0), entry(i, 1), entry(i, 2));
        format!("[{}, {}, {}]", row(0), row(1), row(2))
    };
    format!(
        "materials:
  stone:
    law: sandstone
    youngs_modulus: {:?}
    poisson_ratio: {:?}
    coupling_ratio: {:?}
    bending_length: {:?}
    torsion_length: {:?}
    polar_ratio: {:?}
    cohesion: {:?}
    friction_angle: {:?}
    dilatancy_angle: {:?}
    plastic_length: {:?}
    hardening_stress: {:?}
    hardening_rate: {:?}
    dilation_rate: {:?}
    apex_rounding: 0.0
    damage_length: {:?}
    softening_modulus: {:?}
solver: {{return_map_tolerance: 1.0e-13}}
path: {{material: stone, kinematics: three_dimensional, continuum: gradient_micropolar, steps: 1, alpha: {:?},
  deformation_gradient: {}, wryness: {}}}
",
        p("E") * 1.0e6,
        p("nu"),
        p("GcG"),
        p("lb") * 1.0e-3,
        p("lt") * 1.0e-3,
        p("psi_pol"),
        p("c") * 1.0e6,
        p("phi"),
        p("psi"),
        p("lJ2") * 1.0e-3,
        p("hD") * 1.0e6,
        p("hexp"),
        p("hd"),
        p("ld") * 1.0e-3,
        p("epsf"),
        number(&state["alpha_nl"]),
        rows("C", true, 1.0),
        rows("Gamma_JI", false, 1.0e3),
    )
}

/// A cylinder that softens has no answer once its strength is used up: rows so far, the step, and exit code 3.
#[test]
fn a_law_without_an_answer_ends_the_path_with_its_step() {
    let text = "
materials: {clay: {law: von_mises, youngs_modulus: 1.0e8, poisson_ratio: 0.3, yield_strength: 1.0e5,
                   hardening_modulus: -1.0e6}}
path: {material: clay, kinematics: plane_strain, continuum: classical, steps: 20,
       deformation_gradient: [[1.0, 0.4], [0.0, 1.0]]}
";
    let run = Launch::point(text).run().expect_code(3);
    let rows = run.stdout.lines().count() - 1;
    assert!((1..20).contains(&rows), "{rows}");
    let message = format!("error: step {} of 20: the law finds no stress: ", rows + 1);
    assert!(run.stderr.starts_with(&message), "{}", run.stderr);
}

#[test]
fn wrong_paths_are_explained() {
    let plane = |end: &str| scene("plane_strain", end);
    for (text, message) in [
        (plane("steps: 0"), "path.steps: 0 is out of bounds"),
        (plane("rotation: 0.1"), "path.steps: this key is missing"),
        (
            plane("steps: 2, file: a.csv"),
            "path.steps: the states of the path come from a file",
        ),
        (plane("file: a.csv"), "a.csv: there is no such file"),
        (
            plane("steps: 2, deformation_gradient: [[1, 0]]"),
            "path.deformation_gradient: this is no tensor",
        ),
        (
            plane("steps: 2, deformation_gradient: [[-1, 0], [0, 1]]"),
            "step 1: the deformation gradient has no positive",
        ),
        (
            plane("steps: 2, rotation: [0.1, 0, 0]"),
            "the deformation leaves the plane",
        ),
        (
            plane("steps: 2, wryness: [[1, 0, 0], [0, 0, 0], [0, 0, 0]]"),
            "the deformation leaves the plane",
        ),
        (plane("steps: 2, rotaton: 0.1"), "did you mean \"rotation\"?"),
        (
            plane("steps: 2").replace("material: rock", "material: rok"),
            "there is no material named \"rok\", did you mean \"rock\"?",
        ),
        (
            plane("steps: 2").replace("kinematics: plane_strain, ", ""),
            "path.kinematics: this key is missing",
        ),
        (
            plane("steps: 2, continuum: classical, rotation: 0.1"),
            "does not know this key",
        ),
    ] {
        let run = Launch::point(&text).run().expect_code(2);
        assert!(run.stderr.contains(message), "{message}\n{}", run.stderr);
        assert_eq!(run.stdout, "");
    }
}

/// A soil without dilatancy and hardening, the commonest one, pulled apart to the apex of its cone and on. There the mean
/// Kirchhoff stress is `k/alpha = c cot(phi)`, the tip of the cone of Drucker and Prager (1952), whatever the motion.
#[test]
fn a_soil_without_dilatancy_stays_at_its_apex() {
    for (friction, dilatancy, cohesion) in [(30.0_f64, 0.0, 10.0e3), (20.0, 0.0, 1.0), (40.0, 1.0e-6, 5.0e6)] {
        let text = format!(
            "materials:
  soil: {{law: drucker_prager, youngs_modulus: 50.0e6, poisson_ratio: 0.2, friction_angle: {friction:?},
         dilatancy_angle: {dilatancy:?}, cohesion: {cohesion:?}}}
path:
  material: soil
  kinematics: three_dimensional
  continuum: classical
  steps: 50
  deformation_gradient: [[1.3, 0.1, 0.0], [0.0, 1.2, 0.0], [0.0, 0.0, 1.1]]
"
        );
        let found = table(&Launch::point(&text).run().completed().stdout);
        assert_eq!(found.rows.len(), 50);
        let expected = cohesion / friction.to_radians().tan();
        for row in 30..50 {
            let volume = tensor(&found, "F", row).determinant();
            let (pressure, shear) = (found.column("pressure")[row], found.column("von_mises")[row]);
            let error = (pressure * volume - expected).abs();
            assert!(error < 1e-9 * expected, "step {row}: {pressure}, not {expected}");
            assert!(shear.abs() < 1e-9 * expected, "step {row}: q = {shear}");
        }
    }
}
