//! Curved cantilever.
//!
//! Source: Bathe and Bolourchi (1979); as a micropolar solid O'Hare et al. (2024), section 4.4; numbers of an
//! independent implementation (tests/reference/README.md).
//!
//! ```text
//!   x = 0, clamped      45 degrees of a ring of radius 100 m in the x-y plane, section 1 x 1 m
//!   #######-----___
//!           ---___ ---__        600 N along z, out of the plane, shared by the points of the end,
//!                 ---__ --_     in 15 steps
//!                      --_ --* F
//! ```
//!
//! Expected: the displacement of the end, of the order of the length of the beam, follows that of the reference at
//! every load within 1 % of its length with cells of 1 m, 2 % with cells of 2 m. The reference updates rotations once an
//! iteration and this program once a step, which in space is not the same: both are first-order accurate in the step,
//! and differ by 1e-7 here.
//!
//! For information, the paper's Table 3: (-22.00, 16.57, 48.10) m with cells of 2 m, (-23.52, 14.27, 52.08) m with 1 m.

use super::reference::{Reference, number, vector};
use crate::common::compare::Comparison;
use crate::common::launch::Launch;

fn agrees_with_reference(config: &str, share: f64, paper: [f64; 3]) {
    let history = Launch::config(config).run().completed().history();
    let reference = Reference::read(config);
    let tip = ["tip_x", "tip_y", "tip_z"].map(|name| history.column(name));
    let mut comparison = Comparison::new("displacement of the end");
    assert_eq!(history.rows.len(), 1 + reference.curve().len());
    for (row, point) in reference.curve().iter().enumerate() {
        let load_factor = history.column("load_factor")[row + 1];
        assert!((load_factor - number(point, "t")).abs() < 1e-12, "step {row}");
        let listed = vector(point, "u");
        let length = listed.iter().map(|u| u * u).sum::<f64>().sqrt();
        for (component, name) in ["x", "y", "z"].iter().enumerate() {
            let title = format!("u_{name} at load factor {load_factor:.3}");
            comparison.within(&title, tip[component][row + 1], listed[component], share * length);
        }
    }
    comparison.relative("root force", history.last("root_force"), -600.0, 1e-8);
    comparison.finish();
    println!(
        "{config}: end at {:.2?}; the paper {paper:?}",
        history.last_of(["tip_x", "tip_y", "tip_z"])
    );
}

#[test]
fn cells_of_two_metres_agree_with_the_reference() {
    agrees_with_reference("curved_cantilever_2m", 0.02, [-22.00, 16.57, 48.10]);
}

#[test]
fn cells_of_one_metre_agree_with_the_reference() {
    agrees_with_reference("curved_cantilever_1m", 0.01, [-23.52, 14.27, 52.08]);
}
