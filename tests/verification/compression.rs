//! Compression of a block between smooth plates: a patch test with free sides.
//!
//! Source: closed form. With `E = U - I`, `B = lambda tr(E) I + 2 mu E`, `tau = B U` and no rotation, stress-free sides
//! ask for `lambda tr(E) + 2 mu e_lateral = 0`.
//!
//! ```text
//!        | | | |   20 % in one step
//!        v v v v
//!       +---+---+
//!       |. .|. .|        linear basis, points at even positions of whole cells: constant stress is integrated exactly,
//!       |. .|. .|        and the state stays homogeneous to round-off
//!       +---+---+
//!       |. .|. .|
//!       |. .|. .|
//!       +---+---+
//!       o   o   o
//! ```
//!
//! Expected: the stress at every point, the widening of the block and the force on the plates, to 1e-9.

use crate::common::compare::Comparison;
use crate::common::launch::Launch;
use crate::common::scene::extremes;

const LAMBDA: f64 = 8.0e6;
const MU: f64 = 6.0e6;
const EDGE: f64 = 0.01;
/// Cells of the block along each axis; the last one is that of the compression.
const CELLS: [usize; 3] = [2, 1, 3];
const STRAIN: f64 = -0.2;
const TOLERANCE: f64 = 1e-9;

/// Compression along the last axis of a block of whole cells.
fn compress(space: bool, points_per_cell: usize) {
    let axes: &[usize] = if space { &[0, 1, 2] } else { &[0, 2] };
    let names = &["x", "y", "z"][..axes.len()];
    let (last, last_axis) = (axes.len() - 1, names[axes.len() - 1]);
    let size: Vec<f64> = axes.iter().map(|&axis| CELLS[axis] as f64 * EDGE).collect();
    // One more cell on the free sides, into which the block widens.
    let grid: Vec<f64> = size.iter().map(|size| size + EDGE).collect();
    let zero = vec![0.0; axes.len()];
    let rollers: String = names
        .iter()
        .map(|axis| format!("  - {{face: {axis}_min, fix: [u{axis}], name: {axis}_min}}\n"))
        .collect();
    let history = Launch::text(&format!(
        "
model: {{kinematics: {}}}
grid: {{min: {zero:?}, max: {grid:?}, cell_size: {EDGE}, basis: linear}}
materials:
  rubber: {{law: elastic, lame_lambda: {LAMBDA:?}, shear_modulus: {MU:?}, coupling_modulus: 1.0e6, alpha: 5.0, beta: 40.0, gamma: 100.0}}
bodies:
  - {{name: block, material: rubber, shape: {{box: {{min: {zero:?}, max: {size:?}}}}}, points_per_cell: {points_per_cell}}}
boundary:
{rollers}
  - {{face: {{axis: {last_axis}, at: {:?}}}, move: {{u{last_axis}: {:?}}}, name: plate}}
stages: [{{name: compress, steps: 1}}]
solver: {{force_tolerance: 1.0e-12}}
output:
  history:
    - {{name: plate, reaction: {{boundary: plate, component: u{last_axis}}}}}
    - {{name: base, reaction: {{boundary: {last_axis}_min, component: u{last_axis}}}}}
    - {{name: side, reaction: {{boundary: x_min, component: ux}}}}
{}",
        if space { "three_dimensional" } else { "plane_strain" },
        size[last],
        STRAIN * size[last],
        extremes(&["stress", "couple_stress", "volume", "pressure", "von_mises", "rotation"])
    ))
    .run()
    .completed()
    .history();

    let lateral = if space {
        -LAMBDA * STRAIN / (2.0 * (LAMBDA + MU))
    } else {
        -LAMBDA * STRAIN / (LAMBDA + 2.0 * MU)
    };
    let strain = if space {
        [lateral, lateral, STRAIN]
    } else {
        [lateral, STRAIN, 0.0]
    };
    let trace: f64 = strain.iter().sum();
    let volume_ratio: f64 = strain.iter().map(|strain| 1.0 + strain).product();
    let nominal = strain.map(|strain| LAMBDA * trace + 2.0 * MU * strain);
    let stress: [f64; 3] = std::array::from_fn(|k| nominal[k] * (1.0 + strain[k]) / volume_ratio);
    let pressure = stress.iter().sum::<f64>() / 3.0;
    let von_mises = (1.5 * stress.iter().map(|stress| (stress - pressure).powi(2)).sum::<f64>()).sqrt();
    let section: f64 = size[..last].iter().product();
    let force = nominal[last] * section;
    let point_volume = (EDGE / points_per_cell as f64).powi(axes.len() as i32);
    let scale = stress[last].abs();

    let mut comparison = Comparison::new("compression between smooth plates");
    comparison.relative("force on the plate", history.last("plate"), force, TOLERANCE);
    comparison.relative("force on the base", history.last("base"), -force, TOLERANCE);
    comparison.within("force on the side", history.last("side"), 0.0, TOLERANCE * force.abs());
    for bound in ["max", "min"] {
        for (row, name) in ["x", "y", "z"].iter().enumerate() {
            for (column, other) in ["x", "y", "z"].iter().enumerate() {
                let expected = if row == column { stress[row] } else { 0.0 };
                let title = format!("stress_{bound}_{name}{other}");
                comparison.within(&title, history.last(&title), expected, TOLERANCE * scale);
                let title = format!("couple_stress_{bound}_{name}{other}");
                comparison.within(&title, history.last(&title), 0.0, TOLERANCE * EDGE * scale);
            }
        }
        let last = |field: &str| history.last(&format!("{field}_{bound}"));
        comparison.relative("pressure", last("pressure"), pressure, TOLERANCE);
        comparison.relative("von Mises stress", last("von_mises"), von_mises, TOLERANCE);
        comparison.relative("volume", last("volume"), volume_ratio * point_volume, TOLERANCE);
    }
    comparison.finish();
}

#[test]
fn in_plane_strain() {
    compress(false, 2);
}

#[test]
fn in_plane_strain_with_three_points_a_cell_and_axis() {
    compress(false, 3);
}

#[test]
fn in_space() {
    compress(true, 2);
}
