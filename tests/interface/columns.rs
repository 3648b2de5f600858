//! Every quantity that a history can hold, in the plane and in space.
//!
//! The history is compared with the points of the snapshots, which tell every field of every point, and with what is known
//! of the motion: a block that is sheared and pressed by a load in a second stage.

use crate::common::launch::{Launch, Run};
use crate::common::snapshots::Snapshots;

/// Fields that snapshots show; at selections only the first few are asked for.
const FIELDS: [&str; 10] = [
    "displacement",
    "rotation",
    "chi",
    "stress",
    "position",
    "pressure",
    "von_mises",
    "couple_stress",
    "wryness",
    "volume",
];

/// Fields that are asked for at a selection.
fn fields_at(selection: &str) -> &'static [&'static str] {
    if selection == "everywhere" {
        &FIELDS
    } else {
        &FIELDS[..4]
    }
}

const REDUCTIONS: [&str; 3] = ["max", "min", "mean"];

/// Selections by name, and which points of the lattice (positions at the start) they hold.
type Holds = fn(&[f64; 3]) -> bool;
const SELECTIONS: [(&str, &str, Holds); 6] = [
    ("everywhere", "", |_| true),
    ("right", ", at: {layer: {body: block, face: x_max}}", |x| x[0] > 0.017),
    (
        "corner",
        ", at: {layer: {body: block, direction: [1.0, 1.0DEPTH]}}",
        |x| x[0] > 0.017 && x[1] > 0.027,
    ),
    ("single", ", at: {nearest: [0.0, 0.0DEPTH]}", |x| {
        x[0] < 0.003 && x[1] < 0.003 && x[2] < 0.003
    }),
    (
        "base_row",
        ", at: {within: {box: {min: [0.0, 0.0DEPTH], max: [0.02, 0.005ACROSS]}}}",
        |x| x[1] < 0.005,
    ),
    ("loaded", ", at: {load: press}", |x| x[1] > 0.027),
];

/// Of the force per metre of thickness.
const FORCE: f64 = 200.0;

fn thickness(space: bool) -> f64 {
    if space { 0.01 } else { 1.0 }
}

fn scene(space: bool) -> String {
    let (kinematics, depth, across) = if space {
        ("three_dimensional", ", 0.0", ", 0.01")
    } else {
        ("plane_strain", "", "")
    };
    // In space the block may widen to both sides.
    let (below, above) = if space { (", -0.01", ", 0.02") } else { ("", "") };
    let force = -FORCE * thickness(space);
    let sideways = if space { ", uz" } else { "" };
    let mut history = String::new();
    for (name, selection, _) in SELECTIONS {
        let selection = selection.replace("DEPTH", depth).replace("ACROSS", across);
        let twists: &[&str] = match (name, space) {
            ("everywhere", true) => &["twist_x", "twist_y", "twist_z"],
            ("everywhere", false) => &["twist_z"],
            _ => &[],
        };
        for field in fields_at(name).iter().chain(twists) {
            for reduction in REDUCTIONS {
                history += &format!("    - {{name: {name}_{reduction}_{field}, {reduction}: {field}{selection}}}\n");
            }
        }
    }
    format!(
        "
model: {{kinematics: {kinematics}}}
grid: {{min: [0.0, 0.0{below}], max: [0.04, 0.04{above}], cell_size: 0.01, basis: linear}}
materials:
  steel: {{law: von_mises, lame_lambda: 8.0e6, shear_modulus: 6.0e6, coupling_modulus: 1.0e6, bending_length: 3.0e-3,
          bounded_stiffness: true, yield_strength: 100.0e3, hardening_modulus: 1.0e5, plastic_length: 4.0e-3}}
bodies:
  - {{name: block, material: steel, shape: {{box: {{min: [0.0, 0.0{depth}], max: [0.02, 0.03{across}]}}}}, points_per_cell: 2}}
boundary:
  - {{face: y_min, fix: [ux, uy{sideways}], name: base}}
  - {{face: {{axis: y, at: 0.03}}, move: {{ux: 0.001}}, name: top}}
  - {{face: {{axis: y, at: 0.03}}, move: {{ux: 0.002}}, stage: second, name: top_again}}
loads:
  - {{name: press, force: [0.0, {force}{depth}], at: {{layer: {{body: block, face: y_max}}}}, stage: second}}
  - {{name: weight, specific_weight: [0.0, -2.0e4{depth}]}}
stages: [{{name: first, steps: 2}}, {{name: second, steps: 2}}]
stabilisation: {{ghost: {{translation: 8.0e4, rotation: 2.0, scaling: stiffness}}}}
output:
  snapshots: {{every: 1}}
  history:
    - {{name: base_x, reaction: {{boundary: base, component: ux}}}}
    - {{name: base_y, reaction: {{boundary: base, component: uy}}}}
    - {{name: top_x, reaction: {{boundary: top, component: ux}}}}
    - {{name: moved, boundary_motion: {{boundary: top, component: ux}}}}
    - {{name: moved_again, boundary_motion: {{boundary: top_again, component: ux}}}}
    - {{name: pressed, load_factor: press}}
    - {{name: weighed, load_factor: weight}}
{history}"
    )
}

