//! What `check` estimates and advises: for each piece of advice a scene that calls for it, and one that does not.

use crate::common::launch::Launch;

/// A micropolar block between a fixed and a sheared face, six cells of 10 mm wide and four high.
const BLOCK: &str = "
model: {kinematics: plane_strain}
grid: {min: [0.0, 0.0], max: [0.06, 0.04], cell_size: 0.01}
materials:
  rock: {law: von_mises, youngs_modulus: 1.0e9, poisson_ratio: 0.3, coupling_modulus: 1.0e8, bending_length: 0.01,
         bounded_stiffness: true, yield_strength: 1.0e6, plastic_length: 0.02}
bodies:
  - {name: block, material: rock, shape: {box: {min: [0.0, 0.0], max: [0.06, 0.04]}}, points_per_cell: 2}
boundary:
  - {face: y_min, fix: [ux, uy, rz]}
  - {face: y_max, fix: [uy, rz], move: {ux: 0.001}}
stages:
  - {name: shear, steps: 20}
";

/// A classical bar of 3 x 3 x 3 cells.
const SPACE: &str = "
model: {kinematics: three_dimensional, continuum: classical}
grid: {min: [0.0, 0.0, 0.0], max: [3.0, 3.0, 3.0], cells: 3}
materials:
  steel: {law: elastic, youngs_modulus: 2.0e11, poisson_ratio: 0.3}
bodies:
  - {name: bar, material: steel, shape: {box: {min: [0.0, 0.0, 0.0], max: [3.0, 2.0, 3.0]}}, points_per_cell: 2}
boundary:
  - {face: x_min, fix: [ux, uy]}
  - {face: x_max, fix: [uy], move: {ux: 0.001}}
  - {face: z_min, fix: [uz]}
stages:
  - {name: pull, steps: 1}
";

/// The lines of advice about a scene with overrides.
fn advice(scene: &str, overrides: &[&str]) -> Vec<String> {
    let run = Launch::text(scene).no_output().set(overrides);
    let check = run.checking().run().completed();
    assert_eq!(check.stderr, "");
    let lines = check.stdout.lines().filter_map(|line| line.strip_prefix("advice: "));
    lines.map(str::to_owned).collect()
}

/// Advice with a word comes with some overrides and not with others.
fn compare(scene: &str, word: &str, with: &[&str], without: &[&str]) {
    let found = advice(scene, with);
    assert_eq!(
        found.iter().filter(|line| line.contains(word)).count(),
        1,
        "{word}: {found:?}"
    );
    let found = advice(scene, without);
    assert!(found.iter().all(|line| !line.contains(word)), "{word}: {found:?}");
}

#[test]
fn a_sheared_block_of_resolved_cells_needs_no_advice() {
    assert_eq!(advice(BLOCK, &[]), Vec::<String>::new());
}

#[test]
fn space_without_motion_across_is_plane_strain() {
    compare(SPACE, "plane_strain", &["boundary.2={face: all, fix: [uz]}"], &[]);
}

#[test]
fn rotations_that_nothing_drives_are_idle() {
    let uncoupled = "materials.rock.coupling_modulus=0.0";
    let driven = "boundary.1={face: y_max, fix: [ux, uy], move: {rz: 0.01}}";
    compare(BLOCK, "continuum: classical", &[uncoupled], &[]);
    compare(BLOCK, "continuum: classical", &[uncoupled], &[uncoupled, driven]);
}

#[test]
fn cells_are_compared_with_the_internal_length() {
    let length = |value: &str| format!("materials.rock.plastic_length={value}");
    compare(
        BLOCK,
        "larger than the internal length",
        &[&length("0.009")],
        &[&length("0.01")],
    );
    compare(
        BLOCK,
        "far smaller than the internal length",
        &[&length("0.21")],
        &[&length("0.19")],
    );
}

#[test]
fn thousands_of_points_in_a_cell_are_too_many() {
    compare(
        BLOCK,
        "points per active cell",
        &["bodies.0.points_per_cell=40"],
        &["bodies.0.points_per_cell=20"],
    );
}

#[test]
fn symmetric_halves_are_seen() {
    let pressed = "boundary.1={face: y_max, fix: [rz], move: {uy: -0.001}}";
    let held = "boundary.0={face: y_min, fix: [ux, uy, rz]}";
    let word = "mirror-symmetric about x = 0.03";
    compare(BLOCK, word, &[pressed, held], &[]);
    // Each of these breaks it: a side that is held, a material, a body, a load across.
    for breaking in [
        "boundary.0={face: x_min, fix: [ux]}",
        "regions=[{within: {box: {min: [0.0, 0.0], max: [0.01, 0.04]}}, scale: {yield_strength: 0.9}}]",
        "bodies.0.shape={polygon: {vertices: [[0.0, 0.0], [0.06, 0.0], [0.06, 0.02], [0.0, 0.04]]}}",
        "loads=[{specific_weight: [1.0e3, 0.0]}]",
        "loads=[{force: [0.0, -1.0e3], at: {nearest: [0.0, 0.04]}}]",
    ] {
        compare(BLOCK, word, &[pressed, held], &[pressed, held, breaking]);
    }
    // A weight along the plane keeps it.
    compare(
        BLOCK,
        word,
        &[pressed, held, "loads=[{specific_weight: [0.0, -1.0e3]}]"],
        &[],
    );
}

#[test]
fn the_size_of_a_run_is_estimated() {
    let check = Launch::text(BLOCK).no_output().checking().run().completed();
    for line in [
        "degrees of freedom  105",
        "steps               20",
        "solver memory       about 1 MB",
        "cost class          seconds",
    ] {
        assert!(check.stdout.contains(line), "{line}\n{}", check.stdout);
    }
    let iterative = Launch::text(BLOCK)
        .no_output()
        .checking()
        .set(&["solver.method=iterative"]);
    let line = "MB in all (estimate for the iterative solver, which solver.method takes here; about 1 MB for a direct";
    let printed = iterative.run().completed().stdout;
    assert!(printed.contains(line), "{printed}");
    let many = ["stages.0.steps=100000", "grid.cell_size=1.0e-3"];
    let check = Launch::text(BLOCK).no_output().checking().set(&many).run().completed();
    assert!(check.stdout.contains("cost class          hours") || check.stdout.contains("cost class          days"));
}
