//! Shapes: how many points they hold, and what volume.
//!
//! Every shape is a body of one scene, and `check` tells the number of its points. The number expected is counted here,
//! on the lattice of the points, by a test of each point that is written apart from that of the program; shapes are
//! placed so that no point lies on a boundary.

use crate::common::launch::Launch;
use crate::common::snapshots::Snapshots;

const CELLS: usize = 8;
const POINTS: usize = 3;

type Inside = fn(f64, f64, f64) -> bool;

/// Name, shape in YAML, and the test of a point; coordinates from 0 to 8.
const PLANE: [(&str, &str, Inside); 9] = [
    ("box", "{box: {min: [1.0, 2.0], max: [4.0, 4.5]}}", |x, y, _| {
        (1.0..4.0).contains(&x) && (2.0..4.5).contains(&y)
    }),
    ("ball", "{ball: {centre: [4.0, 4.0], radius: 2.6}}", |x, y, _| {
        (x - 4.0).hypot(y - 4.0) < 2.6
    }),
    (
        "cylinder",
        "{cylinder: {centre: [3.0, 4.0], radius: 2.1}}",
        |x, y, _| (x - 3.0).hypot(y - 4.0) < 2.1,
    ),
    (
        "ring_sector",
        "{ring_sector: {centre: [1.0, 1.0], inner_radius: 3.1, outer_radius: 5.2, from_angle: 10.0, to_angle: 80.0}}",
        |x, y, _| in_ring(x - 1.0, y - 1.0, [3.1, 5.2], [10.0, 80.0]),
    ),
    // Beyond 360 degrees: a sector that crosses the positive axis of x.
    (
        "sector_across_zero",
        "{ring_sector: {centre: [3.0, 4.0], inner_radius: 0.0, outer_radius: 3.3, from_angle: 300.0, to_angle: 410.0}}",
        |x, y, _| in_ring(x - 3.0, y - 4.0, [0.0, 3.3], [-60.0, 50.0]),
    ),
    // An L, which is not convex.
    (
        "polygon",
        "{polygon: {vertices: [[1.0, 1.0], [6.0, 1.0], [6.0, 3.0], [3.0, 3.0], [3.0, 7.0], [1.0, 7.0]]}}",
        |x, y, _| {
            (1.0..6.0).contains(&x) && (1.0..3.0).contains(&y) || (1.0..3.0).contains(&x) && (3.0..7.0).contains(&y)
        },
    ),
    (
        "all",
        "{all: [{box: {min: [0.0, 0.0], max: [8.0, 4.0]}}, {ball: {centre: [4.0, 4.0], radius: 3.1}}]}",
        |x, y, _| y < 4.0 && (x - 4.0).hypot(y - 4.0) < 3.1,
    ),
    (
        "any",
        "{any: [{box: {min: [0.0, 0.0], max: [4.0, 4.0]}}, {box: {min: [2.0, 2.0], max: [6.0, 6.0]}}]}",
        |x, y, _| x < 4.0 && y < 4.0 || (2.0..6.0).contains(&x) && (2.0..6.0).contains(&y),
    ),
    (
        "not",
        "{all: [{box: {min: [0.0, 0.0], max: [8.0, 8.0]}}, {not: {ball: {centre: [4.0, 4.0], radius: 2.6}}}]}",
        |x, y, _| (x - 4.0).hypot(y - 4.0) > 2.6,
    ),
];

