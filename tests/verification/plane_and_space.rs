//! Plane strain is three-dimensional with the components out of the plane held.
//!
//! Source: the definition of plane strain. What could go wrong: the elastoplastic law in the plane is solved in the
//! components that plane strain moves alone, among them the elastic stretch across the plane and the couple stresses
//! m_13 and m_23, which are easily forgotten.
//!
//! ```text
//!         top: ux = 3 mm, uy = -1 mm
//!        +--+--+--+   y = 0.04 m
//!        |  |  |  |
//!        +--+--+--+           Drucker-Prager, GIMPM, ghost penalty, 2 x 2 (x 2) points a cell;
//!        |  |  |  |           in space one cell (5 mm) thick with uz = rx = ry = 0 on all nodes
//!        +--+--+--+   y = 0
//!         base: ux = uy = 0
//! ```
//!
//! In the classical continuum the same without rotations: there the plastic strain across the plane moves alone. With a
//! nonlocal damage field the same block of a soft sandstone, which is damaged as well.
//!
//! Expected: reactions per metre of thickness equal within 1e-7, equivalent plastic strains within 1e-6.

use crate::common::compare::Comparison;
use crate::common::launch::Launch;
use crate::common::results::Table;

const THICKNESS: f64 = 0.005;

#[derive(Clone, Copy, PartialEq)]
enum Body {
    Classical,
    Micropolar,
    Damaged,
}

/// Continuum, keys of the law, stiffness of the ghost penalty and columns of a body.
fn keys(body: Body) -> [&'static str; 4] {
    let columns = "    - {name: twist_min, min: twist_z}\n    - {name: couple_stress, max: couple_stress}";
    match body {
        Body::Classical => [
            "classical",
            "law: drucker_prager, density: 1.0, hardening_modulus: 1.0e5",
            "",
            "    - {name: stress, max: stress}",
        ],
        Body::Micropolar => [
            "micropolar",
            "law: drucker_prager, coupling_modulus: 1.0e6, bending_length: 3.0e-3, bounded_stiffness: true, \
             plastic_length: 4.0e-3, hardening_modulus: 1.0e5",
            ", rotation: 2.0",
            columns,
        ],
        // Stiff against torsion, so that the couple-stress is not symmetric.
        Body::Damaged => [
            "gradient_micropolar",
            "law: sandstone, coupling_ratio: 0.2, bending_length: 3.0e-3, torsion_length: 3.0e-3, polar_ratio: 1.2, \
             plastic_length: 4.0e-3, hardening_stress: 1.0e4, hardening_rate: 50.0, dilation_rate: 1.0, \
             damage_length: 5.0e-3, softening_modulus: 0.1",
            ", rotation: 2.0",
            "    - {name: twist_min, min: twist_z}\n    - {name: couple_stress, max: couple_stress}\n    \
             - {name: alpha, mean: alpha}\n    - {name: damage, max: damage}",
        ],
    }
}

