//! From text to scene and back: good configurations, overrides, all problems at once, and no panic on any text.

use mpm_petsc::condition::dirichlet::GridPlane;
use mpm_petsc::config::{self, Input};
use mpm_petsc::grid::mesh::MeshFace;
use mpm_petsc::grid::region::Shape;
use mpm_petsc::material::spec::{ElasticModuli, MaterialSpec};
use mpm_petsc::points::seed::PointSource;
use mpm_petsc::points::select::Selection;
use mpm_petsc::problem::Problem;
use mpm_petsc::scene::{BasisKind, ContinuumKind, HistoryQuantity, LoadKind, PointField, Scene, Target};

const SHEAR_LAYER: &str = include_str!("good_input/shear_layer.yaml");
const MESH: &str = include_str!("good_input/mesh.yaml");
const BIAXIAL: &str = include_str!("good_input/biaxial.yaml");

fn good(name: &str) -> Scene {
    let file = format!("{}/tests/good_input/{name}.yaml", env!("CARGO_MANIFEST_DIR"));
    match Input::from_disk(&file, &[]).and_then(|input| input.scene()) {
        Ok((scene, _)) => scene,
        Err(problems) => panic!("{}", lines(&problems).join("\n")),
    }
}

fn lines(problems: &[Problem]) -> Vec<String> {
    problems.iter().map(ToString::to_string).collect()
}

fn problems_of(text: &str, overrides: &[&str]) -> Vec<String> {
    let overrides: Vec<_> = overrides.iter().map(|text| (*text).to_owned()).collect();
    lines(&config::read("a.yaml", text, &overrides).expect_err("the configuration should be wrong"))
}

fn overridden(text: &str, overrides: &[&str]) -> Scene {
    let overrides: Vec<_> = overrides.iter().map(|text| (*text).to_owned()).collect();
    config::read("a.yaml", text, &overrides)
        .unwrap_or_else(|problems| panic!("{}", lines(&problems).join("\n")))
        .0
}

#[test]
fn the_shear_layer_has_the_moduli_and_the_weak_row_of_the_thesis() {
    let scene = good("shear_layer");
    assert_eq!((scene.grid.cells, scene.grid.basis), ([5, 9, 1], BasisKind::Gimp));
    assert_eq!(scene.materials.len(), 2);
    let MaterialSpec::Elastoplastic(elastic, strong) = scene.materials[0].spec else {
        panic!()
    };
    let MaterialSpec::Elastoplastic(_, weak) = scene.materials[1].spec else {
        panic!()
    };
    assert!(
        (elastic.gamma - 4e5).abs() < 1e-6 && (elastic.alpha + 4e5 * 2.0 / 3.0).abs() < 1e-6 && elastic.beta == 0.0
    );
    assert_eq!((strong.yield_strength, weak.yield_strength), (100e6, 0.9 * 100e6));
    assert_eq!(scene.regions[0].replace, [(0, 1)]);
    assert_eq!(scene.boundaries[0].nodes().expect("nodes").plane, None);
    assert_eq!(
        scene.boundaries[2].nodes().expect("nodes").plane,
        Some(GridPlane { axis: 1, index: 9 })
    );
    assert_eq!(scene.boundaries[2].moves, [(0, 0.02)]);
    assert_eq!(scene.output.directory.to_str(), Some("results/shear_layer"));
    let PointSource::Lattice {
        points_per_cell, shape, ..
    } = &scene.bodies[0].points
    else {
        panic!()
    };
    assert_eq!(*points_per_cell, [4, 4, 1]);
    assert!(
        shape.contains(&[0.005, 0.05, 77.0], -1e-12),
        "plane strain has no third coordinate"
    );
}