const SPACE: [(&str, &str, Inside); 9] = [
    (
        "box",
        "{box: {min: [1.0, 2.0, 3.0], max: [4.0, 4.5, 8.0]}}",
        |x, y, z| (1.0..4.0).contains(&x) && (2.0..4.5).contains(&y) && z > 3.0,
    ),
    ("ball", "{ball: {centre: [4.0, 4.0, 3.0], radius: 2.6}}", |x, y, z| {
        (x - 4.0).powi(2) + (y - 4.0).powi(2) + (z - 3.0).powi(2) < 2.6 * 2.6
    }),
    (
        "cylinder_x",
        "{cylinder: {axis: x, centre: [0.0, 3.0, 4.0], radius: 2.1, min: 1.0, max: 5.0}}",
        |x, y, z| (1.0..5.0).contains(&x) && (y - 3.0).hypot(z - 4.0) < 2.1,
    ),
    (
        "cylinder_y",
        "{cylinder: {axis: y, centre: [3.0, 0.0, 4.0], radius: 2.1, min: 1.0, max: 6.0}}",
        |x, y, z| (1.0..6.0).contains(&y) && (x - 3.0).hypot(z - 4.0) < 2.1,
    ),
    // Angles about y count from z towards x.
    (
        "ring_sector_y",
        "{ring_sector: {axis: y, centre: [1.0, 0.0, 1.0], inner_radius: 3.1, outer_radius: 5.2, from_angle: 5.0, to_angle: 30.0, min: 2.0, max: 4.0}}",
        |x, y, z| (2.0..4.0).contains(&y) && in_ring(z - 1.0, x - 1.0, [3.1, 5.2], [5.0, 30.0]),
    ),
    // About x from y towards z.
    (
        "ring_sector_x",
        "{ring_sector: {axis: x, centre: [0.0, 1.0, 1.0], inner_radius: 3.1, outer_radius: 5.2, from_angle: 5.0, to_angle: 30.0, min: 2.0, max: 4.0}}",
        |x, y, z| (2.0..4.0).contains(&x) && in_ring(y - 1.0, z - 1.0, [3.1, 5.2], [5.0, 30.0]),
    ),
    (
        "polygon",
        "{polygon: {vertices: [[1.0, 1.0], [7.0, 1.0], [1.0, 7.0]], min: 2.0, max: 3.0}}",
        |x, y, z| x > 1.0 && y > 1.0 && x + y < 8.0 && (2.0..3.0).contains(&z),
    ),
    (
        "any",
        "{any: [{box: {min: [0.0, 0.0, 0.0], max: [4.0, 4.0, 4.0]}}, {box: {min: [2.0, 2.0, 2.0], max: [6.0, 6.0, 6.0]}}]}",
        |x, y, z| {
            let within = |low: f64, high: f64| [x, y, z].iter().all(|at| (low..high).contains(at));
            within(0.0, 4.0) || within(2.0, 6.0)
        },
    ),
    (
        "not",
        "{all: [{box: {min: [0.0, 0.0, 0.0], max: [8.0, 8.0, 2.0]}}, {not: {cylinder: {axis: z, centre: [4.0, 4.0, 0.0], radius: 2.6, min: -1.0, max: 3.0}}}]}",
        |x, y, z| z < 2.0 && (x - 4.0).hypot(y - 4.0) > 2.6,
    ),
];

/// Whether a point lies in a sector of a ring, with angles in degrees from the first axis towards the second.
fn in_ring(first: f64, second: f64, radii: [f64; 2], angles: [f64; 2]) -> bool {
    let angle = second.atan2(first).to_degrees();
    (radii[0]..radii[1]).contains(&first.hypot(second)) && (angles[0]..angles[1]).contains(&angle)
}

/// Number of lattice points for which a test holds.
fn count(space: bool, inside: Inside) -> usize {
    let n = CELLS * POINTS;
    let at = |index: usize| (index as f64 + 0.5) / POINTS as f64;
    let layers = if space { n } else { 1 };
    (0..n * n * layers)
        .filter(|flat| inside(at(flat % n), at(flat / n % n), at(flat / n / n)))
        .count()
}

fn scene(space: bool, bodies: &str) -> String {
    let (kinematics, axes) = if space {
        ("three_dimensional", 3)
    } else {
        ("plane_strain", 2)
    };
    let (min, max) = (vec![0.0; axes], vec![CELLS as f64; axes]);
    let unknowns = if space { "ux, uy, uz, rx, ry, rz" } else { "ux, uy, rz" };
    format!(
        "
model: {{kinematics: {kinematics}}}
grid: {{min: {min:?}, max: {max:?}, cell_size: 1.0, basis: linear}}
materials:
  rubber: {{law: elastic, lame_lambda: 8.0e6, shear_modulus: 6.0e6, coupling_modulus: 1.0e6, alpha: 5.0, beta: 40.0, gamma: 100.0}}
bodies:
{bodies}
boundary: [{{face: all, fix: [{unknowns}]}}]
stages: [{{name: rest, steps: 1}}]
output:
  history: [{{name: volume, mean: volume}}]
"
    )
}

