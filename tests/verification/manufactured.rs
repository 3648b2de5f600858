//! Manufactured solution.
//!
//! Source: O'Hare (2025), section 3.5.1; numbers of an independent implementation (tests/reference/README.md).
//!
//! ```text
//!   #########
//!   #. .|. .#    unit cube, all components fixed on all faces, 2 x 2 x 2 Gauss points a cell, one step;
//!   #. .|. .#    u_i = theta_i = 1/30 sin(2 pi X) sin(2 pi Y) sin(2 pi Z)
//!   #---+---#
//!   #. .|. .#    body force and couple that this needs, per reference volume, by exact differentiation
//!   #. .|. .#
//!   #########
//! ```
//!
//! Expected: forces and couples as in the reference within 1e-6; errors of displacement, rotation, stress and couple-stress
//! within 0.5 % of it (its rotations are updated once an iteration, here once a step); rates from 8 to 16 cells of at least
//! 1.9, 1.7, 1.0 and 1.3; quadratic convergence of Newton's method to a force residual below 1e-9 and an energy below
//! 1e-16 J, both. In plane strain, from 32 to 64 cells, the
//! rates of theory: 2 for the fields, 1 for stresses, which are gradients.

use super::reference::{Reference, number, vector};
use crate::common::compare::Comparison;
use crate::common::launch::{Launch, Run};
use crate::common::results::Table;
use mpm_petsc::material::spec::ElasticModuli;
use mpm_petsc::verification::{Manufactured, Solution};
use nalgebra::Vector3;

/// Names in the summary and in the reference.
const NORMS: [(&str, &str); 4] = [
    ("error_u", "e_u"),
    ("error_theta", "e_theta"),
    ("error_sigma", "e_sigma"),
    ("error_mu", "e_mu"),
];

fn errors(run: &Run) -> [f64; 4] {
    NORMS.map(|(name, _)| run.summary().number(name))
}

/// Errors in plane strain on a square of `cells` by `cells`, with as many Gauss points a cell and axis.
pub fn errors_in_plane(basis: &str, cells: usize, points: usize) -> [f64; 4] {
    let run = Launch::text(&format!(
        "
model: {{kinematics: plane_strain}}
grid: {{min: [0.0, 0.0], max: [1.0, 1.0], cells: {cells}, basis: {basis}}}
materials:
  solid: {{law: elastic, lame_lambda: 15.0e9, shear_modulus: 10.0e9, coupling_modulus: 3.0e9, alpha: 10.0e6, beta: 30.0e6, gamma: 50.0e6}}
bodies:
  - {{name: square, material: solid, shape: {{box: {{min: [0.0, 0.0], max: [1.0, 1.0]}}}}, points_per_cell: {points}, placement: gauss}}
boundary:
  - {{face: x_min, fix: [ux, uy, rz]}}
  - {{face: x_max, fix: [ux, uy, rz]}}
  - {{face: y_min, fix: [ux, uy, rz]}}
  - {{face: y_max, fix: [ux, uy, rz]}}
verification: {{manufactured: {{}}}}
stages: [{{name: load, steps: 1}}]
solver: {{force_tolerance: 1.0e-12}}
"
    ))
    .run()
    .completed();
    errors(&run)
}

#[test]
fn body_forces_and_couples_agree_with_the_reference() {
    let moduli = ElasticModuli {
        lambda: 15.0e9,
        mu: 10.0e9,
        kappa: 10.0e9 / 3.0,
        alpha: 0.0,
        beta: 50.0,
        gamma: 50.0,
    };
    let amplitude = 1.0 / 30.0;
    let solution = Solution::new(&Manufactured { amplitude, moduli }, 3);
    let reference = Reference::read("manufactured");
    let samples = reference.list("forcing_samples");
    assert_eq!(samples.len(), 3);
    let mut comparison = Comparison::new("body force and couple");
    for sample in samples {
        let position = Vector3::from(vector(sample, "X"));
        let load = solution.load(&position);
        for (name, own, listed) in [
            ("force", load.force, vector(sample, "p0")),
            ("couple", load.couple, vector(sample, "q0")),
        ] {
            for axis in 0..3 {
                let title = format!("{name} {axis} at {:.2?}", vector(sample, "X"));
                comparison.relative(&title, own[axis], listed[axis], 1e-6);
            }
        }
    }
    comparison.finish();
}

/// Rates by halving the cells.
fn require_rates(coarse: &[f64; 4], fine: &[f64; 4], least: [f64; 4]) {
    for (place, ((name, _), least)) in NORMS.iter().zip(least).enumerate() {
        let rate = (coarse[place] / fine[place]).log2();
        println!("{name}: rate {rate:.3}, at least {least}");
        assert!(rate >= least, "{name} falls at a rate of {rate}");
    }
}

/// The last order of convergence above round-off, and where the iterations end.
fn require_quadratic(run: &Run) {
    const ROUND_OFF: f64 = 1e-14;
    let table = Table::read(&run.file("convergence.csv"));
    let residuals: Vec<f64> = table
        .column("force_residual")
        .into_iter()
        .filter(|residual| *residual > ROUND_OFF)
        .collect();
    let steps: Vec<f64> = residuals.windows(2).map(|pair| (pair[1] / pair[0]).ln()).collect();
    let orders: Vec<f64> = steps.windows(2).map(|pair| pair[1] / pair[0]).collect();
    println!("force residuals {residuals:?}, orders {orders:.2?}");
    assert!(*orders.last().expect("three iterations") > 1.9, "{orders:?}");
    assert!(table.last("force_residual") < 1e-9 && table.last("energy_residual") < 1e-16);
}

#[test]
fn errors_and_rates_in_space_agree_with_the_reference() {
    let reference = Reference::read("manufactured");
    let mut comparison = Comparison::new("errors of the manufactured solution");
    let mut found = Vec::new();
    for listed in reference.list("runs") {
        let cells = number(listed, "n");
        let run = Launch::config(&format!("manufactured_{cells}")).run().completed();
        let own = errors(&run);
        for (value, (name, key)) in own.iter().zip(NORMS) {
            let title = format!("{name}, {cells} cells");
            comparison.relative(&title, *value, number(listed, key), 5e-3);
        }
        // After the opening linear solve nothing depends on how rotations are updated.
        let opening = run.convergence().attempts[0].residuals[0];
        comparison.relative("opening residual", opening, number(&listed["newton"][0], "fbar"), 1e-9);
        require_quadratic(&run);
        found.push(own);
    }
    comparison.finish();
    assert_eq!(found.len(), 3);
    require_rates(&found[1], &found[2], [1.9, 1.7, 1.0, 1.3]);
}

#[test]
fn errors_do_not_depend_on_the_number_of_ranks() {
    let run = |ranks| errors(&Launch::config("manufactured_8").ranks(ranks).run().completed());
    let alone = run(1);
    for ranks in [2, 3] {
        let mut comparison = Comparison::new(&format!("{ranks} ranks and one"));
        let together = run(ranks);
        for (place, (name, _)) in NORMS.iter().enumerate() {
            comparison.relative(name, together[place], alone[place], 1e-9);
        }
        comparison.finish();
    }
}

#[test]
fn rates_in_plane_strain_are_those_of_the_shape_functions() {
    let [coarse, fine] = [32, 64].map(|cells| errors_in_plane("linear", cells, 2));
    println!("errors {coarse:?} and {fine:?}");
    require_rates(&coarse, &fine, [1.95, 1.95, 0.99, 0.99]);
}
