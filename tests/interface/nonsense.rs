//! Scenes whose keys are all right and that are wrong all the same: what `check` says of them, on one rank and on two.

use super::scenes::BLOCK;
use crate::common::launch::{Launch, Run};

/// A block in the middle of a grid, away from its faces.
const FLOATING: &str = "
model: {kinematics: plane_strain, continuum: classical}
grid: {min: [0.0, 0.0], max: [4.0, 4.0], cell_size: 0.5}
materials:
  soil: {law: elastic, youngs_modulus: 1.0e6, poisson_ratio: 0.3, density: 2000.0}
bodies:
  - {name: block, material: soil, shape: {box: {min: [1.0, 1.0], max: [2.0, 2.0]}}, points_per_cell: 2}
boundary: []
loads: []
stages: [{name: first, steps: 2}, {name: second, steps: 2}]
";

/// A cube in the middle of a grid.
const CUBE: &str = "
model: {kinematics: three_dimensional}
grid: {min: [0.0, 0.0, 0.0], max: [3.0, 3.0, 3.0], cell_size: 1.0}
materials:
  soil: {law: elastic, youngs_modulus: 1.0e6, poisson_ratio: 0.3, coupling_modulus: 1.0e5, bending_length: 0.1,
         bounded_stiffness: true}
bodies:
  - {name: cube, material: soil, shape: {box: {min: [1.0, 1.0, 1.0], max: [2.0, 2.0, 2.0]}}, points_per_cell: 2}
boundary: []
stages: [{name: first, steps: 1}]
";

/// A boundary entry for the node at a position.
fn node(axes: &str, position: &str) -> String {
    format!("{{face: all, within: {{ball: {{centre: {position}, radius: 0.1}}}}, fix: [{axes}]}}")
}

/// The body of the floating block and another one.
fn beside(other: &str) -> String {
    let block = "{name: block, material: soil, shape: {box: {min: [1.0, 1.0], max: [2.0, 2.0]}}, points_per_cell: 2}";
    assert!(FLOATING.contains(block));
    format!("bodies=[{block}, {other}]")
}

/// The conditions of the sheared block and another one.
fn sheared_and(other: &str) -> String {
    let base = "{face: y_min, fix: [ux, uy], name: base}";
    let top = "{face: y_max, fix: [uy], move: {ux: 0.002}, name: top}";
    assert!(BLOCK.contains(base) && BLOCK.contains(top));
    format!("boundary=[{base}, {top}, {other}]")
}

fn boundary(entries: &[String]) -> String {
    format!("boundary=[{}]", entries.join(", "))
}

fn check(scene: &str, overrides: &[&str], ranks: usize) -> Run {
    Launch::text(scene)
        .no_output()
        .set(overrides)
        .checking()
        .ranks(ranks)
        .run()
}

/// What is refused has one message with all these parts, the same on two ranks.
fn refused(scene: &str, overrides: &[&str], parts: &[&str]) {
    for ranks in [1, 2] {
        let run = check(scene, overrides, ranks).expect_code(2);
        let messages = run.complaints("error:");
        assert_eq!(messages.len(), 1, "{overrides:?}: {}", run.stderr);
        for part in parts {
            assert!(messages[0].contains(part), "{part} in {}", messages[0]);
        }
    }
}

/// The warnings about what is accepted, the same on two ranks.
fn warnings(scene: &str, overrides: &[&str]) -> Vec<String> {
    let [one, two] = [1, 2].map(|ranks| {
        let run = check(scene, overrides, ranks).completed();
        assert_eq!(run.stderr, "");
        let lines = run.stdout.lines().filter_map(|line| line.strip_prefix("warning: "));
        lines.map(str::to_owned).collect::<Vec<_>>()
    });
    assert_eq!(one, two);
    one
}

/// What is accepted has one warning, with all these parts.
fn warned(scene: &str, overrides: &[&str], parts: &[&str]) {
    let found = warnings(scene, overrides);
    assert_eq!(found.len(), 1, "{overrides:?}: {found:?}");
    for part in parts {
        assert!(found[0].contains(part), "{part} in {}", found[0]);
    }
}

fn accepted(scene: &str, overrides: &[&str]) {
    assert_eq!(warnings(scene, overrides), Vec::<String>::new(), "{overrides:?}");
}

const WEIGHT: &str = "loads=[{gravity: [0.0, -10.0]}]";

