//! Motions prescribed on all nodes, over many steps: what points remember of them.
//!
//! Source: closed form. A step that moves every node by `A x` (`x` its place on the grid, which is new in every step)
//! and turns it by `w` leaves the points with `F = (I + A)^n`, `Q = exp(n w)` after `n` steps, whatever the basis.
//! Stress: `U = Q^T F`, `B = lambda tr(E) I + 2 mu sym E + 2 kappa skew E` with `E = U - I`, `sigma = Q B F^T / det F`.
//!
//! ```text
//!     o---o---o---o---o
//!     |   |   |   |   |      every node is prescribed; the body in the middle moves through the cells
//!     o---o---o---o---o
//!     |   | .:|:. |   |
//!     o---o---o---o---o
//!     |   | ':|:' |   |
//!     o---o---o---o---o
//! ```
//!
//! Expected: a rigid motion, `I + A = exp(w)`, makes no stress and no wryness, turns the points about the centre, and
//! counts full turns; any other makes the stress above, skew part included. All to 1e-9 or better.

use crate::common::compare::{Comparison, same_history};
use crate::common::launch::{Launch, Run};
use crate::common::scene::{extremes, moved_node, nodes};
use nalgebra::{Matrix3, Rotation3, Vector3};

const LAMBDA: f64 = 8.0e6;
const MU: f64 = 6.0e6;
const KAPPA: f64 = 2.0e6;
const EDGE: f64 = 0.01;
const TOLERANCE: f64 = 1e-9;
const SPACE: [&str; 6] = ["ux", "uy", "uz", "rx", "ry", "rz"];

/// Moves a small body about the centre of a grid of four cells an axis, in `steps` steps with the gradient `gradient` of
/// the displacement and the rotation vector `rotation` each.
fn drive(space: bool, basis: &str, steps: usize, gradient: &Matrix3<f64>, rotation: &Vector3<f64>) -> Run {
    let axes = if space { 3 } else { 2 };
    let components = if space { &[0, 1, 2, 3, 4, 5][..] } else { &[0, 1, 5] };
    let centre = 2.0 * EDGE;
    // The body stays in the cells about the centre, which do not see the nodes on the faces.
    let near = |node: &&Vec<f64>| node.iter().all(|x| (x - centre).abs() < 1.9 * EDGE);
    let order = match basis {
        "bspline2" => 2,
        "bspline3" => 3,
        _ => 1,
    };
    let entries: String = nodes(&vec![4; axes], EDGE, order)
        .iter()
        .filter(near)
        .map(|node| {
            let mut place = Vector3::zeros();
            for (place, x) in place.iter_mut().zip(node) {
                *place = x - centre;
            }
            let (moved, turned) = (gradient * place * steps as f64, rotation * steps as f64);
            let totals = [moved.x, moved.y, moved.z, turned.x, turned.y, turned.z];
            let prescribed = components
                .iter()
                .map(|&component| (SPACE[component], totals[component]));
            moved_node(node, EDGE, &prescribed.collect::<Vec<_>>())
        })
        .collect();
    let (zero, size) = (vec![0.0; axes], vec![4.0 * EDGE; axes]);
    let (corner, opposite) = (vec![1.5 * EDGE; axes], vec![2.5 * EDGE; axes]);
    Launch::text(&format!(
        "
model: {{kinematics: {}}}
grid: {{min: {zero:?}, max: {size:?}, cell_size: {EDGE}, basis: {basis}}}
materials:
  rubber: {{law: elastic, lame_lambda: {LAMBDA:?}, shear_modulus: {MU:?}, coupling_modulus: {KAPPA:?}, alpha: 5.0, beta: 40.0, gamma: 100.0}}
bodies:
  - {{name: cube, material: rubber, shape: {{box: {{min: {corner:?}, max: {opposite:?}}}}}, points_per_cell: 4}}
boundary:
{entries}
stages: [{{name: move, steps: {steps}}}]
output:
  history:
    - {{name: corner_start, mean: position, at: {{nearest: {corner:?}}}}}
    - {{name: corner, mean: displacement, at: {{nearest: {corner:?}}}}}
    - {{name: twist, mean: twist_z}}
{}",
        if space { "three_dimensional" } else { "plane_strain" },
        extremes(&["stress", "couple_stress", "wryness", "volume"])
    ))
    .run()
    .completed()
}

