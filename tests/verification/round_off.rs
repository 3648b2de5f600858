//! Stiff bodies under small loads: stresses that are round-off beside the modulus.
//!
//! Source: closed form. A block of height H and width B under a specific weight w stands between smooth walls, so that it is in
//! uniaxial strain: its base bears `w B H` (times its depth in space), its top sinks by `w H^2 / (2 M)` with
//! `M = E (1 - nu) / ((1 + nu)(1 - 2 nu))`. Taken off, the weight leaves nothing. Micro-rotations stay zero.
//!
//! ```text
//!    | +---+ |   w
//!    | |   | |   |
//!    | |   | |   v
//!    | +---+ |
//!     /////////
//! ```
//!
//! A law sees a deformation next to one: a stress is exact to about 2e-16 M, however small it is. With modulus over stress
//! from 1e2 to 1e12, default tolerances must do, in the steps that are asked for; what round-off leaves of the digits is
//! `2e-16 M / stress` (ten times that is allowed for), what finite strain and the row of points below the top change is of
//! the order of the strain and of a cell.

use crate::common::launch::Launch;
use crate::common::results::Table;

const YOUNG: f64 = 210.0e9;
const POISSON: f64 = 0.3;
const HEIGHT: f64 = 1.0;

#[derive(Clone, Copy)]
struct Case {
    space: bool,
    rotations: bool,
    /// Modulus over the stress at the base.
    ratio: f64,
    /// Modulus of the lower over that of the upper half.
    contrast: f64,
    basis: &'static str,
}

const PLAIN: Case = Case {
    space: false,
    rotations: false,
    ratio: 1.0e8,
    contrast: 1.0,
    basis: "gimp",
};

impl Case {
    fn weight(&self) -> f64 {
        YOUNG / self.contrast / self.ratio / HEIGHT
    }

    fn vector(&self, x: f64, y: f64, z: f64) -> String {
        if self.space {
            format!("[{x:?}, {y:?}, {z:?}]")
        } else {
            format!("[{x:?}, {y:?}]")
        }
    }

    fn material(&self, name: &str, young: f64) -> String {
        let rotations = if self.rotations {
            ", coupling_number: 0.5, bending_length: 0.05, bounded_stiffness: true"
        } else {
            ""
        };
        format!("  {name}: {{law: elastic, youngs_modulus: {young:?}, poisson_ratio: {POISSON}{rotations}}}\n")
    }

    fn body(&self, name: &str, from: f64, to: f64) -> String {
        let (min, max) = (self.vector(0.0, from, 0.0), self.vector(0.5, to, 0.5));
        format!(
            "  - {{name: {name}, material: {name}, points_per_cell: 2, shape: {{box: {{min: {min}, max: {max}}}}}}}\n"
        )
    }

    /// Weight is put on in two steps and taken off in two more.
    fn run(&self, options: &str) -> Table {
        let walls: String = ["x", "z"][..1 + usize::from(self.space)]
            .iter()
            .map(|axis| format!("  - {{face: {axis}_min, fix: [u{axis}]}}\n  - {{face: {axis}_max, fix: [u{axis}]}}\n"))
            .collect();
        let upper = YOUNG / self.contrast;
        let kinematics = if self.space {
            "three_dimensional"
        } else {
            "plane_strain"
        };
        let continuum = if self.rotations { "micropolar" } else { "classical" };
        let (zero, end) = (self.vector(0.0, 0.0, 0.0), self.vector(0.5, 1.5 * HEIGHT, 0.5));
        let (down, up) = (
            self.vector(0.0, -self.weight(), 0.0),
            self.vector(0.0, self.weight(), 0.0),
        );
        let (materials, lower_body) = (
            self.material("lower", YOUNG) + &self.material("upper", upper),
            self.body("lower", 0.0, 0.5 * HEIGHT),
        );
        let bodies = lower_body + &self.body("upper", 0.5 * HEIGHT, HEIGHT);
        Launch::text(&format!(
            "
model: {{kinematics: {kinematics}, continuum: {continuum}}}
grid: {{min: {zero}, max: {end}, cell_size: 0.125, basis: {}}}
materials:
{materials}bodies:
{bodies}boundary:
{walls}  - {{face: y_min, fix: [uy], name: base}}
loads:
  - {{specific_weight: {down}, stage: on}}
  - {{specific_weight: {up}, stage: off}}
stages: [{{name: on, steps: 2, max_halvings: 0}}, {{name: off, steps: 2, max_halvings: 0}}]
solver: {{{options}}}
output:
  history:
    - {{name: base, reaction: {{boundary: base, component: uy}}}}
    - {{name: top, mean: displacement, at: {{layer: {{body: upper, face: y_max}}}}}}
",
            self.basis
        ))
        .run()
        .completed()
        .history()
    }