#[test]
fn a_body_that_nothing_holds() {
    let all = "nothing keeps the body \"block\" from moving along x and y and from turning about z";
    refused(FLOATING, &[], &["bodies[0]", all, "fix or move in boundary"]);
    // What holds it later does not hold it from the start.
    let later = "boundary=[{face: {axis: y, at: 1.0}, fix: [ux, uy], stage: second}]";
    refused(
        FLOATING,
        &[later, WEIGHT],
        &[all, "boundary[0] acts only from stage \"second\" on"],
    );
    // Pressures and a ghost penalty hold nothing.
    let pressed = "loads=[{pressure: 1.0e3, at: {surface: {body: block}}}]";
    let ghost = "stabilisation={ghost: {translation: 1.0e5}}";
    refused(FLOATING, &[pressed, ghost], &[all]);
}

#[test]
fn a_motion_that_loads_drive_and_nothing_holds() {
    let sides = "boundary=[{face: {axis: x, at: 1.0}, fix: [ux]}]";
    let along_y = "nothing keeps the body \"block\" from moving along y, which its loads do";
    refused(FLOATING, &[sides, WEIGHT], &[along_y, "there is no equilibrium"]);
    let pressed = "loads=[{pressure: 1.0e3, at: {layer: {body: block, face: y_max}}}]";
    refused(FLOATING, &[sides, pressed], &[along_y]);
    // A load of a later stage, and one that a later support comes in time for.
    let second = "loads=[{gravity: [0.0, -10.0], stage: second}]";
    let since = "from moving along y from stage \"second\" on, which its loads do";
    refused(FLOATING, &[sides, second], &[since]);
    let in_time = "boundary=[{face: {axis: x, at: 1.0}, fix: [ux]}, \
                   {face: {axis: y, at: 1.0}, fix: [uy], stage: second}]";
    warned(FLOATING, &[in_time, second], &["moving along y"]);
    // A hinge holds what its force passes through.
    let hinge = boundary(&[node("ux, uy", "[1.0, 1.0]")]);
    let turning = "nothing keeps the body \"block\" from turning about z, which its loads do";
    refused(FLOATING, &[&hinge, WEIGHT], &[turning]);
}

#[test]
fn a_motion_that_no_load_drives_is_left_to_round_off() {
    let floor = "boundary=[{face: {axis: y, at: 1.0}, fix: [uy]}]";
    warned(
        FLOATING,
        &[floor, WEIGHT],
        &[
            "bodies[0]: nothing keeps the body \"block\" from moving along x",
            "no load drives it",
        ],
    );
    let balanced = "loads=[{force: [1.0, 0.0], at: {layer: {body: block, face: x_max}}}, \
                    {force: [-1.0, 0.0], at: {layer: {body: block, face: x_min}}}]";
    warned(FLOATING, &[floor, balanced], &["moving along x"]);
    let hinge = boundary(&[node("ux, uy", "[1.5, 2.0]")]);
    warned(FLOATING, &[&hinge, WEIGHT], &["turning about z"]);
    // One more node, or a slope of the body, is enough.
    let held = boundary(&[node("ux, uy", "[1.5, 2.0]"), node("ux", "[1.5, 1.0]")]);
    accepted(FLOATING, &[&held, WEIGHT]);
}

#[test]
fn each_piece_needs_supports_of_its_own() {
    let far = "{name: far, material: soil, points_per_cell: 2, shape: {box: {min: [3.0, 1.0], max: [4.0, 2.0]}}}";
    let floor = |body: &str| format!("{{face: {{axis: y, at: 1.0}}, within: {{box: {body}}}, fix: [ux, uy]}}");
    let left = boundary(&[floor("{min: [0.9, 0.9], max: [2.1, 1.1]}")]);
    let loose = "bodies[1]: nothing keeps the body \"far\" from moving";
    refused(FLOATING, &[&beside(far), &left, WEIGHT], &[loose]);
    // Bodies that share nodes hold each other.
    let near = far.replace("[3.0, 1.0], max: [4.0", "[2.0, 1.0], max: [3.0");
    accepted(FLOATING, &[&beside(&near), &left, WEIGHT]);
    // Two halves of one body with a gap of a cell and more.
    let halves = "bodies.0.shape={any: [{box: {min: [1.0, 1.0], max: [2.0, 2.0]}}, \
                  {box: {min: [3.0, 1.0], max: [4.0, 2.0]}}]}";
    let part = "the part from (3.125, 1.125) to (3.875, 1.875) of the body \"block\"";
    refused(FLOATING, &[halves, &left, WEIGHT], &[part]);
    accepted(
        FLOATING,
        &[halves, "boundary=[{face: {axis: y, at: 1.0}, fix: [ux, uy]}]", WEIGHT],
    );
}

