//! Finite elements: meshes that move with their body.
//!
//! Source: closed forms; for the curved cantilever O'Hare et al. (2024), section 4.4, table 2.
//!
//! ```text
//!            _o---o_                 a sector of a ring, its cells with straight edges
//!        _o--  o-o  --o_
//!      o-  _o-     -o_  -o           nodes of the rim are prescribed, those inside find their own way,
//!       \o-           -o/            or all are prescribed
//! ```
//!
//! Expected: the volumes of the points add up to that of the facets; a linear displacement of the rim makes the same
//! stress at every point (the patch test), also when it is reached in two steps; a rigid rotation makes none; the first
//! step on a box is that of the material point method with Gauss points on the same cells, to round-off; and the end of
//! the curved cantilever is where the paper has it, to the digits printed.

use crate::common::compare::{Comparison, same_history};
use crate::common::launch::{Launch, Run};
use crate::common::scene::extremes;
use nalgebra::{Matrix3, Rotation3, Vector3};

const LAMBDA: f64 = 8.0e6;
const MU: f64 = 6.0e6;
const KAPPA: f64 = 2.0e6;
const RADII: [f64; 2] = [1.0, 1.6];
const ANGLES: [f64; 2] = [10.0, 100.0];
const HEIGHT: f64 = 0.5;
/// Cells along each axis of the sector.
const CELLS: usize = 3;

/// Nodes of the sector, and whether they lie on its rim.
fn sector_nodes(space: bool) -> Vec<(Vector3<f64>, bool)> {
    let share = |index: usize| index as f64 / CELLS as f64;
    let mut nodes = Vec::new();
    for third in 0..if space { CELLS + 1 } else { 1 } {
        for second in 0..=CELLS {
            for first in 0..=CELLS {
                let angle = (ANGLES[0] + share(first) * (ANGLES[1] - ANGLES[0])).to_radians();
                let radius = RADII[0] + share(second) * (RADII[1] - RADII[0]);
                let position = Vector3::new(radius * angle.cos(), radius * angle.sin(), HEIGHT * share(third));
                let ends = |index: usize| index == 0 || index == CELLS;
                nodes.push((position, ends(first) || ends(second) || (space && ends(third))));
            }
        }
    }
    nodes
}

fn list(space: bool, vector: &Vector3<f64>) -> String {
    format!("{:?}", &vector.as_slice()[..if space { 3 } else { 2 }])
}

/// An entry of `boundary` for one node: its motion and its rotation about z.
fn node_entry(space: bool, position: &Vector3<f64>, motion: &Vector3<f64>, turn: f64, stage: &str) -> String {
    let place = list(space, position);
    let (out_of_plane, fixed) = if space {
        (format!(", uz: {:?}", motion.z), "rx, ry")
    } else {
        (String::new(), "")
    };
    format!(
        "  - {{face: all, within: {{ball: {{centre: {place}, radius: 0.01}}}}, fix: [{fixed}], stage: {stage}, \
         move: {{ux: {:?}, uy: {:?}, rz: {turn:?}{out_of_plane}}}}}\n",
        motion.x, motion.y
    )
}

fn drive_sector(space: bool, boundary: &str, stages: &str) -> Run {
    let (kinematics, along, zero) = if space {
        (
            "three_dimensional",
            format!(", axis: z, min: 0.0, max: {HEIGHT:?}"),
            "[0.0, 0.0, 0.0]",
        )
    } else {
        ("plane_strain", String::new(), "[0.0, 0.0]")
    };
    Launch::text(&format!(
        "
model: {{kinematics: {kinematics}, method: fem}}
materials:
  rubber: {{law: elastic, lame_lambda: {LAMBDA:?}, shear_modulus: {MU:?}, coupling_modulus: {KAPPA:?}, alpha: 5.0e4, beta: 4.0e5, gamma: 1.0e6}}
bodies:
  - name: sector
    material: rubber
    mesh:
      ring_sector: {{centre: {zero}, inner_radius: {:?}, outer_radius: {:?}, from_angle: {:?}, to_angle: {:?}{along}}}
      cells: {CELLS}
boundary:
{boundary}
stages: [{stages}]
solver: {{force_tolerance: 1.0e-12}}
output:
  history:
    - {{name: twist, mean: twist_z}}
    - {{name: volume_mean, mean: volume}}
{}",
        RADII[0],
        RADII[1],
        ANGLES[0],
        ANGLES[1],
        extremes(&["stress", "couple_stress"])
    ))
    .run()
    .completed()
}