    fn check(&self) {
        let history = self.run("");
        let [base, top] = ["base", "top_y"].map(|name| history.column(name));
        assert_eq!(base.len(), 5, "steps as asked for");
        let force = self.weight() * HEIGHT * 0.5 * if self.space { 0.5 } else { 1.0 };
        // The stiffer half has the larger round-off.
        let noise = 10.0 * f64::EPSILON * self.ratio * self.contrast;
        let strain = 1.0 / self.ratio;
        assert!(
            (base[2] / force - 1.0).abs() < 1e-9 + noise,
            "{} bears {}",
            force,
            base[2]
        );
        assert!((base[4] / force).abs() < 1e-9 + noise, "{} is left of {force}", base[4]);
        let modulus = YOUNG * (1.0 - POISSON) / ((1.0 + POISSON) * (1.0 - 2.0 * POISSON));
        // Under the upper half the lower one bears its own and the other's weight.
        let share = 0.25 * self.contrast + 0.75;
        let sinking = -self.weight() * HEIGHT * HEIGHT / (2.0 * modulus) * share;
        // The uppermost points are a quarter of a cell h = 1/8 below the top, and hats are straight over a cell: h^2/4, of
        // the height of what sinks; points integrate about as well.
        let sinks = if self.contrast > 1.0 { 0.5 * HEIGHT } else { HEIGHT };
        let grid = 1.25 * 0.25 * (0.125 / sinks).powi(2);
        assert!(
            (top[2] / sinking - 1.0).abs() < grid + 2.0 * strain + noise,
            "{} instead of {sinking}",
            top[2]
        );
        self.check_tighter(&history);
    }

    /// A tolerance that only round-off can meet gives the same digits.
    fn check_tighter(&self, loose: &Table) {
        let tight = self.run("force_tolerance: 1.0e-13");
        for name in ["base", "top_y"] {
            let (a, b) = (loose.column(name), tight.column(name));
            let largest = a.iter().fold(0.0f64, |most, x| most.max(x.abs()));
            let change = a.iter().zip(&b).fold(0.0f64, |most, (a, b)| most.max((a - b).abs()));
            let noise = 10.0 * f64::EPSILON * self.ratio * self.contrast;
            assert!(
                change / largest < 1e-9 + noise,
                "{name} changes by {:e}",
                change / largest
            );
        }
    }
}

#[test]
fn modulus_over_stress_from_a_hundred_to_a_million_millions() {
    for ratio in [1.0e2, 1.0e5, 1.0e8, 1.0e10, 1.0e12] {
        Case { ratio, ..PLAIN }.check();
    }
}

#[test]
fn both_continua_in_the_plane_and_in_space() {
    for (space, rotations) in [(false, true), (true, false), (true, true)] {
        for ratio in [1.0e5, 1.0e10] {
            Case {
                space,
                rotations,
                ratio,
                ..PLAIN
            }
            .check();
        }
    }
}

#[test]
fn all_bases() {
    for basis in ["linear", "bspline1", "bspline2", "bspline3"] {
        Case { basis, ..PLAIN }.check();
    }
}

#[test]
fn a_contrast_of_a_million() {
    for rotations in [false, true] {
        Case {
            contrast: 1.0e6,
            ratio: 1.0e4,
            rotations,
            ..PLAIN
        }
        .check();
    }
}

/// A body that travels as a whole has the round-off of its increments, one edge of a cell after the other.
#[test]
fn a_long_way_without_load() {
    let history = Launch::text(
        "
model: {kinematics: plane_strain, continuum: micropolar}
grid: {min: [0.0, 0.0], max: [40.0, 0.5], cell_size: 0.125, basis: gimp}
materials:
  steel: {law: elastic, youngs_modulus: 210.0e9, poisson_ratio: 0.3, coupling_number: 0.5, bending_length: 0.05, bounded_stiffness: true}
bodies: [{name: block, material: steel, points_per_cell: 2, shape: {box: {min: [0.0, 0.0], max: [0.5, 0.5]}}}]
boundary:
  - {selection: {layer: {body: block, face: x_max}}, fix: [uy], move: {ux: 39.0}, penalty: 1.0e12, name: grip}
stages: [{name: travel, steps: 3, max_halvings: 0}]
output:
  history:
    - {name: grip, reaction: {boundary: grip, component: ux}}
    - {name: way, mean: displacement}
    - {name: mises, max: von_mises}
",
    )
    .run()
    .completed()
    .history();
    assert!((history.last("way_x") / 39.0 - 1.0).abs() < 1e-9);
    // Increments of 13 m over cells of 0.125 m, times the precision and the modulus.
    let noise = 13.0 / 0.125 * f64::EPSILON * 4.0e11;
    assert!(
        history.last("mises") < 20.0 * noise,
        "{:e} over {noise:e}",
        history.last("mises")
    );
}