#[test]
fn springs_and_platens_hold_points() {
    let spring = |keys: &str| format!("{{selection: {{layer: {{body: block, face: y_min}}}}, penalty: 1.0e6, {keys}}}");
    accepted(FLOATING, &[&boundary(&[spring("fix: [ux, uy]")]), WEIGHT]);
    accepted(FLOATING, &[&boundary(&[spring("rigid: {}")]), WEIGHT]);
    // A platen that slides leaves one motion, of the body with it; a free one along y would be driven.
    warned(
        FLOATING,
        &[&boundary(&[spring("rigid: {free: [ux]}")]), WEIGHT],
        &["moving along x"],
    );
    refused(
        FLOATING,
        &[&boundary(&[spring("rigid: {free: [uy]}")]), WEIGHT],
        &["moving along y, which its loads do"],
    );
    // What another support of the same points sets free.
    let released = boundary(&[spring("rigid: {}"), spring("stage: second, rigid: {free: [uy]}")]);
    let since = "moving along y from stage \"second\" on, which its loads do";
    refused(FLOATING, &[&released, WEIGHT], &[since]);
}

/// Two blocks on one sliding platen: a support of one of them holds both.
#[test]
fn a_sliding_platen_ties_pieces_together() {
    let other =
        beside("{name: far, material: soil, points_per_cell: 2, shape: {box: {min: [3.0, 1.0], max: [4.0, 2.0]}}}");
    let platen =
        "{selection: {within: {box: {min: [0.0, 1.0], max: [4.0, 1.2]}}}, penalty: 1.0e6, rigid: {free: [ux]}}";
    let push = "loads=[{gravity: [1.0, -10.0]}]";
    let found = check(FLOATING, &[&other, &boundary(&[platen.to_owned()]), push], 1).expect_code(2);
    assert_eq!(
        found.complaints("moving along x, which its loads do").len(),
        2,
        "{}",
        found.stderr
    );
    let stop = boundary(&[platen.to_owned(), node("ux", "[1.0, 2.0]")]);
    accepted(FLOATING, &[&other, &stop, push]);
}

#[test]
fn all_six_motions_in_space() {
    let every = "moving along x and y and z and from turning about x and y and z";
    refused(CUBE, &[], &[every]);
    let floor = "boundary=[{face: {axis: z, at: 1.0}, fix: [uz]}]";
    warned(CUBE, &[floor], &["from moving along x and y and from turning about z"]);
    let diagonal = boundary(&[
        node("ux, uy, uz", "[1.0, 1.0, 1.0]"),
        node("ux, uy, uz", "[2.0, 2.0, 1.0]"),
    ]);
    warned(CUBE, &[&diagonal], &["from turning about (0.71, 0.71, 0.00)"]);
    let three = boundary(&[
        node("ux, uy, uz", "[1.0, 1.0, 1.0]"),
        node("uy, uz", "[2.0, 1.0, 1.0]"),
        node("uz", "[1.0, 2.0, 1.0]"),
    ]);
    accepted(CUBE, &[&three]);
    // A micro-rotation that is fixed keeps the body from turning, but for a law that does not couple the two.
    let turned = boundary(&[node("ux, uy, uz, rx, ry, rz", "[1.0, 1.0, 1.0]")]);
    accepted(CUBE, &[&turned]);
    let uncoupled = "materials.soil.coupling_modulus=0.0";
    warned(CUBE, &[&turned, uncoupled], &["from turning about x and y and z"]);
    warned(
        CUBE,
        &[&three, uncoupled],
        &["from turning its micro-rotations about x and y and z"],
    );
}

#[test]
fn meshes_need_supports_too() {
    let mesh = "
model: {kinematics: plane_strain, continuum: classical, method: fem}
materials: {rubber: {law: elastic, lame_lambda: 2.0e6, shear_modulus: 3.0e6}}
bodies: [{name: bar, material: rubber, mesh: {box: {min: [0.0, 0.0], max: [2.0, 1.0]}, cells: [4, 2]}}]
boundary: [{face: x_min, fix: [ux]}]
loads: [{force: [0.0, 1.0], at: {face: x_max}}]
stages: [{name: push, steps: 1}]
";
    refused(
        mesh,
        &[],
        &["nothing keeps the body \"bar\" from moving along y, which its loads do"],
    );
    accepted(mesh, &["boundary=[{face: x_min, fix: [ux]}, {face: y_min, fix: [uy]}]"]);
}

