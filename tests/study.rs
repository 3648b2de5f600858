//! `mpm-petsc study`: what is refused, what is run, what is repeated, and what is written.

mod common;

use common::folder::Folder;
use common::launch::{Launch, Run, Started};
use common::results::Table;
use common::scene::BLOCK;
use rustix::process::Signal;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

/// A folder with a scene and a study of it.
struct Case {
    folder: Folder,
}

impl Case {
    fn new(study: &str) -> Case {
        let folder = Folder::new();
        folder.write("block.yaml", BLOCK);
        folder.write("study.yaml", &format!("scene: block.yaml\n{study}"));
        Case { folder }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn run(&self, options: &[&str]) -> Run {
        study(&self.path("study.yaml"), &self.path("out"), options)
    }

    fn table(&self) -> Table {
        Table::read(&self.path("out/study.csv"))
    }
}

fn study(file: &Path, output: &Path, options: &[&str]) -> Run {
    let (file, output) = (file.to_string_lossy(), output.to_string_lossy());
    Launch::arguments(&["study", &file, "--output", &output])
        .with(options)
        .run()
}

/// Each wrong study with pieces that its messages must have, and how many messages there are.
const WRONG: &[(&str, usize, &[&str])] = &[
    (
        "varry: []",
        1,
        &["study.yaml:2:1: unknown key \"varry\", did you mean \"vary\"?"],
    ),
    (
        "vary:\n  - {key: grid.cell_sise, values: [1]}",
        1,
        &[
            "study.yaml:3:36: vary[0].values[0]: ",
            "unknown key \"cell_sise\", did you mean \"cell_size\"?",
        ],
    ),
    (
        "vary:\n  - {key: grid.cell_size, values: [0.01, 0.007]}",
        1,
        &["study.yaml:3:42: vary[0].values[1]: "],
    ),
    (
        "set: {materials.rubber.shear_modulus: -1}",
        1,
        &["study.yaml:2:7: set.materials.rubber.shear_modulus: "],
    ),
    (
        "vary:\n  - {name: a}\n  - {name: b, key: grid.basis, variants: []}",
        2,
        &["it is not clear what is varied"],
    ),
    (
        "vary:\n  - {key: grid.basis, values: []}",
        1,
        &["there is nothing to choose from"],
    ),
    (
        "vary:\n  - {key: grid.basis, values: [gimp, \"gimp\"]}",
        1,
        &["is there twice"],
    ),
    (
        "vary:\n  - {key: grid.basis, values: [gimp]}\n  - {key: grid.basis, values: [gimp]}",
        1,
        &["is taken"],
    ),
    (
        "measure:\n  - {name: a, max: bass}",
        1,
        &["has no column \"bass\", did you mean \"base\"?"],
    ),
    (
        "measure:\n  - {name: a, max: base, min: base}\n  - {name: b}",
        2,
        &["exactly one of last, max, min"],
    ),
    (
        "measure:\n  - {name: dofs, max: base}",
        1,
        &["the name \"dofs\" is taken"],
    ),
    (
        "measure:\n  - {name: a, distance: {x: shift, y: base}}",
        1,
        &["no curve to be distant from"],
    ),
    (
        "measure:\n  - {name: a, max: base}\nreference: {values: {b: 1.0}}",
        1,
        &["nothing named \"b\" is measured"],
    ),
    (
        "measure:\n  - {name: a, max: base}\nreference: {values: {a: [1.0, 2.0]}}",
        1,
        &["2 numbers for a measure that has 1"],
    ),
    (
        "measure:\n  - {name: a, max: base}\nreference: {values: {a: 0}}",
        1,
        &["relative to zero"],
    ),
    (
        "reference: {file: absent.csv}",
        1,
        &["absent.csv: there is no such file"],
    ),
    ("reference: {}", 1, &["exactly one of run, values, file"]),
    ("ranks: [1, 0]", 1, &["ranks: 0 is out of bounds"]),
    ("ranks: [2, 2]", 1, &["each once"]),
    (
        "charts: {along: rows}\nvary:\n  - {name: row, key: grid.basis, values: [gimp]}",
        1,
        &["did you mean \"row\"?"],
    ),
    (
        "launcher: [mpirun, -n, 2]",
        1,
        &["the number of ranks is not passed on"],
    ),
    (
        "ranks: [1, 2]\nvary:\n  - {name: a, variants: [{label: x, ranks: 2}]}",
        1,
        &["variants set the ranks too"],
    ),
    (
        "vary:\n  - {name: a, variants: [{label: x, scene: none.yaml}]}",
        1,
        &["none.yaml: there is no such file"],
    ),
    (
        "slurm: {time: \"01:00:00\\ntouch here\", options: [\"--account=a\\ntouch there\", account]}",
        3,
        &[
            "slurm.time: \"01:00:00\\ntouch here\" is no time limit of Slurm",
            "slurm.options[0]: ",
            "slurm.options[1]: \"account\" is no option of sbatch",
        ],
    ),
];

#[test]
fn wrong_studies_are_refused_with_place_and_hint() {
    for (text, count, pieces) in WRONG {
        let case = Case::new(text);
        let run = case.run(&["--dry-run"]).expect_code(2);
        for piece in *pieces {
            assert!(run.stderr.contains(piece), "{text}\nlacks {piece}\n{}", run.stderr);
        }
        assert_eq!(run.stderr.matches("error: ").count(), *count, "{text}\n{}", run.stderr);
        assert!(!case.path("out").exists(), "nothing is written");
    }
}

/// No file system takes them; told before the first run is started.
#[test]
fn labels_that_are_too_long_are_refused_at_once() {
    let label = "x".repeat(400);
    let case = Case::new(&format!(
        "vary:\n  - {{name: a, variants: [{{label: {label}}}, {{label: {label}y}}]}}"
    ));
    let run = case.run(&[]).expect_code(2);
    assert_eq!(run.complaints("error: ").len(), 1, "{}", run.stderr);
    assert_eq!(run.complaints("a name of 402 letters").len(), 1, "{}", run.stderr);
    assert!(!case.path("out").exists());
}

#[test]
fn a_scene_instead_of_a_study_is_one_problem() {
    let case = Case::new("");
    let scene = case.path("block.yaml");
    let run = study(&scene, &case.path("out"), &["--dry-run"]).expect_code(2);
    let message = format!(
        "block.yaml:4:1: this is a scene, not a study (accepted: a study; `mpm-petsc {}`",
        scene.display()
    );
    assert!(run.stderr.contains(&message), "{}", run.stderr);
    assert_eq!(run.stderr.matches("error: ").count(), 1, "{}", run.stderr);
}

#[test]
fn all_problems_are_found_in_one_pass() {
    let text = "ranks: 0\nvary:\n  - {key: grid.basis, values: [gimpp]}\nmeasure:\n  - {name: a, lst: base}";
    let run = Case::new(text).run(&["--dry-run"]).expect_code(2);
    for piece in [
        "ranks: 0",
        "\"gimpp\" is not accepted",
        "unknown key \"lst\", did you mean \"last\"?",
    ] {
        assert!(run.stderr.contains(piece), "{piece}\n{}", run.stderr);
    }
}

const MATRIX: &str = "
vary:
  - {name: basis, key: grid.basis, values: [linear, gimp]}
  - name: law
    variants:
      - {label: soft, set: {materials.rubber.shear_modulus: 3.0e6}}
      - {label: stiff, set: {materials.rubber.shear_modulus: 6.0e6, materials.rubber.lame_lambda: 9.0e6}}
measure:
  - {name: force, last: base}
  - {name: halfway, at: {column: base, when: shift, equals: 0.001}}
  - {name: unknowns, summary: dofs}
";

#[test]
fn every_combination_is_run_once_and_again_only_when_it_changes() {
    let case = Case::new(MATRIX);
    let listed = case.run(&["--dry-run"]).completed();
    assert!(listed.stdout.contains("4 runs, 4 to do"), "{}", listed.stdout);
    assert!(!case.path("out").exists(), "nothing is run by a list");

    let first = case.run(&["--jobs", "2"]).completed();
    assert_eq!(first.stdout.matches(": completed in ").count(), 4, "{}", first.stdout);
    let table = case.table();
    assert_eq!(table.text("basis"), ["linear", "linear", "gimp", "gimp"]);
    assert_eq!(table.text("law"), ["soft", "stiff", "soft", "stiff"]);
    assert_eq!(table.text("status"), ["completed"; 4]);
    assert_eq!(table.column("steps"), [2.0; 4]);
    assert_eq!(table.column("points"), [16.0; 4]);
    assert_eq!(table.column("unknowns"), table.column("dofs"));
    for row in 0..4 {
        let history = Table::read(&PathBuf::from(table.text("folder")[row]).join("history.csv"));
        assert_eq!(table.column("force")[row], history.last("base"));
        // Half the shift is reached at the first of two steps.
        assert_eq!(table.column("halfway")[row], history.column("base")[1]);
    }
    assert!(table.column("cpu_seconds").iter().all(|seconds| *seconds > 0.0));
    assert!(table.column("memory_mb").iter().all(|memory| *memory > 1.0));
    let page = std::fs::read_to_string(case.path("out/study.html")).unwrap();
    assert!(page.contains("4 of 4 runs completed"));

    let second = case.run(&[]).completed();
    assert!(second.stdout.contains("4 runs, 0 to do"), "{}", second.stdout);

    // A change of the scene that two of the runs override concerns the other two.
    case.folder
        .write("block.yaml", &BLOCK.replace("lame_lambda: 8.0e6", "lame_lambda: 7.0e6"));
    let third = case.run(&[]).completed();
    assert!(third.stdout.contains("4 runs, 2 to do"), "{}", third.stdout);
    assert!(third.stdout.contains("law-soft: completed") && !third.stdout.contains("law-stiff: completed"));
    // A comment changes nothing.
    case.folder.write(
        "block.yaml",
        &format!("# A comment\n{}", BLOCK.replace("lambda: 8.0e6", "lambda: 7.0e6")),
    );
    assert!(case.run(&["--dry-run"]).completed().stdout.contains("4 runs, 0 to do"));
}

#[test]
fn a_failure_is_recorded_and_stops_no_other_run() {
    let case = Case::new(
        "vary:\n  - {name: iterations, key: solver.max_iterations, values: [1, 15]}\n\
         reference: {values: {force: 1.0}}\nmeasure:\n  - {name: force, last: base}",
    );
    let run = case.run(&[]).expect_code(3);
    assert!(run.stderr.contains("1 of 2 runs did not complete"), "{}", run.stderr);
    let table = case.table();
    assert_eq!(table.text("status"), ["stopped", "completed"]);
    assert_eq!(table.text("exit_code"), ["3", "0"]);
    assert!(table.text("message")[0].len() > 10, "{:?}", table.text("message"));
    assert_eq!(table.text("force")[0], "", "a run that stopped is not measured");
    let (force, error) = (table.text("force")[1], table.text("force_error")[1]);
    let (force, error): (f64, f64) = (force.parse().unwrap(), error.parse().unwrap());
    assert_eq!(error, (force - 1.0).abs());
    // Nothing failed is taken for done.
    assert!(case.run(&["--dry-run"]).completed().stdout.contains("2 runs, 1 to do"));
}

#[test]
fn a_program_that_cannot_be_started_is_a_failure_with_a_reason() {
    let case = Case::new("ranks: [1, 2]\nlauncher: [/no/such/launcher, \"{ranks}\"]");
    case.run(&[]).expect_code(3);
    let table = case.table();
    assert_eq!(table.text("status"), ["completed", "failed"]);
    assert!(table.text("message")[1].contains("cannot start /no/such/launcher"));
}

#[test]
fn runs_on_several_ranks_are_started_with_mpirun_and_scaling_is_charted() {
    let case = Case::new("ranks: [1, 2]");
    case.run(&[]).completed();
    let table = case.table();
    assert_eq!(table.column("ranks"), [1.0, 2.0]);
    let summary = std::fs::read_to_string(case.path("out/runs/ranks-2/summary.json")).unwrap();
    assert!(summary.contains("\"ranks\": 2"), "{summary}");
    for name in ["wall_time_against_ranks", "efficiency_against_ranks"] {
        assert!(case.path(&format!("out/{name}.svg")).is_file() && case.path(&format!("out/{name}.png")).is_file());
    }
}

#[test]
fn a_study_on_several_ranks_is_refused_once() {
    let case = Case::new("");
    let (file, output) = (case.path("study.yaml"), case.path("out"));
    for ranks in [2, 3] {
        let run = Launch::arguments(&["study", &file.to_string_lossy(), "--output", &output.to_string_lossy()])
            .ranks(ranks)
            .run()
            .expect_code(2);
        let message = format!("error: a study was started on {ranks} ranks");
        assert_eq!(run.complaints(&message).len(), 1, "{}", run.stderr);
        assert!(!output.exists());
    }
}

/// Runs that take some seconds each, with a checkpoint after every step.
const LONG: &str = "
set: {stages.0.steps: 4000, output.checkpoint.every: 1, output.snapshots.every: 1000}
vary: [{name: basis, key: grid.basis, values: [linear, gimp]}]
";

impl Case {
    /// Starts the study with two runs at a time, and waits until both have some rows.
    fn under_way(&self) -> Started {
        let (file, output) = (self.path("study.yaml"), self.path("out"));
        let words = ["study", &file.to_string_lossy(), "--jobs", "2", "--output"];
        let started = Launch::arguments(&words).with(&[&output.to_string_lossy()]).start();
        let begin = Instant::now();
        while self.rows().iter().any(|rows| *rows < 5) {
            assert!(begin.elapsed() < Duration::from_secs(60), "the runs do not get on");
            std::thread::sleep(Duration::from_millis(5));
        }
        started
    }

