//! Pieces of scenes as YAML text.

use std::fmt::Write;

/// A block of 2 x 2 elastic cells that is sheared: a run of a moment.
pub const BLOCK: &str = "
title: Sheared block
model: {kinematics: plane_strain}
grid: {min: [0.0, 0.0], max: [0.03, 0.02], cell_size: 0.01, basis: linear}
materials:
  rubber: {law: elastic, lame_lambda: 8.0e6, shear_modulus: 6.0e6, coupling_modulus: 1.0e6, alpha: 5.0, beta: 40.0, gamma: 100.0}
bodies:
  - {name: block, material: rubber, shape: {box: {min: [0.0, 0.0], max: [0.02, 0.02]}}, points_per_cell: 2}
boundary:
  - {face: y_min, fix: [ux, uy], name: base}
  - {face: y_max, fix: [uy], move: {ux: 0.002}, name: top}
stages: [{name: shear, steps: 2, max_halvings: 0}]
output:
  history:
    - {name: shift, boundary_motion: {boundary: top, component: ux}}
    - {name: base, reaction: {boundary: base, component: ux}}
";

/// Nodes of a grid from the origin with cubic cells, as positions; two coordinates or three. Those of splines of a higher
/// order are at their Greville points.
pub fn nodes(cells: &[usize], edge: f64, order: usize) -> Vec<Vec<f64>> {
    let count: usize = cells.iter().map(|cells| cells + order).product();
    let position = |mut flat: usize| {
        let along = |&cells: &usize| {
            let index = flat % (cells + order);
            flat /= cells + order;
            // The mean of the knots between the ends of the function; the knots at both ends of the grid are repeated.
            let inner: Vec<f64> = (index + 1..=index + order)
                .map(|knot| (knot as f64 - order as f64).clamp(0.0, cells as f64))
                .collect();
            inner.iter().sum::<f64>() / order as f64 * edge
        };
        cells.iter().map(along).collect()
    };
    (0..count).map(position).collect()
}

/// An entry of `boundary` that moves components of one node by these totals; those with a total of zero are fixed.
pub fn moved_node(position: &[f64], edge: f64, totals: &[(&str, f64)]) -> String {
    let zero = |total: &&(&str, f64)| total.1 == 0.0;
    let fix: Vec<&str> = totals.iter().filter(zero).map(|(component, _)| *component).collect();
    let moves: Vec<String> = totals
        .iter()
        .filter(|total| !zero(total))
        .map(|(component, total)| format!("{component}: {total:?}"))
        .collect();
    let (place, fix, moves) = (box_around(position, 0.1 * edge), fix.join(", "), moves.join(", "));
    format!("  - {{face: all, within: {place}, fix: [{fix}], move: {{{moves}}}}}\n")
}

/// A box about a position, as a shape.
pub fn box_around(position: &[f64], half: f64) -> String {
    let shifted = |shift: f64| position.iter().map(|x| x + shift).collect::<Vec<f64>>();
    format!("{{box: {{min: {:?}, max: {:?}}}}}", shifted(-half), shifted(half))
}

/// Entries of `output.history`: largest and smallest value of fields over all points, `NAME_max` and `NAME_min`.
pub fn extremes(fields: &[&str]) -> String {
    fields.iter().fold(String::new(), |mut text, field| {
        for reduction in ["max", "min"] {
            writeln!(text, "    - {{name: {field}_{reduction}, {reduction}: {field}}}").expect("text grows");
        }
        text
    })
}