/// Names and places of the components of a field among those of the snapshot; the plane has two coordinates and one
/// rotation.
fn components(field: &str, space: bool) -> Vec<(String, usize)> {
    let axes = ["x", "y", "z"];
    match (field, space) {
        ("displacement" | "position", false) => (0..2).map(|k| (format!("_{}", axes[k]), k)).collect(),
        ("displacement" | "position" | "rotation", true) => (0..3).map(|k| (format!("_{}", axes[k]), k)).collect(),
        ("rotation", false) => vec![(String::new(), 2)],
        ("stress" | "couple_stress" | "wryness", _) => (0..9)
            .map(|k| (format!("_{}{}", axes[k / 3], axes[k % 3]), k))
            .collect(),
        _ => vec![(String::new(), 0)],
    }
}

/// A component of a field at all points of a snapshot.
fn values(snapshots: &Snapshots, field: &str, snapshot: usize, place: usize) -> Vec<f64> {
    let pick = |rows: Vec<[f64; 3]>| rows.into_iter().map(|row| row[place]).collect();
    match field {
        "position" => pick(snapshots.positions(snapshot)),
        "displacement" | "rotation" => pick(snapshots.field(field, snapshot)),
        "stress" | "couple_stress" | "wryness" => snapshots
            .field::<9>(field, snapshot)
            .into_iter()
            .map(|row| row[place])
            .collect(),
        _ => snapshots.scalar(field, snapshot),
    }
}

fn reductions(values: &[f64]) -> [(&'static str, f64); 3] {
    [
        ("max", values.iter().copied().fold(f64::NEG_INFINITY, f64::max)),
        ("min", values.iter().copied().fold(f64::INFINITY, f64::min)),
        ("mean", values.iter().sum::<f64>() / values.len() as f64),
    ]
}

/// Compares every column of a field of the points with the snapshots.
fn columns_agree_with_snapshots(run: &Run, space: bool) {
    let (history, snapshots) = (run.history(), Snapshots::read(&run.file("points.vtkhdf")));
    assert_eq!(history.rows.len(), snapshots.times.len());
    let start = snapshots.positions(0);
    let mut compared = 0;
    for (name, _, holds) in SELECTIONS {
        let chosen: Vec<usize> = (0..start.len()).filter(|&point| holds(&start[point])).collect();
        assert!(
            !chosen.is_empty() && (name == "everywhere" || chosen.len() < start.len()),
            "{name}"
        );
        for field in fields_at(name) {
            for (suffix, place) in components(field, space) {
                for row in 0..history.rows.len() {
                    let all = values(&snapshots, field, row, place);
                    let own: Vec<f64> = chosen.iter().map(|&point| all[point]).collect();
                    let largest = all.iter().fold(0.0f64, |largest, value| largest.max(value.abs()));
                    for (reduction, expected) in reductions(&own) {
                        let column = format!("{name}_{reduction}_{field}{suffix}");
                        let obtained = history.column(&column)[row];
                        let holds = (obtained - expected).abs() <= 1e-13 * largest;
                        assert!(holds, "{column}, row {row}: {obtained}, points {expected}");
                        compared += 1;
                    }
                }
            }
        }
    }
    let others = 7 + REDUCTIONS.len() * if space { 3 } else { 1 };
    assert_eq!(history.quantities().len(), others + compared / history.rows.len());
}

fn columns(space: bool, ranks: usize) {
    let run = Launch::text(&scene(space)).ranks(ranks).run().completed();
    columns_agree_with_snapshots(&run, space);
    let history = run.history();
    assert!(history.last("everywhere_max_chi") > 1e-3, "the block does not yield");
    assert_eq!(history.text("stage"), ["first", "first", "first", "second", "second"]);
    // Prescribed motions ramp over their stage and hold.
    assert_eq!(history.column("load_factor"), [0.0, 0.5, 1.0, 0.5, 1.0]);
    assert_eq!(history.column("moved"), [0.0, 0.0005, 0.001, 0.001, 0.001]);
    assert_eq!(history.column("moved_again"), [0.0, 0.0, 0.0, 0.001, 0.002]);
    assert_eq!(history.column("pressed"), [0.0, 0.0, 0.0, 0.5, 1.0]);
    assert_eq!(history.column("weighed"), [0.0, 0.5, 1.0, 1.0, 1.0]);
    // Reactions balance the loads: along x only each other, along y weight and force.
    let area = 0.02 * 0.03;
    for row in 1..5 {
        let value = |name: &str| history.column(name)[row];
        let down = thickness(space) * (2.0e4 * area * value("weighed") + FORCE * value("pressed"));
        assert!(
            (value("base_y") - down).abs() < 1e-7 * down,
            "row {row}: {} and {down}",
            value("base_y")
        );
        let sideways = value("base_x") + value("top_x");
        assert!(sideways.abs() < 1e-7 * value("base_x").abs(), "row {row}: {sideways}");
    }
    // Small rotations about one axis are what they are called, however they are measured.
    for reduction in ["max", "min", "mean"] {
        let twist = history.last(&format!("everywhere_{reduction}_twist_z"));
        let rotation = history.last(&format!(
            "everywhere_{reduction}_rotation{}",
            if space { "_z" } else { "" }
        ));
        assert!(
            (twist - rotation).abs() < 1e-3 * rotation.abs(),
            "{reduction}: {twist} and {rotation}"
        );
        assert!(twist.abs() > 1e-3);
    }
}

#[test]
fn in_the_plane() {
    columns(false, 1);
}

#[test]
fn in_space() {
    columns(true, 1);
}

#[test]
fn in_the_plane_on_three_ranks() {
    columns(false, 3);
}
