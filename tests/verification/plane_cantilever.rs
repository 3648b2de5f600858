//! Plane cantilever.
//!
//! Source: O'Hare (2025), thesis, section 3.5.2 (a); numbers of an independent implementation (tests/reference/README.md).
//!
//! ```text
//!   x = 0: ux = rz = 0, uy = 0 at mid-depth
//!   #==========================+   10 x 1 m, cells of 0.5 m, 4 x 4 points a cell
//!                              |
//!                              v   50 kN per m of thickness in 50 steps
//! ```
//!
//! Expected: the end follows that of the reference at every load.

use super::reference::{Reference, number};
use crate::common::compare::Comparison;
use crate::common::launch::Launch;

/// Of the length of the displacement, and of the rotation.
const SHARE: f64 = 0.005;
/// Total force [N per m of thickness].
const FORCE: f64 = 50.0e3;

#[test]
fn the_end_follows_the_reference() {
    let history = Launch::config("plane_cantilever_a").run().completed().history();
    let reference = Reference::read("plane_cantilever_a");
    let [factors, x, y, rotations] = ["load_factor", "tip_x", "tip_y", "tip_rotation"].map(|name| history.column(name));
    assert_eq!(history.rows.len(), 1 + reference.curve().len());
    let mut comparison = Comparison::new("plane cantilever (a)");
    for (row, point) in (1..).zip(reference.curve()) {
        let load = number(point, "load");
        assert!((factors[row] * FORCE - load).abs() < 1e-6, "step {row}");
        let listed = [0, 1].map(|axis| point["tip_mean"][axis].as_f64().expect("a number"));
        let tolerance = SHARE * f64::hypot(listed[0], listed[1]);
        comparison.within(&format!("ux at {load}"), x[row], listed[0], tolerance);
        comparison.within(&format!("uy at {load}"), y[row], listed[1], tolerance);
        comparison.relative(&format!("rz at {load}"), rotations[row], number(point, "phi3"), SHARE);
    }
    comparison.finish();
}
