//! What a friction angle and a cohesion amount to in plane strain: told where nobody chose the cone, and right where one did.

use crate::common::launch::Launch;

/// Soil between smooth walls.
const SOIL: &str = "
model: {kinematics: plane_strain, continuum: classical}
grid: {min: [0.0, 0.0], max: [2.0, 2.0], cells: 2}
materials:
  soil: {law: drucker_prager, youngs_modulus: 1.0e7, poisson_ratio: 0.3, friction_angle: 30.0, dilatancy_angle: 0.0,
         cohesion: 10.0e3}
bodies:
  - {name: block, material: soil, shape: {box: {min: [0.0, 0.0], max: [2.0, 2.0]}}, points_per_cell: 2}
boundary:
  - {face: x_min, fix: [ux]}
  - {face: y_min, fix: [uy]}
  - {face: y_max, move: {uy: -1.0e-4}}
stages: [{name: press, steps: 1}]
";

/// The cone through the compression corners with alpha = 1.2: sin phi = 1.2/sqrt(3), and 6 c cos 30/2.5 over sqrt(3) cos phi.
const AMOUNTS: &str = "material soil: cone_fit is not set, and the cone is that of triaxial compression: friction_angle 30 \
                       degrees and a cohesion of 10 kPa are at failure in plane strain Mohr-Coulomb with 43.9 degrees and \
                       16.6 kPa";

#[test]
fn a_cone_that_nobody_chose_is_told() {
    let checked = |overrides: &[&str]| {
        let check = Launch::text(SOIL).no_output().checking().set(overrides);
        check.run().completed().stdout
    };
    assert!(
        checked(&[]).contains(&format!("warning: {AMOUNTS}")),
        "{}",
        checked(&[])
    );
    let strength = "materials.soil={law: drucker_prager, youngs_modulus: 1.0e7, poisson_ratio: 0.3, friction_angle: 45.0, \
                    dilatancy_angle: 0.0, yield_strength: 2.0e6}";
    let steep = checked(&[strength]);
    let told = "friction_angle 45 degrees and a yield_strength of 2 MPa are at failure in plane strain stronger than \
                Mohr-Coulomb with any friction angle";
    assert!(steep.contains(told), "{steep}");
    // Nothing to tell where the cone was chosen, or there is none.
    for choice in [
        "materials.soil.cone_fit=compression",
        "materials.soil.cone_fit=plane_strain",
        "materials.soil.cone_fit=0.5",
        "materials.soil={law: von_mises, youngs_modulus: 1.0e7, poisson_ratio: 0.3, yield_strength: 1.0e4}",
    ] {
        let printed = checked(&[choice]);
        assert!(!printed.contains("cone_fit"), "{choice}: {printed}");
    }
}

#[test]
fn the_run_its_summary_and_its_report_tell_it_too() {
    let run = Launch::text(SOIL).with_report().run().completed();
    assert!(run.stdout.contains(AMOUNTS), "{}", run.stdout);
    for file in ["summary.json", "report.html"] {
        let text = std::fs::read_to_string(run.file(file)).expect("a file of the run");
        assert!(text.contains(AMOUNTS), "{file}");
    }
    // What is written down says which cone it was, and gives the same again.
    let resolved = std::fs::read_to_string(run.file("config.yaml")).expect("a file of the run");
    assert!(resolved.contains("cone_fit: compression"), "{resolved}");
    let again = Launch::file(&run.file("config.yaml")).run().completed();
    assert_eq!(run.history(), again.history());
}

#[test]
fn wrong_fits_are_refused() {
    for (value, message) in [
        (
            "plain_strain",
            "materials.soil.cone_fit: \"plain_strain\" is not accepted, did you mean \"plane_strain\"? (accepted: \
             compression, extension, plane_strain, inscribed, a number from -1 to 1)",
        ),
        (
            "1.5",
            "materials.soil.cone_fit: 1.5 is out of bounds (accepted: compression, extension,",
        ),
        (
            "[1.0]",
            "materials.soil.cone_fit: a list is not accepted (accepted: compression,",
        ),
        (
            "{a: 1}",
            "materials.soil.cone_fit: a mapping of keys is not accepted (accepted: compression,",
        ),
    ] {
        let set = format!("materials.soil.cone_fit={value}");
        let run = Launch::text(SOIL)
            .no_output()
            .checking()
            .set(&[&set])
            .run()
            .expect_code(2);
        assert_eq!(run.complaints("error:").len(), 1, "{value}: {}", run.stderr);
        assert_eq!(run.complaints(message).len(), 1, "{value}: {}", run.stderr);
    }
    let region = "regions=[{within: {box: {min: [0, 0], max: [1, 1]}}, scale: {cone_fit: 0.5}}]";
    let scaled = |fit: &str| Launch::text(SOIL).no_output().checking().set(&[region, fit]).run();
    let word = scaled("materials.soil.cone_fit=extension").expect_code(2);
    let message = "regions[0].scale.cone_fit: a cone_fit that is a word cannot be scaled";
    assert_eq!(word.complaints(message).len(), 1, "{}", word.stderr);
    scaled("materials.soil.cone_fit=0.5").completed();
}

/// Settlement [m] of the crest of a slope of 2:1 and 10 m, with 20 degrees and 10 kPa at 20 kN/m3, whose strength is reduced by
/// a factor; endless where it finds no equilibrium.
fn settlement(factor: f64) -> f64 {
    let tangent = 20.0_f64.to_radians().tan() / factor;
    let (angle, cohesion) = (tangent.atan().to_degrees(), 10.0e3 / factor);
    let run = Launch::text(&format!(
        "
model: {{kinematics: plane_strain, continuum: classical}}
grid: {{min: [0.0, 0.0], max: [34.0, 12.0], cell_size: 1.0, basis: bspline2}}
materials:
  soil: {{law: drucker_prager, youngs_modulus: 100.0e6, poisson_ratio: 0.3, friction_angle: {angle}, dilatancy_angle: 0.0,
         cohesion: {cohesion}, cone_fit: plane_strain}}
bodies:
  - {{name: slope, material: soil, points_per_cell: 3,
     shape: {{polygon: {{vertices: [[0.0, 0.0], [32.0, 0.0], [12.0, 10.0], [0.0, 10.0]]}}}}}}
boundary:
  - {{face: x_min, fix: [ux]}}
  - {{face: y_min, fix: [ux, uy], name: base}}
loads: [{{name: weight, specific_weight: [0.0, -20.0e3]}}]
stages: [{{name: weight, steps: 10, max_halvings: 3}}]
stabilisation: {{ghost: {{translation: 1.0e6, scaling: stiffness}}}}
output: {{history: [{{name: crest, mean: displacement, at: {{nearest: [12.0, 10.0]}}}}]}}
"
    ))
    .run();
    match run.status.code() {
        Some(0) => -run.history().last("crest_y"),
        code => {
            assert_eq!(code, Some(3), "{}", run.stderr);
            f64::INFINITY
        }
    }
}

/// Bishop and Morgenstern (1960) have a factor of safety of 1.38 for this slope, Griffiths and Lane (1999) 1.4. With the
/// angle and cohesion of the textbook it stands at 1.4, and at 1.5 its crest slides down to where it leans less.
#[test]
fn a_slope_has_the_factor_of_safety_of_the_textbook() {
    let whole = settlement(1.0);
    let (stands, falls) = (settlement(1.4) / whole, settlement(1.5) / whole);
    assert!(stands < 4.0 && falls > 20.0, "{stands} and {falls} times {whole} m");
}
