//! Files of points as other programs write them: names in any order, separators, marks; what is wrong, once.

use crate::common::launch::Launch;

/// A block of 1 m x 1 m from (0, 0) or (0.5, 0.5) on, 1000 kg/m3 under 10 m/s2: 10 kN rest on its base.
fn scene(base: f64) -> String {
    format!(
        "
model: {{kinematics: plane_strain, continuum: classical}}
grid: {{min: [0.0, 0.0], max: [2.0, 2.0], cell_size: 0.5, basis: gimp}}
materials: {{soil: {{law: elastic, youngs_modulus: 1.0e6, poisson_ratio: 0.25, density: 1.0e3}}}}
bodies:
  - {{name: block, material: soil, shape: {{points: {{file: points.csv}}}}}}
boundary:
  - {{face: x_min, fix: [ux]}}
  - {{face: {{axis: y, at: {base}}}, fix: [uy], name: base}}
loads:
  - {{name: weight, gravity: [0.0, -10.0]}}
stages: [{{name: weight, steps: 2}}]
output: {{history: [{{name: base, reaction: {{boundary: base, component: uy}}}}]}}
"
    )
}

/// 16 points, each a line made of x and y.
fn lines(corner: f64, line: impl Fn(f64, f64) -> String) -> String {
    let at = |index: usize| corner + 0.125 + 0.25 * index as f64;
    (0..16).map(|k| line(at(k % 4), at(k / 4)) + "\n").collect()
}

fn plain(x: f64, y: f64) -> String {
    format!("{x}, {y}, 0.0625, 0.125, 0.125")
}

/// Columns of another program in another order weigh as much, whatever separates them (an order of their own: porytiles
/// issue 350, CsvHelper issue 1079).
#[test]
fn a_block_weighs_the_same_however_its_points_are_written() {
    let documented = lines(0.0, plain);
    let named = lines(0.5, |x, y| format!("{x}, {y}, 0.125, 0.125, 0.0625"));
    let swapped = lines(0.0, |x, y| format!("0.0625, {x}, {y}, 0.125, 0.125"));
    let semicolons = lines(0.0, |x, y| format!("0.125;{x};0.0625;{y};0.125"));
    let tabs = lines(0.0, |x, y| format!("{x}\t{y}\t0.0625\t0.125\t0.125"));
    for (base, text) in [
        (0.0, documented.clone()),
        (0.0, format!("x, y, volume, lx, ly\n{documented}")),
        (
            0.0,
            format!("\u{feff}x, y, volume, lx, ly\n{documented}").replace('\n', "\r\n"),
        ),
        (0.0, format!("\u{feff}{documented}")),
        (0.5, format!("x, y, lx, ly, volume\n{named}")),
        (0.0, format!("volume, x, y, lx, ly\n{swapped}")),
        (
            0.0,
            format!("Half-length x [m];X [m];Volume [m3];Y [m];Half-length y [m]\n{semicolons}"),
        ),
        (0.0, format!("x\ty\tvol\tlx\tly\n{tabs}")),
    ] {
        let run = Launch::text(&scene(base)).beside("points.csv", &text).run().completed();
        let weight = run.history().last("base");
        assert!((weight - 10e3).abs() < 1e-3, "{weight} for\n{text}");
    }
}

/// What is wrong in a whole file is told once, with its first line; what is wrong in single lines with each.
#[test]
fn what_is_wrong_is_told_once() {
    let named = |rows: String| format!("x, y, volume, lx, ly\n{rows}");
    for (text, messages) in [
        (
            named(lines(0.0, |x, y| {
                format!("{x};{y};0.0625;0.125;0.125").replace('.', ",")
            })),
            vec!["points.csv:2:1: bodies[0].shape.points.file: the numbers have decimal commas"],
        ),
        (
            lines(0.0, |x, y| plain(x, y).replace(", ", ";").replace('.', ",")).replace(';', ","),
            vec!["points.csv:1:1: bodies[0].shape.points.file: 10 columns instead of 5 (and 15 more lines): are these"],
        ),
        (
            lines(0.0, |x, y| plain(x, y).replace(',', " ")),
            vec!["points.csv:1:1: bodies[0].shape.points.file: the columns are separated by blanks"],
        ),
        (
            "x,y,z,volume,lx,ly,lz\n".to_owned() + &lines(0.0, |x, y| format!("{x},{y},0,0.0625,0.125,0.125,0.125")),
            vec![
                "column \"z\": plane strain has no third axis",
                "column \"lz\": plane strain has no",
            ],
        ),
        (
            named(lines(0.0, plain) + "0.875, 0.125, 0.0625, 0.125, 0.125\n"),
            vec!["points.csv:18:1: bodies[0].shape.points.file: the point lies where that of line 5 does (accepted:"],
        ),
        (
            named(lines(0.0, |x, y| format!("{x}, {y}, 0.0625, 0.25, 0.25"))),
            vec![
                "points.csv:2:1: bodies[0].shape.points.file: the volume is 0.25 times that of the domain (and 15 more",
            ],
        ),
        (
            named(
                lines(0.0, plain) + "nan, 1.125, 0.0625, 0.125, 0.125\n0.125, 1.125, 0, 0.125, 0.125\n3, 0, 1, 1, 1\n",
            ),
            vec![
                "points.csv:18:1: bodies[0].shape.points.file: \"nan\" is not a number, as x",
                "points.csv:19:1: bodies[0].shape.points.file: the volume 0 is not > 0",
                "points.csv:20:1: bodies[0].shape.points.file: the point lies outside the grid: 3 is not between 0 and 2",
            ],
        ),
        (
            "x, y, volume, lx, half\n".to_owned() + &lines(0.0, plain),
            vec![
                "points.csv:1:1: bodies[0].shape.points.file: unknown column \"half\" (accepted: x, y, volume, lx, ly)",
            ],
        ),
        (named(String::new()), vec!["the file holds no points"]),
    ] {
        let check = Launch::text(&scene(0.0))
            .no_output()
            .checking()
            .beside("points.csv", &text);
        let run = check.run().expect_code(2);
        assert_eq!(run.complaints("error:").len(), messages.len(), "{}", run.stderr);
        for message in messages {
            assert_eq!(run.complaints(message).len(), 1, "{message} in {}", run.stderr);
        }
    }
}

/// Half of the volume of the domain may be meant, and is told.
#[test]
fn volumes_that_differ_from_the_domains_are_told() {
    let text = lines(0.0, |x, y| format!("{x}, {y}, 0.03125, 0.125, 0.125"));
    let check = Launch::text(&scene(0.0))
        .no_output()
        .checking()
        .beside("points.csv", &text);
    let printed = check.run().completed().stdout;
    let warning = "points.csv: line 1: the volume is 0.5 times that of the domain (and 15 more lines)";
    assert!(
        printed
            .lines()
            .any(|line| line.starts_with("warning: ") && line.contains(warning)),
        "{printed}"
    );
}
