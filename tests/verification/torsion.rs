//! Torsion of a shaft.
//!
//! Source: O'Hare (2025), thesis, section 3.5.3, with a moment that turns the end as far as its figures show; numbers of
//! an independent implementation (tests/reference/README.md).
//!
//! ```text
//!   x = 0, fixed
//!   #==========================+ )    5 x 1 x 1 m, cells of 0.25 m, 2 x 2 x 2 points a cell, standard MPM
//!   #==========================+  )   couple of 40 MN m about x in 50 steps, shared by the 64 points of the end
//! ```
//!
//! Expected: angle and extension of the end follow those of the reference past two full turns.

use super::reference::{Reference, number};
use crate::common::compare::Comparison;
use crate::common::launch::Launch;
use std::f64::consts::TAU;

/// Total moment [N m].
const MOMENT: f64 = 40.0e6;

#[test]
fn angle_and_extension_follow_the_reference_past_two_turns() {
    let history = Launch::config("torsion_shaft").run().completed().history();
    let reference = Reference::read("torsion");
    let [factors, twist, extension] = ["load_factor", "twist", "tip_x"].map(|name| history.column(name));
    assert_eq!(history.rows.len(), 1 + reference.curve().len());
    let mut comparison = Comparison::new("torsion of a shaft");
    for (row, point) in (1..).zip(reference.curve()) {
        let moment = number(point, "moment");
        assert!((factors[row] * MOMENT - moment).abs() < 1e-3, "step {row}");
        let listed = number(point, "twist_tip_mean");
        comparison.relative(&format!("angle at {moment:.2e}"), twist[row], listed, 0.01);
        let listed = number(point, "extension");
        comparison.relative(&format!("extension at {moment:.2e}"), extension[row], listed, 0.02);
    }
    comparison.finish();
    assert!(twist[twist.len() - 1] > 2.0 * TAU, "{}", twist[twist.len() - 1]);
}