    fn rows(&self) -> [usize; 2] {
        ["linear", "gimp"].map(|basis| {
            let path = self.path(&format!("out/runs/basis-{basis}/history.csv"));
            std::fs::read_to_string(path).map_or(0, |text| text.lines().count())
        })
    }

    /// The study with few steps, which the runs may have passed.
    fn listed(&self) -> String {
        self.run(&["--dry-run"]).completed().stdout
    }
}

/// A study that is asked to stop asks its runs, waits for them, and goes on from their checkpoints.
#[test]
fn a_study_that_is_stopped_stops_its_runs_and_goes_on_later() {
    for signal in [Signal::TERM, Signal::INT] {
        let case = Case::new(LONG);
        let started = case.under_way();
        started.signal(signal);
        let run = started.wait().expect_code(4);
        let message = "error: stopped by a signal with 0 of 2 runs done; the same command goes on";
        assert_eq!(run.complaints(message).len(), 1, "{}", run.stderr);
        let rows = case.rows();
        let listed = case.listed();
        assert_eq!(listed.matches("--restart").count(), 2, "{listed}");
        std::thread::sleep(Duration::from_millis(300));
        assert_eq!(case.rows(), rows, "a run goes on");
        for basis in ["linear", "gimp"] {
            let summary = std::fs::read_to_string(case.path(&format!("out/runs/basis-{basis}/summary.json"))).unwrap();
            assert!(summary.contains("\"interrupted\""), "{summary}");
        }
    }
}

/// Not even a study that is killed leaves runs behind, and until they are gone nobody writes their folders.
#[test]
fn a_study_that_is_killed_takes_its_runs_along() {
    let case = Case::new(LONG);
    let started = case.under_way();
    started.signal(Signal::KILL);
    started.wait();
    let begin = Instant::now();
    let lock = || std::fs::File::open(case.path("out/study.lock")).unwrap();
    while lock().try_lock().is_err() {
        assert!(begin.elapsed() < Duration::from_secs(20), "the runs do not end");
        std::thread::sleep(Duration::from_millis(5));
    }
    let rows = case.rows();
    assert!(rows.iter().all(|rows| *rows < 4001), "{rows:?}");
    std::thread::sleep(Duration::from_millis(300));
    assert_eq!(case.rows(), rows, "a run goes on");
    assert_eq!(case.listed().matches("--restart").count(), 2);
}

/// On several ranks the study knows `mpirun` alone.
#[test]
fn ranks_end_with_their_study() {
    let case = Case::new("set: {stages.0.steps: 4000, output.checkpoint.every: 1}\nranks: [2]");
    let (file, output) = (case.path("study.yaml"), case.path("out"));
    let words = ["study", &file.to_string_lossy(), "--output", &output.to_string_lossy()];
    let started = Launch::arguments(&words).start();
    let history = case.path("out/runs/ranks-2/history.csv");
    let rows = || std::fs::read_to_string(&history).map_or(0, |text| text.lines().count());
    let begin = Instant::now();
    while rows() < 5 {
        assert!(begin.elapsed() < Duration::from_secs(60), "the run does not get on");
        std::thread::sleep(Duration::from_millis(5));
    }
    started.signal(Signal::TERM);
    started.wait().expect_code(4);
    let before = rows();
    std::thread::sleep(Duration::from_millis(300));
    assert_eq!(rows(), before, "a rank goes on");
    assert!(
        case.listed().contains("--restart"),
        "cut short, the run goes on from its checkpoint"
    );
}

/// What a run left is believed only where its own process ended well, and only if the files agree.
#[test]
fn a_failed_run_is_never_listed_as_completed() {
    let case = Case::new("measure: [{name: force, last: base}]");
    case.run(&[]).completed();
    assert!(case.listed().contains("1 runs, 0 to do"));
    let history = case.path("out/runs/scene/history.csv");
    let text = std::fs::read_to_string(&history).unwrap();
    let cut: Vec<&str> = text.lines().take(2).collect();
    std::fs::write(&history, cut.join("\n") + "\n").unwrap();
    let run = case.run(&["--collect"]).expect_code(3);
    assert!(run.stderr.contains("1 of 1 runs did not complete"), "{}", run.stderr);
    assert_eq!(case.table().text("status"), ["failed"]);
    assert_eq!(case.table().text("force"), [""]);
    std::fs::write(&history, text).unwrap();
    assert!(case.listed().contains("1 runs, 0 to do"));
    std::fs::write(
        case.path("out/runs/scene/failure.json"),
        "{\"exit_code\": 1, \"message\": \"cannot write checkpoint.h5\"}",
    )
    .unwrap();
    case.run(&["--collect"]).expect_code(3);
    assert_eq!(case.table().text("status"), ["failed"]);
    assert_eq!(case.table().text("exit_code"), ["1"]);
    // With --overwrite it begins again, and its failure is forgotten.
    case.run(&["--overwrite"]).completed();
    assert_eq!(case.table().text("status"), ["completed"]);
}

#[test]
fn a_folder_of_another_study_is_left_alone() {
    let case = Case::new("");
    case.run(&[]).completed();
    let table = std::fs::read(case.path("out/study.csv")).unwrap();
    let other = case
        .folder
        .write("other.yaml", "scene: block.yaml\nset: {stages.0.steps: 3}");
    for option in ["--jobs=1", "--collect", "--slurm"] {
        let run = study(&other, &case.path("out"), &[option]).expect_code(2);
        for piece in ["holds the study ", "study.yaml", "--overwrite", "--output"] {
            assert_eq!(run.complaints(piece).len(), 1, "{piece}: {}", run.stderr);
        }
        assert_eq!(std::fs::read(case.path("out/study.csv")).unwrap(), table);
    }
    let run = study(&other, &case.path("out"), &["--overwrite"]).completed();
    assert!(run.stdout.contains("1 runs, 1 to do"), "{}", run.stdout);
    // A study that was moved is the same one.
    let moved = std::fs::read_to_string(&other).unwrap();
    let moved = case.folder.write("moved.yaml", &moved);
    study(&moved, &case.path("out"), &[]).completed();
}

#[test]
fn a_second_study_in_a_folder_is_refused() {
    let case = Case::new("");
    std::fs::create_dir_all(case.path("out")).unwrap();
    let lock = std::fs::File::create(case.path("out/study.lock")).unwrap();
    lock.try_lock().unwrap();
    let run = case.run(&[]).expect_code(1);
    assert_eq!(
        run.complaints("another study writes this folder").len(),
        1,
        "{}",
        run.stderr
    );
    assert!(!case.path("out/runs").exists());
}

/// What stands in a batch script is read by Slurm and by a shell.
#[test]
fn names_in_a_batch_script_are_names() {
    let case = Case::new("");
    let folder = case.path("a folder #1 with 50%j");
    // Its folder is where the tasks run.
    let _written = study(&case.path("study.yaml"), &folder, &["--slurm"]).completed();
    let text = std::fs::read_to_string(folder.join("study.slurm")).unwrap();
    let shown = folder.to_string_lossy().replace('%', "%%");
    let line = format!("#SBATCH --output=\"{shown}/slurm_%a.txt\"");
    assert!(text.lines().any(|own| own == line), "{text}");
    let task = Command::new("bash")
        .arg(folder.join("study.slurm"))
        .env("SLURM_ARRAY_TASK_ID", "1")
        .output()
        .unwrap();
    assert!(task.status.success(), "{task:?}");
    assert!(folder.join("runs/scene/summary.json").exists());
}

/// Rates from 4 to 8 cells, against those of the errors of an independent implementation.
#[test]
fn fitted_rates_of_the_manufactured_solution_are_those_of_the_reference() {
    let folder = Folder::new();
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("configs/studies/manufactured_rates.yaml");
    let text = std::fs::read_to_string(source).unwrap();
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("configs/manufactured_4.yaml");
    let text = text
        .replace("values: [4, 8, 16]", "values: [4, 8]")
        .replace("../manufactured_4.yaml", &scene.to_string_lossy());
    let run = study(&folder.write("rates.yaml", &text), &folder.path().join("out"), &[]).completed();
    let reference =
        std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/reference/manufactured.json"))
            .unwrap();
    let reference: serde_json::Value = serde_json::from_str(&reference).unwrap();
    for (measure, key) in [
        ("error_u", "e_u"),
        ("error_theta", "e_theta"),
        ("error_sigma", "e_sigma"),
        ("error_mu", "e_mu"),
    ] {
        let error = |row: usize| reference["runs"][row][key].as_f64().unwrap();
        let rate = (error(0) / error(1)).log2();
        let words = format!("{measure} falls with the cell size to the power ");
        let line = run.stdout.lines().find_map(|line| line.strip_prefix(&words));
        let line = line.unwrap_or_else(|| panic!("no rate of {measure}: {}", run.stdout));
        let fitted: f64 = line.split(',').next().unwrap().parse().unwrap();
        // Two digits are printed, and errors agree with the reference within 0.5 %.
        assert!((fitted - rate).abs() < 0.02, "{measure}: {fitted} instead of {rate}");
    }
    let table = Table::read(&folder.path().join("out/study.csv"));
    for (size, expected) in table.column("cell_size").iter().zip([0.25, 0.125]) {
        assert!((size - expected).abs() < 1e-14, "{size}");
    }
    for name in [
        "error_against_cell_size.svg",
        "error_against_cpu_error_u.png",
        "study.html",
    ] {
        assert!(folder.path().join("out").join(name).is_file(), "{name}");
    }
}

#[test]
fn a_reference_run_and_a_reference_file_give_the_same_errors() {
    let measures = "measure:\n  - {name: curve, distance: {x: shift, y: base}}\n  - {name: force, last: base}\n";
    let vary = "vary:\n  - {name: modulus, key: materials.rubber.shear_modulus, values: [6.0e6, 3.0e6]}\n";
    let case = Case::new(&format!("{vary}{measures}reference: {{run: {{set: {{}}}}}}"));
    case.run(&[]).completed();
    let by_run = case.table();
    assert_eq!(by_run.text("run")[0], "reference");
    let errors = |table: &Table, skip: usize| -> Vec<f64> {
        let of = |name: &str| -> Vec<f64> {
            table.text(name)[skip..]
                .iter()
                .map(|cell| cell.parse().unwrap())
                .collect()
        };
        [of("curve"), of("force_error")].concat()
    };
    let own = errors(&by_run, 1);
    assert_eq!((own[0], own[2]), (0.0, 0.0), "the same scene as the reference");
    assert!(own[1] > 0.1 && own[3] > 0.1, "{own:?}");

    let history = std::fs::read_to_string(case.path("out/runs/reference/history.csv")).unwrap();
    case.folder.write("exact.csv", &history);
    case.folder.write(
        "study.yaml",
        &format!("scene: block.yaml\n{vary}{measures}reference: {{file: exact.csv}}"),
    );
    let again = case.run(&[]).completed();
    assert!(again.stdout.contains("2 runs, 0 to do"), "{}", again.stdout);
    assert_eq!(errors(&case.table(), 0), own);
}

#[test]
fn a_batch_script_has_one_task_a_run_and_results_are_collected_later() {
    let case = Case::new(
        "ranks: [1, 2]\nvary:\n  - {key: grid.basis, values: [linear, gimp]}\n\
        slurm: {time: \"00:10:00\", options: [--account=\"the group\"], before: [module load openmpi]}",
    );
    let written = case.run(&["--slurm"]).completed();
    assert!(
        written.stdout.contains("sbatch --ntasks=1 --array=1,3"),
        "{}",
        written.stdout
    );
    assert!(
        written.stdout.contains("sbatch --ntasks=2 --array=2,4"),
        "{}",
        written.stdout
    );
    assert!(!case.path("out/runs").exists(), "nothing was run");
    let script = case.path("out/study.slurm");
    let text = std::fs::read_to_string(&script).unwrap();
    for line in [
        "#SBATCH --array=1-4",
        "#SBATCH --ntasks=2",
        "#SBATCH --time=00:10:00",
        "module load openmpi",
    ] {
        assert!(text.lines().any(|own| own == line), "{line}\n{text}");
    }
    let syntax = Command::new("bash").arg("-n").arg(&script).status().unwrap();
    assert!(syntax.success(), "{text}");

    // Before any task: nothing to collect, and it says so.
    case.run(&["--collect"]).expect_code(3);
    assert_eq!(case.table().text("status"), ["missing"; 4]);
    // A task of the array, as Slurm starts it.
    let task = Command::new("bash")
        .arg(&script)
        .env("SLURM_ARRAY_TASK_ID", "3")
        .output()
        .unwrap();
    assert!(task.status.success(), "{task:?}");
    case.run(&["--collect"]).expect_code(3);
    assert_eq!(
        case.table().text("status"),
        ["missing", "missing", "completed", "missing"]
    );
    assert!(case.run(&["--dry-run"]).completed().stdout.contains("4 runs, 3 to do"));
}

/// The studies of the repository are accepted.
#[test]
fn every_study_of_the_repository_can_be_listed() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("configs/studies");
    let mut count = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let run = Launch::arguments(&["study", &path.to_string_lossy(), "--dry-run"])
            .run()
            .completed();
        assert!(run.stdout.contains(" to do"), "{}", path.display());
        count += 1;
    }
    assert!(count >= 5, "only {count} studies");
}