#[test]
fn the_scene_of_every_kind_of_key_is_resolved() {
    let scene = good("three_dimensional");
    // Two materials; the first region changes both, the second one both of them and of their variants.
    assert_eq!(scene.materials.len(), 8);
    assert_eq!(scene.regions[1].replace, [(0, 4), (1, 5), (2, 6), (3, 7)]);
    let PointSource::List(points) = &scene.bodies[2].points else {
        panic!()
    };
    assert_eq!((points.len(), points[1].position), (2, [-1.75, -1.25, 1.5]));
    let LoadKind::SpecificWeight(weights) = &scene.loads[0].kind else {
        panic!()
    };
    // Materials have the order of their names: hard, soft.
    assert!((weights[0][2] + 9.81 * 3000.0).abs() < 1e-9 && (weights[1][2] + 9.81 * 2000.0).abs() < 1e-9);
    assert!((weights[7][2] + 9.81 * 4000.0).abs() < 1e-9);
    let LoadKind::Couple {
        at: Target::Points(Selection::Layer { body, direction }),
        ..
    } = &scene.loads[3].kind
    else {
        panic!()
    };
    assert!(*body == 1 && (direction[0] - 0.5_f64.sqrt()).abs() < 1e-15);
    let PointSource::Lattice {
        shape: Shape::All(parts),
        ..
    } = &scene.bodies[1].points
    else {
        panic!()
    };
    assert!(
        matches!(parts[0], Shape::RingSector { axis: 0, to_angle, .. } if (to_angle.to_degrees() - 60.0).abs() < 1e-9)
    );
    let names: Vec<_> = scene
        .output
        .history
        .iter()
        .flat_map(|column| column.column_names(scene.kinematics))
        .collect();
    assert_eq!(&names[..6], ["moment", "weight", "tip_x", "tip_y", "tip_z", "twist"]);
    assert_eq!((names.len(), names[6].as_str()), (15, "stress_xx"));
    let HistoryQuantity::LoadFactor { load: 0 } = scene.output.history[1].quantity else {
        panic!()
    };
}

#[test]
fn a_mesh_takes_the_place_of_the_grid() {
    let scene = good("mesh");
    let PointSource::Mesh(mesh) = &scene.bodies[0].points else {
        panic!()
    };
    assert_eq!((mesh.cells, mesh.points_per_cell), ([20, 2, 1], [2, 2, 1]));
    assert_eq!((scene.grid.cells, scene.grid.basis), ([20, 2, 1], BasisKind::Linear));
    let outside = MeshFace { axis: 1, upper: true };
    let LoadKind::Force {
        at: Target::Face(face), ..
    } = scene.loads[1].kind
    else {
        panic!()
    };
    assert_eq!(face, outside);
    let HistoryQuantity::FaceMean { field, face } = scene.output.history[1].quantity else {
        panic!()
    };
    assert_eq!((field, face), (PointField::Position, outside));
}

#[test]
fn a_classical_scene_has_two_moduli_and_three_unknowns_in_space() {
    let scene = good("classical");
    assert_eq!(scene.continuum, ContinuumKind::Classical);
    assert_eq!(scene.continuum.unknowns(3), ["ux", "uy", "uz"]);
    let MaterialSpec::Elastoplastic(elastic, plastic) = scene.materials[0].spec else {
        panic!()
    };
    assert_eq!(elastic, ElasticModuli::without_rotations(7e6, 3e6));
    assert_eq!((plastic.plastic_length, plastic.hardening_modulus), (0.0, -1e3));
    assert_eq!(
        scene.ghost.map(|ghost| (ghost.translation, ghost.rotation)),
        Some((1e6, 0.0))
    );
}