/// Adds a comparison of all components of a tensor field, at all points.
fn compare_tensor(comparison: &mut Comparison, run: &Run, field: &str, expected: &Matrix3<f64>, tolerance: f64) {
    let history = run.history();
    for bound in ["max", "min"] {
        for (row, name) in ["x", "y", "z"].iter().enumerate() {
            for (column, other) in ["x", "y", "z"].iter().enumerate() {
                let title = format!("{field}_{bound}_{name}{other}");
                comparison.within(&title, history.last(&title), expected[(row, column)], tolerance);
            }
        }
    }
}

/// Rotates the body by `steps` times a rotation vector.
fn rotate(space: bool, basis: &str, steps: usize, vector: Vector3<f64>) {
    let gradient = Rotation3::new(vector).matrix() - Matrix3::identity();
    let run = drive(space, basis, steps, &gradient, &vector);
    let history = run.history();
    let mut comparison = Comparison::new("rigid rotation");
    compare_tensor(&mut comparison, &run, "stress", &Matrix3::zeros(), TOLERANCE * MU);
    compare_tensor(
        &mut comparison,
        &run,
        "couple_stress",
        &Matrix3::zeros(),
        TOLERANCE * MU * EDGE,
    );
    compare_tensor(&mut comparison, &run, "wryness", &Matrix3::zeros(), TOLERANCE / EDGE);
    for bound in ["max", "min"] {
        let title = format!("volume_{bound}");
        comparison.relative(&title, history.last(&title), history.column(&title)[0], TOLERANCE);
    }
    // The corner turns about the centre of the grid.
    let start = |axis: &str| history.column(&format!("corner_start_{axis}"))[0] - 2.0 * EDGE;
    let place = Vector3::new(start("x"), start("y"), if space { start("z") } else { 0.0 });
    let moved = Rotation3::new(vector * steps as f64) * place - place;
    for (axis, expected) in ["x", "y", "z"].iter().zip(moved.iter()).take(if space { 3 } else { 2 }) {
        let title = format!("corner_{axis}");
        comparison.within(&title, history.last(&title), *expected, TOLERANCE * EDGE);
    }
    if vector.x == 0.0 && vector.y == 0.0 {
        comparison.relative("twist", history.last("twist"), vector.z * steps as f64, TOLERANCE);
    }
    comparison.finish();
}

/// Stretches, shears and turns the body.
fn deform(space: bool, basis: &str, steps: usize, gradient: Matrix3<f64>, vector: Vector3<f64>) {
    let run = drive(space, basis, steps, &gradient, &vector);
    let deformation = (0..steps).fold(Matrix3::identity(), |f, _| (Matrix3::identity() + gradient) * f);
    let rotation = Rotation3::new(vector * steps as f64);
    let strain = rotation.transpose() * deformation - Matrix3::identity();
    let (symmetric, skew) = (0.5 * (strain + strain.transpose()), 0.5 * (strain - strain.transpose()));
    let nominal = Matrix3::identity() * LAMBDA * strain.trace() + 2.0 * MU * symmetric + 2.0 * KAPPA * skew;
    let stress = rotation * nominal * deformation.transpose() / deformation.determinant();
    assert!(
        (stress - stress.transpose()).norm() > 0.05 * stress.norm(),
        "hardly any skew stress"
    );
    let mut comparison = Comparison::new("homogeneous motion");
    compare_tensor(&mut comparison, &run, "stress", &stress, TOLERANCE * stress.norm());
    compare_tensor(&mut comparison, &run, "wryness", &Matrix3::zeros(), TOLERANCE / EDGE);
    let history = run.history();
    for bound in ["max", "min"] {
        let title = format!("volume_{bound}");
        let expected = history.column(&title)[0] * deformation.determinant();
        comparison.relative(&title, history.last(&title), expected, TOLERANCE);
    }
    comparison.finish();
}