fn run(space: bool, body: Body) -> Table {
    let (kinematics, min, max, cells) = if space {
        (
            "three_dimensional",
            "[0.0, 0.0, 0.0]",
            format!("[0.05, 0.05, {THICKNESS}]"),
            "[5, 5, 1]",
        )
    } else {
        ("plane_strain", "[0.0, 0.0]", "[0.05, 0.05]".to_owned(), "[5, 5]")
    };
    let (corner, opposite) = if space {
        ("[0.01, 0.0, 0.0]", format!("[0.04, 0.04, {THICKNESS}]"))
    } else {
        ("[0.01, 0.0]", "[0.04, 0.04]".to_owned())
    };
    let held = match (space, body) {
        (false, _) => "",
        (true, Body::Classical) => "  - {face: all, fix: [uz]}",
        (true, _) => "  - {face: all, fix: [uz, rx, ry]}",
    };
    let [continuum, law, ghost, columns] = keys(body);
    // The residual of the damage field does not fall as far.
    let tolerance = match body {
        Body::Damaged => "1.0e-11",
        _ => "1.0e-13",
    };
    let history = Launch::text(&format!(
        "
model: {{kinematics: {kinematics}, continuum: {continuum}}}
grid: {{min: {min}, max: {max}, cells: {cells}, basis: gimp}}
materials:
  sand: {{{law}, lame_lambda: 8.0e6, shear_modulus: 6.0e6, friction_angle: 25.0, dilatancy_angle: 8.0, cohesion: 50.0e3}}
bodies:
  - {{name: block, material: sand, shape: {{box: {{min: {corner}, max: {opposite}}}}}, points_per_cell: 2}}
boundary:
{held}
  - {{face: y_min, fix: [ux, uy], name: base}}
  - {{face: {{axis: y, at: 0.04}}, move: {{ux: 0.003, uy: -0.001}}, name: top}}
stages: [{{name: shear, steps: 10}}]
solver: {{force_tolerance: {tolerance}, return_map_tolerance: 1.0e-13, max_iterations: 25}}
stabilisation: {{ghost: {{translation: 8.0e4{ghost}, scaling: paper}}}}
output:
  history:
    - {{name: base_x, reaction: {{boundary: base, component: ux}}}}
    - {{name: base_y, reaction: {{boundary: base, component: uy}}}}
    - {{name: top_x, reaction: {{boundary: top, component: ux}}}}
    - {{name: top_y, reaction: {{boundary: top, component: uy}}}}
    - {{name: chi_max, max: chi}}
    - {{name: chi_mean, mean: chi}}
{columns}
"
    ))
    .run()
    .completed()
    .history();
    assert_eq!(history.rows.len(), 11, "no step is halved");
    history
}

#[test]
fn plane_strain_is_space_with_the_components_out_of_the_plane_held() {
    let (plane, space) = (run(false, Body::Micropolar), run(true, Body::Micropolar));
    let of_rotations = [
        "twist_min",
        "couple_stress_zx",
        "couple_stress_xz",
        "couple_stress_zy",
        "couple_stress_yz",
    ];
    agree(&plane, &space, &of_rotations);
    let across = plane.last("couple_stress_xz").abs();
    assert!(
        across > 1e-3 * plane.last("couple_stress_zx").abs(),
        "no couple stress across the plane: {across}"
    );
}

#[test]
fn the_same_holds_without_rotations() {
    let (plane, space) = (run(false, Body::Classical), run(true, Body::Classical));
    agree(&plane, &space, &["stress_xx", "stress_xy", "stress_yy", "stress_zz"]);
    assert!(plane.last("stress_zz").abs() > 1e3, "no stress across the plane");
}

#[test]
fn the_same_holds_with_a_nonlocal_damage_field() {
    let (plane, space) = (run(false, Body::Damaged), run(true, Body::Damaged));
    let columns = ["twist_min", "couple_stress_zx", "couple_stress_xz", "alpha", "damage"];
    agree(&plane, &space, &columns);
    assert!(plane.last("damage") > 0.05, "{}", plane.last("damage"));
    let across = plane.last("couple_stress_xz").abs();
    assert!(across > 1e-3 * plane.last("couple_stress_zx").abs(), "{across}");
}

/// Reactions, plastic strains and these columns.
fn agree(plane: &Table, space: &Table, columns: &[&str]) {
    let mut comparison = Comparison::new("plane strain, and space per metre of thickness");
    for (names, scale, share) in [
        (&["base_x", "base_y", "top_x", "top_y"][..], THICKNESS, 1e-7),
        (&["chi_max", "chi_mean"], 1.0, 1e-6),
        (columns, 1.0, 1e-6),
    ] {
        for name in names {
            let largest = plane
                .column(name)
                .into_iter()
                .fold(0.0f64, |largest, value| largest.max(value.abs()));
            for (row, (plane, space)) in plane.column(name).into_iter().zip(space.column(name)).enumerate() {
                comparison.within(&format!("{name}, step {row}"), space / scale, plane, share * largest);
            }
        }
    }
    comparison.finish();
    assert!(plane.last("chi_max") > 0.05, "the block hardly yields");
}