/// The rim moves by `A X`, with `A` symmetric so that no point turns, in two steps.
fn patch(space: bool) {
    let mut gradient = Matrix3::new(0.12, 0.05, -0.04, 0.05, -0.08, 0.03, -0.04, 0.03, 0.10);
    if !space {
        gradient.row_mut(2).fill(0.0);
        gradient.column_mut(2).fill(0.0);
    }
    let rim = sector_nodes(space).into_iter().filter(|(_, on_rim)| *on_rim);
    let entries: String = rim
        .map(|(position, _)| node_entry(space, &position, &(gradient * position), 0.0, "stretch"))
        .collect();
    let run = drive_sector(space, &entries, "{name: stretch, steps: 2}");
    let stretch = Matrix3::identity() + gradient;
    let biot = Matrix3::identity() * (LAMBDA * gradient.trace()) + gradient * (2.0 * MU);
    let expected = biot * stretch.transpose() / stretch.determinant();
    let history = run.history();
    let mut comparison = Comparison::new("patch test");
    for (index, name) in ["xx", "xy", "xz", "yx", "yy", "yz", "zx", "zy", "zz"]
        .iter()
        .enumerate()
    {
        for end in ["max", "min"] {
            let obtained = history.last(&format!("stress_{end}_{name}"));
            comparison.within(name, obtained, expected[(index / 3, index % 3)], 1e-9 * MU);
            let couple_stress = history.last(&format!("couple_stress_{end}_{name}"));
            comparison.within("couple stress", couple_stress, 0.0, 1e-9 * MU);
        }
    }
    let spanned = ((ANGLES[1] - ANGLES[0]) / CELLS as f64).to_radians().sin() * CELLS as f64;
    let facets = 0.5 * (RADII[1].powi(2) - RADII[0].powi(2)) * spanned * if space { HEIGHT } else { 1.0 };
    let points = run.summary().count("points") as f64;
    let volumes = history.column("volume_mean");
    comparison.relative("initial volume", volumes[0] * points, facets, 1e-12);
    let stretched = facets * stretch.determinant();
    comparison.relative("final volume", volumes[2] * points, stretched, 1e-10);
    comparison.finish();
}

#[test]
fn patch_test_in_the_plane() {
    patch(false);
}

#[test]
fn patch_test_in_space() {
    patch(true);
}

/// All nodes turn by 0.9 rad about z, twice, through positions that the mesh has to follow.
fn rigid_rotation(space: bool) {
    const TURN: f64 = 0.9;
    let turned = |times: f64| Rotation3::new(Vector3::z() * (TURN * times));
    let mut entries = String::new();
    for (index, stage) in ["first", "second"].iter().enumerate() {
        let (before, after) = (turned(index as f64), turned(index as f64 + 1.0));
        for (position, _) in sector_nodes(space) {
            let motion = after * position - before * position;
            entries += &node_entry(space, &position, &motion, TURN, stage);
        }
    }
    let run = drive_sector(space, &entries, "{name: first, steps: 1}, {name: second, steps: 1}");
    let history = run.history();
    let mut comparison = Comparison::new("rigid rotation");
    for column in history.quantities().iter().filter(|name| name.contains("stress")) {
        comparison.within(column, history.last(column), 0.0, 1e-10 * MU);
    }
    comparison.within("twist", history.last("twist"), 2.0 * TURN, 1e-12);
    comparison.finish();
}

#[test]
fn a_rigid_rotation_makes_no_stress_in_the_plane() {
    rigid_rotation(false);
}

#[test]
fn a_rigid_rotation_makes_no_stress_in_space() {
    rigid_rotation(true);
}