#[test]
fn running_the_resolved_configuration_repeats_the_scene() {
    for name in ["shear_layer", "biaxial", "three_dimensional", "classical", "mesh"] {
        let scene = good(name);
        let folder = std::env::temp_dir().join(format!("mpm-petsc-resolved-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let file = folder.join("config.yaml");
        std::fs::write(&file, &scene.output.resolved).unwrap();
        let again = Input::from_disk(file.to_str().unwrap(), &[]).and_then(|input| input.scene());
        std::fs::remove_dir_all(&folder).unwrap();
        let (again, _) =
            again.unwrap_or_else(|problems| panic!("{}\n{}", scene.output.resolved, lines(&problems).join("\n")));
        assert_eq!(format!("{again:?}"), format!("{scene:?}"), "{name}");
    }
}

#[test]
fn overrides_change_keys_and_are_in_the_resolved_configuration() {
    let overrides = [
        "bodies.0.points_per_cell=[2, 6]",
        "solver.max_iterations=7",
        "grid.cells=null",
        "grid.cell_size=0.011111111111111112",
        "output.snapshots.every=3",
        "title=\"a: b\"",
    ];
    let scene = overridden(SHEAR_LAYER, &overrides);
    let PointSource::Lattice { points_per_cell, .. } = scene.bodies[0].points else {
        panic!()
    };
    assert_eq!(points_per_cell, [2, 6, 1]);
    assert_eq!((scene.solver.max_iterations, scene.output.snapshot_every), (7, Some(3)));
    assert_eq!((scene.title.as_str(), scene.grid.cells), ("a: b", [5, 9, 1]));
    let again = overridden(&scene.output.resolved, &[]);
    assert_eq!(format!("{again:?}"), format!("{scene:?}"));
}

#[test]
fn wrong_overrides_are_reported_as_such() {
    let problems = problems_of(
        SHEAR_LAYER,
        &["solver.max_iteration=3", "bodies.1.name=a", "grid.cells=two"],
    );
    assert_eq!(problems.len(), 3, "{problems:#?}");
    assert!(
        problems.iter().all(|problem| problem.starts_with("--set: ")),
        "{problems:#?}"
    );
    let has = |text: &str| problems.iter().any(|problem| problem.contains(text));
    assert!(
        has("solver: unknown key \"max_iteration\", did you mean \"max_iterations\"?"),
        "{problems:#?}"
    );
    assert!(has("the list has no entry 1"), "{problems:#?}");
    assert!(has("grid.cells: \"two\" is not accepted"), "{problems:#?}");
}

#[test]
fn all_problems_of_a_file_are_reported_in_one_pass_and_nothing_that_only_follows_from_them() {
    let text = BIAXIAL
        .replace("kinematics: plane_strain", "kinematics: plain_strain")
        .replace("lame_lambda: 8.0e6", "lame_lamda: 8.0e6")
        .replace("basis: gimp", "basis: bspline4")
        .replace("points_per_cell: 3", "points_per_cell: three")
        .replace("material: sand", "material: sandy")
        .replace("{face: x_min, fix: [ux]}", "{face: x_min, fix: [uz]}")
        .replace("{face: y_min, fix: [uy]}", "{face: y_min}")
        .replace("{name: compress, steps: 200,", "{name: compress,")
        .replace("max_iterations: 15", "max_iterations: 1.5")
        .replace("method: auto", "method: autom")
        .replace("rotation: 1.28", "rotation: -1.28")
        .replace("boundary: platen", "boundary: plate");
    let problems = problems_of(&text, &[]);
    let expected = [
        "a.yaml:4:3: model.kinematics: \"plain_strain\" is not accepted, did you mean \"plane_strain\"?",
        "a.yaml:12:3: grid.basis: \"bspline4\" is not accepted, did you mean \"bspline1\"? (accepted: linear, gimp, bspline1, bspline2, bspline3)",
        "a.yaml:17:5: materials.sand: unknown key \"lame_lamda\", did you mean \"lame_lambda\"?",
        "a.yaml:30:5: bodies[0].material: there is no material named \"sandy\", did you mean \"sand\"?",
        "a.yaml:32:5: bodies[0].points_per_cell: \"three\" is not accepted",
        "a.yaml:39:25: boundary[0].fix[0]: there is no component \"uz\" in plane strain (accepted: ux, uy, rz)",
        "a.yaml:40:5: boundary[1]: the condition neither fixes nor moves anything",
        "a.yaml:46:5: stages[0].steps: this key is missing",
        "a.yaml:52:3: solver.max_iterations: \"1.5\" is not accepted (accepted: a whole number",
        "a.yaml:53:3: solver.method: \"autom\" is not accepted, did you mean \"auto\"?",
        "a.yaml:58:31: stabilisation.ghost.rotation: -1.28 is out of bounds",
        "a.yaml:64:32: output.history[0].reaction.boundary: there is no boundary named \"plate\", did you mean \"platen\"?",
        "a.yaml:65:44: output.history[1].boundary_motion.boundary: there is no boundary named \"plate\"",
    ];
    assert_eq!(problems.len(), expected.len(), "{problems:#?}");
    for (problem, expected) in problems.iter().zip(expected) {
        assert!(
            problem.starts_with(expected),
            "{problem}\nshould begin with\n{expected}"
        );
    }
}

#[test]
fn problems_found_after_reading_have_their_place_too() {
    let (_, source) = config::read("a.yaml", SHEAR_LAYER, &["boundary.1.name=lid".to_owned()]).unwrap();
    let problem = source.problem(
        "boundary[1]",
        "no active node lies on this boundary",
        "a face that the body touches",
    );
    assert_eq!(problem.place, Some((35, 5)));
    assert!(
        problem
            .to_string()
            .starts_with("a.yaml:35:5: boundary[1]: no active node"),
        "{problem}"
    );
    assert_eq!(source.problem("boundary[1].name", "", "").file, "--set");
    assert_eq!(source.problem("bodies[0].shape.box", "", "").place, Some((26, 13)));
}

#[test]
fn configurations_of_absurd_size_are_refused_in_time() {
    let start = std::time::Instant::now();
    let many = |count: usize, line: &str| {
        (0..count)
            .map(|index| line.replace('#', &index.to_string()))
            .collect::<String>()
    };
    let texts = [
        SHEAR_LAYER.replace("fix: [uy]", &format!("fix: [{}]", many(90_000, "u#, "))),
        SHEAR_LAYER.replace("min: [0.0, 0.0]", &format!("min: [{}]", many(90_000, "u#, "))),
        SHEAR_LAYER.replace("stages:\n", &format!("stages:\n{}", many(20_000, "  - {name: s#}\n"))),
        SHEAR_LAYER.replace("model:", &format!("{}model:", many(40_000, "key#: 1\n"))),
        SHEAR_LAYER.replace("cells: [5, 9]", "cell_size: 1e-300"),
        SHEAR_LAYER.replace(
            "regions:\n",
            &format!(
                "regions:\n{}",
                many(
                    40,
                    "  - {within: {not: {ball: {centre: [0, 0], radius: 1}}}, scale: {cohesion: 1}}\n"
                )
                .replace("cohesion", "yield_strength")
            ),
        ),
        MESH.replace("cells: [20, 2]", "cells: [30000, 30000]"),
        many(200_000, "- #\n"),
    ];
    for text in texts {
        let problems = problems_of(&text, &[]);
        assert!(
            !problems.is_empty() && problems.len() <= 200,
            "{} problems",
            problems.len()
        );
    }
    assert!(start.elapsed().as_secs() < 60, "{:?}", start.elapsed());
}

/// A generator of numbers that need not be good, only the same every time.
struct Numbers(u64);

impl Numbers {
    fn below(&mut self, bound: usize) -> usize {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) as usize) % bound
    }
}