#[test]
fn one_component_moved_in_two_ways() {
    let again = &sheared_and("{face: y_max, fix: [ux]}");
    refused(
        BLOCK,
        &[again],
        &["boundary[2].fix: ux is fixed here and moved by 0.002 by boundary[1].move.ux at 3 of 3 nodes"],
    );
    refused(
        BLOCK,
        &[&sheared_and("{face: y_max, move: {ux: 0.003}}")],
        &["boundary[2].move.ux", "boundary[1].move.ux"],
    );
    // The whole of the earlier one may lie within the later.
    refused(
        BLOCK,
        &[
            "boundary=[{face: y_min, fix: [uy], name: base}, {face: y_max, move: {ux: 0.002}, name: top}, \
             {face: all, move: {uy: 0.001}}]",
        ],
        &["boundary[2].move.uy", "boundary[0].fix"],
    );
    // Equal motions and those of a later stage do not contradict.
    accepted(BLOCK, &[&sheared_and("{face: y_max, fix: [uy], move: {ux: 0.002}}")]);
    accepted(
        BLOCK,
        &[
            "stages=[{name: shear, steps: 2}, {name: hold, steps: 1}]",
            &sheared_and("{face: y_max, fix: [ux], stage: hold}"),
        ],
    );
    // Faces that meet at a corner.
    warned(
        BLOCK,
        &[&sheared_and("{face: x_min, fix: [ux]}")],
        &["boundary[2].fix: ux is fixed here and moved by 0.002 by boundary[1].move.ux at 1 of 3 nodes"],
    );
}

#[test]
fn points_pulled_in_two_ways() {
    let spring = |selection: &str, keys: &str| format!("{{selection: {selection}, penalty: 1.0e6, {keys}}}");
    let layer = "{layer: {body: block, face: y_max}}";
    let base = "{face: y_min, fix: [ux, uy]}".to_owned();
    let both = boundary(&[
        base.clone(),
        spring(layer, "fix: [uy]"),
        spring(layer, "move: {uy: 0.001}"),
    ]);
    refused(
        BLOCK,
        &[&both, "output.history=[]"],
        &["boundary[2].move.uy: uy is moved by 0.001 here and fixed by boundary[1].fix"],
    );
    // The same points by another selection: the earlier spring stays when a later stage begins.
    let within = "{within: {box: {min: [0.0, 0.017], max: [0.02, 0.02]}}}";
    let stages = "stages=[{name: hold, steps: 1}, {name: push, steps: 1}]";
    let later = boundary(&[
        base.clone(),
        spring(layer, "fix: [uy]"),
        spring(within, "move: {uy: 0.001}, stage: push"),
    ]);
    refused(
        BLOCK,
        &[&later, stages, "output.history=[]"],
        &["boundary[2].move.uy", "of 4 points"],
    );
    let replaced = later.replace(within, layer);
    accepted(BLOCK, &[&replaced, stages, "output.history=[]"]);
    let corner = "{layer: {body: block, face: x_max}}";
    let meeting = boundary(&[base, spring(layer, "fix: [uy]"), spring(corner, "move: {uy: 0.001}")]);
    warned(
        BLOCK,
        &[&meeting, "output.history=[]"],
        &["boundary[2].move.uy", "at 1 of 4 points"],
    );
}

/// A block beside the block of a scene.
fn neighbour(shape: &str, points_per_cell: usize, material: &str) -> String {
    beside(&format!(
        "{{name: other, material: {material}, points_per_cell: {points_per_cell}, shape: {shape}}}"
    ))
}

