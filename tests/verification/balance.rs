//! Forces and moments balance.
//!
//! Source: statics. The weak form holds for every rigid virtual velocity and spin, so that reactions and loads balance in
//! the deformed state: `sum R + f = 0`, `sum (X x R + C) + x x f + m = 0`, with forces `R` and couples `C` on the held
//! nodes at `X`, and a force `f` and couple `m` shared by points whose mean place is `x`. It holds for any grid and any
//! material, to the tolerance of the solver; a couple stress or a coupling term that is inconsistent shows here first.
//!
//! ```text
//!   #----+----+----+----o  f, m
//!   #    |    |    |    o          elastic beam in space, 4 x 1 x 1 cells, the 4 nodes of its root held in 6 components
//!   #----+----+----+----o
//! ```
//!
//! Expected: both sums vanish at every load, to 1e-8 of force and of force times length, while the beam bends and twists
//! by tens of degrees.

use crate::common::compare::Comparison;
use crate::common::launch::Launch;
use crate::common::scene::box_around;
use nalgebra::Vector3;
use std::fmt::Write;

const FORCE: [f64; 3] = [30.0, -40.0, 60.0];
const COUPLE: [f64; 3] = [5.0, 4.0, -8.0];
const COMPONENTS: [&str; 6] = ["ux", "uy", "uz", "rx", "ry", "rz"];
const LENGTH: f64 = 0.4;
const EDGE: f64 = 0.1;
/// Where the section of the beam lies in the grid, which must be wide enough for the bent beam.
const OFFSET: f64 = 0.3;

#[test]
fn reactions_balance_forces_and_couples_in_the_deformed_state() {
    let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]];
    let root = corners.map(|[y, z]| [0.0, OFFSET + y * EDGE, OFFSET + z * EDGE]);
    let (mut boundary, mut history) = (String::new(), String::new());
    for (number, node) in root.iter().enumerate() {
        let place = box_around(node, 0.1 * EDGE);
        let components = COMPONENTS.join(", ");
        writeln!(
            boundary,
            "  - {{face: x_min, within: {place}, fix: [{components}], name: root_{number}}}"
        )
        .unwrap();
        for component in COMPONENTS {
            let reaction = format!("{{boundary: root_{number}, component: {component}}}");
            writeln!(history, "    - {{name: {component}_{number}, reaction: {reaction}}}").unwrap();
        }
    }
    let far = OFFSET + EDGE;
    let history = Launch::text(&format!(
        "
model: {{kinematics: three_dimensional}}
grid: {{min: [0.0, 0.0, 0.0], max: [0.7, 0.7, 0.7], cell_size: {EDGE}, basis: linear}}
materials:
  rubber: {{law: elastic, lame_lambda: 1.0e5, shear_modulus: 1.0e5, coupling_modulus: 2.0e4, alpha: 10.0, beta: 40.0, gamma: 100.0}}
bodies:
  - {{name: beam, material: rubber, shape: {{box: {{min: [0.0, {OFFSET}, {OFFSET}], max: [{LENGTH}, {far}, {far}]}}}}, points_per_cell: 2}}
boundary:
{boundary}
loads:
  - {{name: force, force: {FORCE:?}, at: {{layer: {{body: beam, face: x_max}}}}}}
  - {{name: couple, couple: {COUPLE:?}, at: {{layer: {{body: beam, face: x_max}}}}}}
stages: [{{name: bend, steps: 5}}]
solver: {{force_tolerance: 1.0e-12}}
output:
  history:
    - {{name: tip, mean: position, at: {{load: force}}}}
    - {{name: turn, mean: rotation, at: {{load: force}}}}
{history}"
    ))
    .run()
    .completed()
    .history();

    let column = |name: String| history.column(&name);
    let mut comparison = Comparison::new("sums of forces and moments");
    for (row, factor) in column("load_factor".into()).into_iter().enumerate().skip(1) {
        let value = |name: String| column(name)[row];
        let vector = |names: [String; 3]| Vector3::from(names.map(value));
        let load = Vector3::from(FORCE) * factor;
        let tip = vector(["tip_x", "tip_y", "tip_z"].map(str::to_owned));
        let (mut force, mut moment) = (load, tip.cross(&load) + Vector3::from(COUPLE) * factor);
        for (number, node) in root.iter().enumerate() {
            let reaction = vector(["ux", "uy", "uz"].map(|component| format!("{component}_{number}")));
            let couple = vector(["rx", "ry", "rz"].map(|component| format!("{component}_{number}")));
            force += reaction;
            moment += Vector3::from(*node).cross(&reaction) + couple;
        }
        for (axis, name) in ["x", "y", "z"].iter().enumerate() {
            let title = format!("force {name} at {factor}");
            comparison.within(&title, force[axis], 0.0, 1e-8 * load.norm());
            let title = format!("moment about {name} at {factor}");
            comparison.within(&title, moment[axis], 0.0, 1e-8 * load.norm() * LENGTH);
        }
    }
    comparison.finish();
    let turned = Vector3::from(history.last_of(["turn_x", "turn_y", "turn_z"])).norm();
    assert!(turned > 0.3, "the beam hardly bends: {turned} rad");
}
