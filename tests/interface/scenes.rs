//! Scenes of a second.

/// A block of elastic cells, 2 x 2, sheared in two steps.
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
stages: [{name: shear, steps: 2}]
output:
  history:
    - {name: base, reaction: {boundary: base, component: ux}}
    - {name: stress, max: von_mises}
";

/// A load that grows in stages: for each stage its number of steps and its share of the whole load.
pub type Growth = [(usize, f64)];

/// Entries of `loads`, one a stage, and the list of stages. `load` makes the entry of a share of the load.
fn grow(growth: &Growth, max_halvings: usize, load: impl Fn(f64) -> String) -> (String, String) {
    let (mut loads, mut stages) = (String::new(), String::from("stages:\n"));
    for (number, &(steps, share)) in growth.iter().enumerate() {
        loads += &format!("  - {{stage: stage_{number}, {}}}\n", load(share));
        stages += &format!("  - {{name: stage_{number}, steps: {steps}, max_halvings: {max_halvings}}}\n");
    }
    (loads, stages)
}

/// A bar of perfectly plastic steel that is pulled by a force of 6 MN/m; it can carry a little more than 4.8.
pub fn bar(growth: &Growth, max_halvings: usize) -> String {
    let (loads, stages) = grow(growth, max_halvings, |share| {
        format!(
            "force: [{:?}, 0.0], at: {{layer: {{body: bar, face: x_max}}}}",
            6.0e6 * share
        )
    });
    format!(
        "
title: Bar pulled beyond its strength
model: {{kinematics: plane_strain}}
grid: {{min: [0.0, 0.0], max: [0.08, 0.01], cell_size: 0.01, basis: linear}}
materials:
  steel:
    law: von_mises
    youngs_modulus: 200.0e9
    poisson_ratio: 0.3
    coupling_modulus: 20.0e9
    bending_length: 1.0e-3
    bounded_stiffness: true
    yield_strength: 400.0e6
    hardening_modulus: 0.0
    plastic_length: 1.0e-3
bodies:
  - {{name: bar, material: steel, shape: {{box: {{min: [0.0, 0.0], max: [0.04, 0.01]}}}}, points_per_cell: 2}}
boundary:
  - {{face: x_min, fix: [ux], name: root}}
  - {{face: y_min, fix: [uy]}}
loads:
{loads}{stages}
output:
  snapshots: {{every: 2}}
  history:
    - {{name: root, reaction: {{boundary: root, component: ux}}}}
    - {{name: chi, max: chi}}
    - {{name: tip, mean: displacement, at: {{layer: {{body: bar, face: x_max}}}}}}
"
    )
}

/// A column of soil that yields under its weight. On the way one step is too large and is halved.
pub fn column(growth: &Growth, max_halvings: usize) -> String {
    let (loads, stages) = grow(growth, max_halvings, |share| {
        format!("specific_weight: [0.0, {:?}]", -30.0e3 * share)
    });
    format!(
        "
title: Overloaded column
model: {{kinematics: plane_strain}}
grid: {{min: [0.0, 0.0], max: [6.0, 4.0], cell_size: 0.5, basis: linear}}
materials:
  soil:
    law: drucker_prager
    youngs_modulus: 1.0e6
    poisson_ratio: 0.3
    coupling_modulus: 1.0e5
    bending_length: 0.1
    bounded_stiffness: true
    friction_angle: 10.0
    dilatancy_angle: 0.0
    cohesion: 5.0e3
    plastic_length: 0.1
bodies:
  - {{name: column, material: soil, shape: {{box: {{min: [0.0, 0.0], max: [1.0, 3.0]}}}}, points_per_cell: 2}}
boundary:
  - {{face: x_min, fix: [ux]}}
  - {{face: y_min, fix: [ux, uy], name: base}}
loads:
{loads}{stages}
output:
  snapshots: {{every: 2}}
  history:
    - {{name: base, reaction: {{boundary: base, component: uy}}}}
    - {{name: chi, max: chi}}
    - {{name: top, min: displacement}}
"
    )
}
