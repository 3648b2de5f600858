//! Scenes that are small enough for many runs.

use crate::common::launch::Launch;

/// The shear layer on 9 rows, in 20 steps.
pub fn shear_layer() -> Launch {
    Launch::config("shear_layer").set(&["stages.0.steps=20"])
}

/// The curved cantilever with cells of 2 m, up to a third of its load.
pub fn curved_cantilever() -> Launch {
    Launch::config("curved_cantilever_2m").set(&["stages.0.steps=5", "loads.0.force=[0.0, 0.0, 200.0]"])
}

/// A classical block that collapses under its weight, with points that change cells all the time.
pub fn collapsing_block() -> Launch {
    Launch::config("elastoplastic_collapse").set(&["solver.force_tolerance=1e-12"])
}

/// A column of soil beyond the largest weight that it carries.
pub fn softening_column() -> Launch {
    Launch::config("column_collapse_path").set(&[
        "stages.0.control.arc_length.length=1.0e-2",
        "stages.0.control.arc_length.max_steps=14",
        "solver.force_tolerance=1e-11",
        "solver.energy_tolerance=null",
    ])
}

/// A block in space that is compressed and sheared until it yields: GIMPM and ghost penalty, 3 x 3 x 4 cells.
pub fn block() -> Launch {
    Launch::text(
        "
model: {kinematics: three_dimensional}
grid: {min: [0.0, 0.0, 0.0], max: [0.05, 0.05, 0.05], cells: [5, 5, 5], basis: gimp}
materials:
  sand:
    law: drucker_prager
    lame_lambda: 8.0e6
    shear_modulus: 6.0e6
    coupling_modulus: 1.0e6
    bending_length: 3.0e-3
    bounded_stiffness: true
    friction_angle: 25.0
    dilatancy_angle: 8.0
    cohesion: 50.0e3
    hardening_modulus: 1.0e5
    plastic_length: 4.0e-3
bodies:
  - name: block
    material: sand
    shape: {box: {min: [0.01, 0.01, 0.0], max: [0.04, 0.04, 0.04]}}
    points_per_cell: 2
boundary:
  - {face: z_min, fix: [ux, uy, uz, ry], name: base}
  - {face: {axis: z, at: 0.04}, move: {ux: 0.002, uy: 0.001, uz: -0.001}, name: top}
stages: [{name: shear, steps: 4}]
solver: {force_tolerance: 1.0e-11}
stabilisation: {ghost: {translation: 8.0e4, rotation: 2.0, scaling: paper}}
output:
  history:
    - {name: base, reaction: {boundary: base, component: ux}}
    - {name: top, reaction: {boundary: top, component: uz}}
    - {name: base_couple, reaction: {boundary: base, component: ry}}
    - {name: chi_max, max: chi}
    - {name: chi_mean, mean: chi}
    - {name: stress, mean: stress}
    - {name: rotation, max: rotation}
    - {name: corner, mean: displacement, at: {nearest: [0.04, 0.04, 0.04]}}
",
    )
}

/// The same block on splines of order 2, on a grid that ends at its top.
pub fn block_on_splines() -> Launch {
    block().set(&[
        "grid.basis=bspline2",
        "grid.max=[0.05, 0.05, 0.04]",
        "grid.cells=[5, 5, 4]",
        "boundary.1.face=z_max",
        "stages.0.steps=2",
    ])
}

/// A block under a weight with a part along the grid, whose base slides by six cells in steps of half a cell.
pub fn sliding_block() -> Launch {
    Launch::text(
        "
model: {kinematics: plane_strain}
grid: {min: [0.0, 0.0], max: [0.15, 0.03], cell_size: 0.01, basis: gimp}
materials:
  soil: {law: elastic, lame_lambda: 8.0e5, shear_modulus: 6.0e5, coupling_modulus: 1.0e5, bending_length: 3.0e-3, bounded_stiffness: true}
bodies:
  - {name: block, material: soil, shape: {box: {min: [0.01, 0.0], max: [0.07, 0.02]}}, points_per_cell: 2}
boundary:
  - {face: y_min, fix: [uy], move: {ux: 0.06}, name: floor}
loads:
  - {specific_weight: [200.0e3, -400.0e3]}
stages: [{name: slide, steps: 12}]
solver: {force_tolerance: 1.0e-11}
output:
  snapshots: {every: 1}
  history:
    - {name: floor_x, reaction: {boundary: floor, component: ux}}
    - {name: floor_y, reaction: {boundary: floor, component: uy}}
    - {name: place, mean: position}
    - {name: front, max: position}
    - {name: stress, mean: stress}
    - {name: turn, max: rotation}
",
    )
}

/// The sliding block on splines of order 3 over three cells, its edges held by a ghost penalty.
pub fn sliding_block_on_splines() -> Launch {
    sliding_block().set(&[
        "grid.basis=bspline3",
        "boundary.0.move.ux=0.03",
        "stages.0.steps=6",
        "stabilisation={ghost: {translation: 8.0e2, rotation: 0.02, scaling: stiffness}}",
    ])
}

/// Points in one single cell.
pub fn one_cell() -> Launch {
    Launch::text(
        "
model: {kinematics: plane_strain}
grid: {min: [0.0, 0.0], max: [0.03, 0.03], cell_size: 0.01, basis: linear}
materials:
  rubber: {law: elastic, lame_lambda: 8.0e6, shear_modulus: 6.0e6, coupling_modulus: 1.0e6, alpha: 5.0, beta: 40.0, gamma: 100.0}
bodies:
  - {name: block, material: rubber, shape: {box: {min: [0.01, 0.01], max: [0.02, 0.02]}}, points_per_cell: 2}
boundary:
  - {face: {axis: y, at: 0.01}, fix: [ux, uy], name: base}
  - {face: {axis: y, at: 0.02}, move: {ux: 0.002}, name: top}
stages: [{name: shear, steps: 2}]
output:
  history:
    - {name: base, reaction: {boundary: base, component: ux}}
    - {name: stress, max: stress}
",
    )
}

/// The curved cantilever by finite elements on 12 x 2 x 2 cells, up to a third of its load.
pub fn elements() -> Launch {
    Launch::config("fem_curved_cantilever_64").set(&[
        "bodies.0.mesh.cells=[12, 2, 2]",
        "stages.0.steps=5",
        "loads.0.force=[0.0, 0.0, 200.0]",
    ])
}

/// Sandstone on cells of 4 mm, into plastic flow: damage field, platen and pressure on B-splines of order 2.
pub fn sandstone() -> Launch {
    Launch::config("gosford_plane_strain").set(&[
        "grid.cells=[15, 20]",
        "boundary.2.move.uy=-0.6e-3",
        "stages.1.steps=6",
        "stages.1.adaptive.max_step=0.16666667",
        "solver.force_tolerance=1e-11",
    ])
}