#[test]
fn rotation_past_a_full_turn_in_the_plane() {
    rotate(false, "gimp", 10, Vector3::new(0.0, 0.0, 0.7));
}

#[test]
fn rotation_past_a_full_turn_about_an_axis_of_space() {
    rotate(true, "linear", 10, Vector3::new(0.0, 0.0, -0.7));
}

#[test]
fn rotation_about_another_axis() {
    rotate(true, "gimp", 4, Vector3::new(0.6, 0.0, 0.0));
}

#[test]
fn rotation_past_a_full_turn_on_splines() {
    for basis in ["bspline1", "bspline2", "bspline3"] {
        rotate(false, basis, 10, Vector3::new(0.0, 0.0, 0.7));
    }
    rotate(true, "bspline2", 4, Vector3::new(0.6, 0.0, 0.0));
}

#[test]
fn stretch_shear_and_rotation_in_the_plane() {
    let gradient = Matrix3::new(0.04, 0.06, 0.0, -0.02, -0.05, 0.0, 0.0, 0.0, 0.0);
    for basis in ["linear", "bspline2", "bspline3"] {
        deform(false, basis, 4, gradient, Vector3::new(0.0, 0.0, 0.08));
    }
}

#[test]
fn stretch_shear_and_rotation_in_space() {
    let gradient = Matrix3::new(0.04, 0.06, 0.02, -0.02, -0.05, 0.03, 0.05, -0.01, 0.02);
    for basis in ["gimp", "bspline3"] {
        deform(true, basis, 4, gradient, Vector3::new(0.0, -0.15, 0.0));
    }
}

/// A block that is compressed on a grid that follows, its middle row of nodes held from sliding.
fn compress_on_a_moving_grid(middle: &str) -> Run {
    Launch::text(&format!(
        "
model: {{kinematics: plane_strain}}
grid: {{min: [0.0, 0.0], max: [0.02, 0.04], cell_size: {EDGE}, basis: linear, follow_face: y_max}}
materials:
  rubber: {{law: elastic, lame_lambda: {LAMBDA:?}, shear_modulus: {MU:?}, coupling_modulus: {KAPPA:?}, alpha: 5.0, beta: 40.0, gamma: 100.0}}
bodies:
  - {{name: block, material: rubber, shape: {{box: {{min: [0.0, 0.0], max: [0.01, 0.04]}}}}, points_per_cell: 2}}
boundary:
  - {{face: y_min, fix: [ux, uy]}}
  - {{face: y_max, fix: [ux], move: {{uy: -0.004}}}}
  - {{{middle}, fix: [ux], name: middle}}
  - {{face: x_min, fix: [ux]}}
stages: [{{name: compress, steps: 3}}]
output:
  history:
    - {{name: middle, reaction: {{boundary: middle, component: ux}}}}
    - {{name: stress, mean: stress}}
"
    ))
    .run()
    .completed()
}

#[test]
fn sets_of_nodes_are_those_of_the_start_on_a_moving_grid() {
    let shape = "face: all, within: {box: {min: [-1.0, 0.019], max: [1.0, 0.021]}}";
    let (shape, plane) = (
        compress_on_a_moving_grid(shape),
        compress_on_a_moving_grid("face: {axis: y, at: 0.02}"),
    );
    assert!(
        plane.history().last("middle").abs() > 1.0,
        "the row of nodes carries nothing"
    );
    same_history("by shape and by plane", &shape.history(), &plane.history(), 1e-10);
}