/// One large step of a box, on a mesh or on a grid with the same cells.
fn one_step(space: bool, mesh: bool) -> Run {
    let (kinematics, size, far, force) = if space {
        (
            "three_dimensional",
            "[0.3, 0.2, 0.1]",
            "[0.0, 0.0, 0.0]",
            "[2.0e4, -6.0e4, 3.0e4]",
        )
    } else {
        ("plane_strain", "[0.3, 0.2]", "[0.0, 0.0]", "[2.0e5, -6.0e5]")
    };
    let (cells, push) = if space {
        ("[3, 2, 1]", "[1.0, 0.0, 0.0]")
    } else {
        ("[3, 2]", "[1.0, 0.0]")
    };
    let (method, grid, body) = if mesh {
        let body = format!("mesh: {{box: {{min: {far}, max: {size}}}, cells: {cells}}}");
        ("fem", String::new(), body)
    } else {
        let body = format!("shape: {{box: {{min: {far}, max: {size}}}}}, points_per_cell: 2, placement: gauss");
        let grid = format!("grid: {{min: {far}, max: {size}, cells: {cells}, basis: linear}}");
        ("mpm", grid, body)
    };
    Launch::text(&format!(
        "
model: {{kinematics: {kinematics}, method: {method}}}
{grid}
materials:
  rubber: {{law: elastic, lame_lambda: {LAMBDA:?}, shear_modulus: {MU:?}, coupling_modulus: {KAPPA:?}, alpha: 50.0, beta: 4.0e3, gamma: 1.0e4}}
bodies:
  - {{name: box, material: rubber, {body}}}
boundary:
  - {{face: x_min, fix: [ux, uy, rz], name: wall}}
  - {{face: y_max, within: {{box: {{min: [0.15, -1.0{third}], max: [0.25, 1.0{fourth}]}}}}, move: {{uy: -0.01}}, name: stamp}}
{hold}
loads:
  - {{name: end, force: {force}, at: {{layer: {{body: box, direction: {push}}}}}}}
stages: [{{name: bend, steps: 1}}]
solver: {{force_tolerance: 1.0e-12}}
output:
  history:
    - {{name: wall, reaction: {{boundary: wall, component: uy}}}}
    - {{name: wall_couple, reaction: {{boundary: wall, component: rz}}}}
    - {{name: stamp, reaction: {{boundary: stamp, component: uy}}}}
    - {{name: stress, mean: stress}}
    - {{name: largest, max: stress}}
    - {{name: turn, max: twist_z}}
    - {{name: end, mean: displacement, at: {{load: end}}}}
",
        third = if space { ", -1.0" } else { "" },
        fourth = if space { ", 1.0" } else { "" },
        hold = if space { "  - {face: x_min, fix: [uz, rx, ry]}" } else { "" },
    ))
    .run()
    .completed()
}

#[test]
fn one_step_is_that_of_material_points_on_the_same_cells() {
    for space in [false, true] {
        let (mesh, grid) = (one_step(space, true), one_step(space, false));
        assert!(
            mesh.history().last("end_y").abs() > 0.01,
            "the step is too small to tell"
        );
        same_history("one step on mesh and grid", &mesh.history(), &grid.history(), 1e-8);
        for key in ["points", "dofs", "nonzeros", "active_cells"] {
            assert_eq!(mesh.summary().count(key), grid.summary().count(key), "{key}");
        }
    }
}

/// The paper prints two decimals.
fn is_that_of_the_paper(config: &str, paper: [f64; 3]) {
    let history = Launch::config(config).run().completed().history();
    let mut comparison = Comparison::new("displacement of the end");
    for (name, paper) in ["tip_x", "tip_y", "tip_z"].iter().zip(paper) {
        comparison.within(name, history.last(name), paper, 0.006);
    }
    comparison.relative("root force", history.last("root_force"), -600.0, 1e-8);
    comparison.finish();
}

#[test]
fn the_curved_cantilever_on_64_cells_is_that_of_the_paper() {
    is_that_of_the_paper("fem_curved_cantilever_64", [-14.40, 8.52, 43.40]);
}

#[test]
fn the_curved_cantilever_on_128_cells_is_that_of_the_paper() {
    is_that_of_the_paper("fem_curved_cantilever_128", [-20.04, 11.64, 50.05]);
}