#[test]
fn bodies_in_one_place() {
    let floor = "boundary=[{face: {axis: y, at: 1.0}, fix: [ux, uy]}]";
    let stone = "materials.stone={law: elastic, youngs_modulus: 1.0e7, poisson_ratio: 0.2}";
    let same = "{box: {min: [1.0, 1.0], max: [2.0, 2.0]}}";
    refused(
        FLOATING,
        &[floor, &neighbour(same, 3, "soil")],
        &[
            "bodies[1]: the body \"other\" shares 100.0 % of its space",
            "\"block\" of bodies[0]",
        ],
    );
    // Two materials side by side, or a pile that no hole was cut for, may be meant.
    warned(
        FLOATING,
        &[floor, stone, &neighbour(same, 2, "stone")],
        &["shares 100.0 % of its space"],
    );
    let pile = "{box: {min: [1.5, 1.0], max: [1.75, 3.0]}}";
    warned(
        FLOATING,
        &[floor, &neighbour(pile, 2, "soil")],
        &["shares 50.0 % of its space, from (1.625, 1.125) to (1.625, 1.875)"],
    );
    // Bodies that touch share none, whatever their points and their surfaces.
    for (shape, points) in [
        ("{box: {min: [2.0, 1.0], max: [3.0, 2.0]}}", 3),
        ("{polygon: {vertices: [[2.0, 1.0], [3.0, 1.0], [2.0, 2.0]]}}", 4),
        (
            "{all: [{ball: {centre: [1.5, 1.5], radius: 1.0}}, {not: {box: {min: [1.0, 1.0], max: [2.0, 2.0]}}}]}",
            2,
        ),
    ] {
        accepted(FLOATING, &[floor, &neighbour(shape, points, "soil")]);
    }
    let cut = "bodies.0.shape={box: {min: [1.0, 1.0], max: [1.7, 2.0]}}";
    accepted(
        FLOATING,
        &[
            floor,
            &neighbour("{box: {min: [1.7, 1.0], max: [2.5, 2.0]}}", 3, "soil"),
            cut,
        ],
    );
}

#[test]
fn points_of_a_file_in_a_body() {
    let floor = "boundary=[{face: {axis: y, at: 1.0}, fix: [ux, uy]}]";
    let body = "{name: cloud, material: soil, shape: {points: {file: cloud.csv}}}";
    // Two points with domains of half a metre, one beside the other.
    let cloud = |from: f64| {
        let row = |k: usize| format!("{}, 1.25, 0.25, 0.25, 0.25\n", from + 0.25 + 0.5 * k as f64);
        "x, y, volume, lx, ly\n".to_owned() + &(0..2).map(row).collect::<String>()
    };
    let run = |from: f64, bodies: &str| {
        let launch = Launch::text(FLOATING).no_output().set(&[floor, bodies]);
        launch.beside("cloud.csv", &cloud(from)).checking().run()
    };
    let shares = "bodies[1]: the body \"cloud\" shares 50.0 % of its space";
    let half = run(1.5, &beside(body)).completed().stdout;
    assert!(half.contains(&format!("warning: {shares}")), "{half}");
    let touching = run(2.0, &beside(body)).completed().stdout;
    assert!(!touching.contains("warning"), "{touching}");
    let twice = format!("bodies=[{}, {body}]", body.replace("name: cloud", "name: block"));
    let refused = run(1.0, &twice).expect_code(2);
    let complaints = refused.complaints("shares 100.0 % of its space");
    assert_eq!(complaints.len(), 1, "{}", refused.stderr);
}

#[test]
fn pressure_between_bodies() {
    let floor = "boundary=[{face: {axis: y, at: 1.0}, fix: [ux, uy]}]";
    let above = neighbour("{box: {min: [1.5, 2.0], max: [2.0, 3.0]}}", 3, "soil");
    let layer = "loads=[{name: cap, pressure: 1.0e3, at: {layer: {body: block, face: y_max}}}]";
    warned(
        FLOATING,
        &[floor, &above, layer],
        &["loads[0] (cap): 2 of the 4 faces under this pressure lie against the body \"other\""],
    );
    let surface = "loads=[{name: cap, pressure: 1.0e3, at: {surface: {body: other, facing: [y_min, y_max]}}}]";
    warned(
        FLOATING,
        &[floor, &above, surface],
        &["3 of the 6 faces", "the body \"block\""],
    );
    let free = layer.replace("y_max", "x_min");
    accepted(FLOATING, &[floor, &above, &free]);
}