const FRAGMENTS: [&str; 36] = [
    "-1",
    "0",
    "1e400",
    "nan",
    ".inf",
    "1e-320",
    "99999999999999999999",
    "[]",
    "{}",
    "null",
    "~",
    "\"",
    "'",
    "[",
    "}",
    ": ",
    "- ",
    "\n",
    "\n  ",
    "\t",
    "#",
    "&a ",
    "*a",
    "!!float ",
    "<<: *a",
    "|\n",
    ">-\n",
    "---\n",
    "...",
    "? ",
    "\u{0}",
    "\u{feff}",
    "é",
    "[0, 0, 0]",
    "{box: {min: [0, 0], max: [1, 1]}}",
    "all",
];

fn mutate(text: &str, numbers: &mut Numbers) -> String {
    let mut letters: Vec<char> = text.chars().collect();
    for _ in 0..=numbers.below(3) {
        let at = numbers.below(letters.len().max(1)).min(letters.len());
        let length = numbers.below(12).min(letters.len() - at);
        let fragment = FRAGMENTS[numbers.below(FRAGMENTS.len())].chars();
        match numbers.below(4) {
            0 => drop(letters.drain(at..at + length)),
            1 => drop(letters.splice(at..at + length, fragment)),
            2 => drop(letters.splice(at..at, fragment)),
            _ => {
                // A value is replaced as a whole: most likely to stay well-formed.
                let begin = letters[at..]
                    .iter()
                    .position(|letter| *letter == ':')
                    .map_or(at, |found| at + found + 1);
                let end = letters[begin..].iter().position(|letter| ",}\n".contains(*letter));
                let end = end.map_or(letters.len(), |found| begin + found);
                drop(letters.splice(begin..end, " ".chars().chain(fragment)));
            }
        }
    }
    letters.into_iter().collect()
}

#[test]
fn no_mutation_of_a_good_configuration_ends_in_a_panic() {
    let mut numbers = Numbers(20_250_801);
    // Without the body whose points come from a file, which is not read here.
    let three_dimensional = include_str!("good_input/three_dimensional.yaml");
    let three_dimensional: Vec<_> = three_dimensional
        .lines()
        .filter(|line| !line.contains("cloud.csv"))
        .collect();
    let samples = [SHEAR_LAYER, BIAXIAL, MESH, &three_dimensional.join("\n")];
    let (mut accepted, mut refused) = (0, 0);
    for round in 0..8000 {
        let text = mutate(samples[round % samples.len()], &mut numbers);
        match config::read("a.yaml", &text, &[]) {
            Ok(_) => accepted += 1,
            Err(problems) => {
                assert!(!problems.is_empty(), "refused without a reason:\n{text}");
                refused += 1;
            }
        }
    }
    assert!(
        accepted > 100 && refused > 3000,
        "{accepted} accepted, {refused} refused: the mutations are too mild or too wild"
    );
}