fn shapes_hold_the_points(space: bool, shapes: &[(&str, &str, Inside)]) {
    let body = |(name, shape, _): &(&str, &str, Inside)| {
        format!("  - {{name: {name}, material: rubber, shape: {shape}, points_per_cell: {POINTS}}}\n")
    };
    let bodies: String = shapes.iter().map(body).collect();
    let run = Launch::text(&scene(space, &bodies)).run().completed();
    let scene_file = run.working_folder().join("scene.yaml");
    let check = Launch::arguments(&["check", &scene_file.to_string_lossy()])
        .run()
        .completed();
    let mut total = 0;
    for (name, _, inside) in shapes {
        let expected = count(space, *inside);
        assert!(expected > 20, "{name} holds {expected} points");
        let line = format!("  {name}: {expected}\n");
        assert!(check.stdout.contains(&line), "expected{line}in\n{}", check.stdout);
        total += expected;
    }
    assert_eq!(run.summary().count("points"), total);
    let volumes = Snapshots::read(&run.file("points.vtkhdf")).scalar("volume", 0);
    let each = (1.0 / POINTS as f64).powi(if space { 3 } else { 2 });
    assert_eq!(volumes.len(), total);
    assert!(volumes.iter().all(|volume| (volume - each).abs() < 1e-14), "{each}");
    assert!((run.history().last("volume") - each).abs() < 1e-11 * each);
}

#[test]
fn in_the_plane() {
    shapes_hold_the_points(false, &PLANE);
}

#[test]
fn in_space() {
    shapes_hold_the_points(true, &SPACE);
}

/// A point file gives position, volume and half-lengths as they stand there.
#[test]
fn a_point_file() {
    for space in [false, true] {
        let (head, rows) = if space {
            (
                "x, y, z, volume, lx, ly, lz",
                "1.5, 2.5, 3.5, 0.25, 0.1, 0.2, 0.3\n4.25, 5.5, 6.5, 0.5, 0.4, 0.3, 0.2\n",
            )
        } else {
            (
                "x, y, volume, lx, ly",
                "1.5, 2.5, 0.25, 0.1, 0.2\n4.25, 5.5, 0.5, 0.4, 0.3\n",
            )
        };
        let body = "  - {name: cloud, material: rubber, shape: {points: {file: cloud.csv}}}\n";
        let cloud = format!("# made by hand\n{head}\n{rows}");
        let run = Launch::text(&scene(space, body))
            .beside("cloud.csv", &cloud)
            .run()
            .completed();
        let snapshots = Snapshots::read(&run.file("points.vtkhdf"));
        let third = |value: f64| if space { value } else { 0.0 };
        assert_eq!(
            snapshots.positions(0),
            [[1.5, 2.5, third(3.5)], [4.25, 5.5, third(6.5)]]
        );
        assert_eq!(snapshots.scalar("volume", 0), [0.25, 0.5]);
        assert_eq!(
            snapshots.field("half_lengths", 0),
            [[0.1, 0.2, third(0.3)], [0.4, 0.3, third(0.2)]]
        );
    }
}

/// Points on the boundary of a shape are outside; one number of points per axis each.
#[test]
fn points_on_the_boundary_are_left_out() {
    let body = "  - {name: box, material: rubber, shape: {box: {min: [0.25, 0.0], max: [4.75, 1.0]}}, points_per_cell: [2, 3]}\n";
    let run = Launch::text(&scene(false, body)).run().completed();
    // Columns of points stand at 0.25, 0.75, ... 4.75: the first and the last are on the boundary.
    assert_eq!(run.summary().count("points"), 8 * 3);
}