#[test]
fn entries_that_change_nothing() {
    let region = |shape: &str, key: &str| format!("regions=[{{within: {{box: {shape}}}, scale: {{{key}: 0.5}}}}]");
    let inside = "{min: [0.0, 0.0], max: [0.01, 0.02]}";
    warned(
        BLOCK,
        &[&region("{min: [0.02, 0.0], max: [0.03, 0.02]}", "shear_modulus")],
        &["regions[0] holds no material point"],
    );
    let stone = "materials.stone={law: elastic, youngs_modulus: 1.0e7, poisson_ratio: 0.2, coupling_modulus: 1.0e6, \
                 bending_length: 0.001, bounded_stiffness: true}";
    let block =
        "{name: block, material: rubber, points_per_cell: 2, shape: {box: {min: [0.0, 0.0], max: [0.02, 0.02]}}}";
    let cap = "{name: cap, material: stone, points_per_cell: 2, shape: {box: {min: [0.02, 0.0], max: [0.03, 0.02]}}}";
    warned(
        BLOCK,
        &[
            stone,
            &format!("bodies=[{block}, {cap}]"),
            &region(inside, "youngs_modulus"),
        ],
        &["regions[0] changes nothing"],
    );
    accepted(BLOCK, &[&region(inside, "shear_modulus")]);
    warned(BLOCK, &[stone], &["materials.stone is the material of no body"]);
    for (key, what) in [
        ("snapshots", "only the first and the last state"),
        ("checkpoint", "only the last state"),
    ] {
        warned(
            BLOCK,
            &[&format!("output.{key}={{every: 3}}")],
            &[&format!("output.{key}.every: 3 is more than the 2 steps"), what],
        );
        accepted(BLOCK, &[&format!("output.{key}={{every: 2}}")]);
    }
}

#[test]
fn hats_lock_where_volume_is_kept() {
    let floor = "boundary=[{selection: {layer: {body: block, face: y_min}}, penalty: 1.0e5, rigid: {}}]";
    let ratio = |ratio: &str| format!("materials.soil.poisson_ratio={ratio}");
    let parts = [
        "volumetric locking",
        "materials.soil",
        "grid.basis: bspline2",
        "docs/stability.md",
    ];
    let flow = "materials.soil={law: von_mises, youngs_modulus: 1.0e6, poisson_ratio: 0.3, yield_strength: 1.0e3}";
    let dry = |angle: &str| {
        format!(
            "materials.soil={{law: drucker_prager, youngs_modulus: 1.0e6, poisson_ratio: 0.3, friction_angle: 30.0, \
             dilatancy_angle: {angle}, cohesion: 1.0e3}}"
        )
    };
    for basis in ["linear", "gimp", "bspline1"] {
        let basis = format!("grid.basis={basis}");
        warned(FLOATING, &[floor, &basis, &ratio("0.49")], &parts);
        warned(FLOATING, &[floor, &basis, flow], &parts);
        accepted(FLOATING, &[floor, &basis, &ratio("0.45")]);
    }
    let told = |angle: &str| {
        let found = warnings(FLOATING, &[floor, &dry(angle)]);
        found.iter().filter(|line| line.contains("volumetric locking")).count()
    };
    assert_eq!(["0.0", "5.0"].map(told), [1, 0]);
    accepted(FLOATING, &[floor, "grid.basis=bspline2", &ratio("0.49")]);
    // One point a cell is not asked too much of.
    accepted(FLOATING, &[floor, "bodies.0.points_per_cell=1", &ratio("0.49")]);
}

/// A pressure on a surface without points on several of its sides is told once.
#[test]
fn a_message_once() {
    let load = "loads: [{pressure: 1.0e3, at: {surface: {body: block}}}]\nstages: [";
    let history = "history: [{name: mean, mean: displacement, at: {load: thrust}}]";
    let text = BLOCK
        .replace("stages: [", load)
        .replace("max: [0.02, 0.02]}}, points", "max: [0.001, 0.02]}}, points");
    let text = text.replace("loads: [{pressure", "loads: [{name: thrust, pressure");
    let (head, _) = text.split_once("  history:").expect("columns");
    let run = Launch::text(&format!("{head}  {history}\n")).run().expect_code(2);
    assert_eq!(
        run.complaints("the selection holds no material point").len(),
        1,
        "{}",
        run.stderr
    );
}

/// What `check` warns of is told at the head of a run, and stands in its summary.
#[test]
fn warnings_last() {
    let run = Launch::text(BLOCK)
        .set(&["output.snapshots={every: 9}"])
        .run()
        .completed();
    let warning = "output.snapshots.every: 9 is more than the 2 steps";
    assert!(run.stdout.contains(&format!("warning: {warning}")), "{}", run.stdout);
    let summary = std::fs::read_to_string(run.file("summary.json")).expect("a summary");
    assert!(summary.contains(warning), "{summary}");
}
