//! Snapshots of material points: written by one, two and three ranks, read back with HDF5 and with VTK.
//!
//! MPI starts once per process, so this program runs itself again under `mpirun`, told by the environment which part to
//! play; the checks are made outside. The last line is `N passed, N failed`.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Output};
use std::time::Duration;

use mpm_petsc::output::progress::{Progress, StepLine};
use mpm_petsc::output::vtkhdf::Snapshots;
use mpm_petsc::output::{PointField, PointFields, PointValues, agree};
use mpm_petsc::parallel::World;
use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};

const PART: &str = "MPM_PETSC_TEST_PART";
const FOLDER: &str = "MPM_PETSC_TEST_FOLDER";
/// Points per edge of the cube; its number of points divides by neither two nor three.
const EDGE: u64 = 11;
const TOTAL: u64 = EDGE * EDGE * EDGE;
const TIMES: [f64; 3] = [0.0, 0.5, 2.0];

type Outcome = Result<(), String>;
type Case = (&'static str, fn() -> Outcome);

fn main() -> ExitCode {
    match env::var(PART) {
        Ok(part) => play(&part),
        Err(_) => check_all(),
    }
}

// What the points are: functions of their number and of the snapshot.

fn position(id: u64, step: usize) -> [f64; 3] {
    let [x, y, z] = [id % EDGE, id / EDGE % EDGE, id / EDGE / EDGE].map(|index| 0.1 * index as f64);
    [x + 0.05 * step as f64 * y, y, z]
}

fn chi(id: u64, step: usize) -> f64 {
    id as f64 / 3.0 + step as f64
}

fn displacement(id: u64, step: usize) -> [f64; 3] {
    [0.05 * step as f64 * position(id, 0)[1], 0.0, -(id as f64)]
}

fn stress(id: u64, step: usize) -> [f64; 9] {
    std::array::from_fn(|component| 1e6 * component as f64 + id as f64 + 0.1 * step as f64)
}

// The parts that are played under mpirun.

fn play(part: &str) -> ExitCode {
    let world = World::start().expect("MPI starts once");
    let folder = PathBuf::from(env::var_os(FOLDER).expect("the folder is given"));
    let path = folder.join("points.vtkhdf");
    let outcome = match part {
        "series" => write_series(&world, &path, TIMES.len()),
        "single" => write_series(&world, &path, 1),
        "few" => write_few(&world, &path),
        "killed" => write_and_die(&world, &path),
        "nowhere" => expect_error(&world, "cannot write", append(&world, &mut Snapshots::new(path), 0)),
        "limit" => write_beyond_limit(&world, &path),
        "numbers" => write_wrong_numbers(&world, &path),
        "progress" => print_progress(&world),
        other => Err(format!("no such part: {other}")),
    };
    match agree(&world, outcome) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

/// Numbers of this rank's points, in falling order; the points change ranks from snapshot to snapshot.
fn own_ids(world: &World, total: u64, step: usize) -> Vec<u64> {
    let owner = |id: u64| (id * 7 + id / 10 + step as u64) as usize % world.size();
    (0..total).rev().filter(|&id| owner(id) == world.rank()).collect()
}

fn append_points(
    world: &World,
    series: &mut Snapshots,
    ids: &[u64],
    total: u64,
    step: usize,
) -> Result<(), mpm_petsc::error::Error> {
    let position: Vec<[f64; 3]> = ids.iter().map(|&id| position(id, step)).collect();
    let fields = [
        PointField {
            name: "chi",
            values: PointValues::Scalar(ids.iter().map(|&id| chi(id, step)).collect()),
        },
        PointField {
            name: "displacement",
            values: PointValues::Vector(ids.iter().map(|&id| displacement(id, step)).collect()),
        },
        PointField {
            name: "stress",
            values: PointValues::Tensor(ids.iter().map(|&id| stress(id, step)).collect()),
        },
    ];
    series.append(
        world,
        TIMES[step],
        &PointFields {
            ids,
            total,
            position: &position,
            fields: &fields,
        },
    )
}

fn append(world: &World, series: &mut Snapshots, step: usize) -> Result<(), mpm_petsc::error::Error> {
    append_points(world, series, &own_ids(world, TOTAL, step), TOTAL, step)
}

fn write_series(world: &World, path: &Path, count: usize) -> Outcome {
    let mut series = Snapshots::new(path);
    for step in 0..count {
        append(world, &mut series, step).map_err(|error| error.to_string())?;
    }
    if series.written() == count {
        Ok(())
    } else {
        Err(format!("{} snapshots counted", series.written()))
    }
}

/// Two points: with three ranks one holds no points and one writes no rows.
fn write_few(world: &World, path: &Path) -> Outcome {
    let mut series = Snapshots::new(path);
    (0..TIMES.len()).try_for_each(|step| {
        append_points(world, &mut series, &own_ids(world, 2, step), 2, step).map_err(|error| error.to_string())
    })
}

fn write_and_die(world: &World, path: &Path) -> Outcome {
    write_series(world, path, 2)?;
    world.barrier();
    rustix::process::kill_process(rustix::process::getpid(), rustix::process::Signal::KILL)
        .map_err(|error| error.to_string())
}

fn expect_error(world: &World, part: &str, outcome: Result<(), mpm_petsc::error::Error>) -> Outcome {
    match outcome {
        Ok(()) => Err(format!("rank {} saw no error", world.rank())),
        Err(error) if error.to_string().contains(part) => Ok(()),
        Err(error) => Err(format!("rank {} saw another error: {error}", world.rank())),
    }
}

/// The second snapshot hits a limit of the size of files, a third try without the limit succeeds.
fn write_beyond_limit(world: &World, path: &Path) -> Outcome {
    let mut series = Snapshots::new(path);
    append(world, &mut series, 0).map_err(|error| error.to_string())?;
    let limits = getrlimit(Resource::Fsize);
    let size = fs::metadata(path).map_err(|error| error.to_string())?.len();
    let tight = Rlimit {
        current: Some(size + 20_000),
        maximum: limits.maximum,
    };
    setrlimit(Resource::Fsize, tight).map_err(|error| error.to_string())?;
    let failed = expect_error(world, "cannot write", append(world, &mut series, 1));
    setrlimit(Resource::Fsize, limits).map_err(|error| error.to_string())?;
    agree(world, failed).map_err(|error| error.to_string())?;
    for step in [1, 2] {
        append(world, &mut series, step).map_err(|error| format!("after the failure: {error}"))?;
    }
    Ok(())
}

fn write_wrong_numbers(world: &World, path: &Path) -> Outcome {
    let mut series = Snapshots::new(path);
    let mut ids = own_ids(world, TOTAL, 0);
    ids[0] = 5;
    expect_error(world, "point number", append_points(world, &mut series, &ids, TOTAL, 0))?;
    ids[0] = TOTAL;
    expect_error(world, "point number", append_points(world, &mut series, &ids, TOTAL, 0))?;
    if path.exists() {
        Err("a file was written".into())
    } else {
        Ok(())
    }
}

fn print_progress(world: &World) -> Outcome {
    let mut progress = Progress::on_stdout(world.is_root(), Duration::ZERO);
    progress.step(&StepLine {
        begun: 0.0,
        step: 1,
        stage: "compress",
        load_factor: 0.5,
        step_size: 0.5,
        newton_iterations: 3,
        residual: 1e-10,
        elapsed: Duration::from_secs(1),
        done: 0.5,
    });
    progress.finish();
    Ok(())
}

// The checks outside.

/// Folder of this run of the tests; removed when all went well.
fn scratch() -> PathBuf {
    env::temp_dir().join(format!("mpm-petsc-vtkhdf-{}", std::process::id()))
}

/// Runs a part on so many ranks; the answer is its folder and what it printed.
fn launch(part: &str, ranks: usize) -> Result<(PathBuf, Output), String> {
    let folder = scratch().join(format!("{part}-{ranks}"));
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).map_err(|error| error.to_string())?;
    let given = if part == "nowhere" {
        folder.join("missing")
    } else {
        folder.clone()
    };
    let output = Command::new("timeout")
        .args(["-k", "5", "120", "mpirun", "-n", &ranks.to_string()])
        // A process that ignores the signal of the limit of file sizes gets an error instead.
        .args(["env", "--ignore-signal=XFSZ"])
        .arg(env::current_exe().map_err(|error| error.to_string())?)
        .env(PART, part)
        .env(FOLDER, given)
        .env("OMPI_ALLOW_RUN_AS_ROOT", "1")
        .env("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1")
        .env("OMPI_MCA_rmaps_base_oversubscribe", "1")
        .env("OMPI_MCA_btl_vader_single_copy_mechanism", "none")
        .output()
        .map_err(|error| format!("mpirun: {error}"))?;
    Ok((folder, output))
}

/// Runs a part that must succeed without a word of complaint.
fn launch_well(part: &str, ranks: usize) -> Result<PathBuf, String> {
    let (folder, output) = launch(part, ranks)?;
    let errors = String::from_utf8_lossy(&output.stderr).into_owned();
    if output.status.success() && errors.is_empty() {
        Ok(folder)
    } else {
        Err(format!("{}: {errors}", output.status))
    }
}

/// Runs `scripts/check_vtkhdf.py` in the environment that `scripts/setup.sh` makes.
fn check_with_vtk(file: &Path, options: &[&str]) -> Outcome {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let python = root.join(".venv/bin/python");
    let output = Command::new("timeout")
        .args(["-k", "5", "300"])
        .arg(&python)
        .arg(root.join("scripts/check_vtkhdf.py"))
        .arg(file)
        .args(options)
        .env_remove("DISPLAY")
        .output()
        .map_err(|error| format!("timeout: {error}"))?;
    if !python.exists() {
        return Err(format!("{} is missing; scripts/setup.sh makes it", python.display()));
    }
    if output.status.success() {
        return Ok(());
    }
    Err(format!(
        "{}{}",
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr)
    ))
}

fn read<T: hdf5::H5Type>(file: &hdf5::File, name: &str) -> Result<Vec<T>, String> {
    file.dataset(&format!("VTKHDF/{name}"))
        .and_then(|dataset| dataset.read_raw())
        .map_err(|error| error.to_string())
}

/// Every row of every step is what its point should have, exactly.
fn check_rows(path: &Path, total: u64, steps: usize, ranks: usize) -> Outcome {
    let file = hdf5::File::open(path).map_err(|error| error.to_string())?;
    let expected = || (0..steps).flat_map(|step| (0..total).map(move |id| (id, step)));
    let compare = |name: &str, values: Vec<f64>| {
        let read: Vec<f64> = read(&file, name)?;
        if read == values {
            Ok(())
        } else {
            Err(format!("{name} differs from what was written"))
        }
    };
    compare("Points", expected().flat_map(|(id, step)| position(id, step)).collect())?;
    compare("PointData/chi", expected().map(|(id, step)| chi(id, step)).collect())?;
    compare(
        "PointData/displacement",
        expected().flat_map(|(id, step)| displacement(id, step)).collect(),
    )?;
    compare(
        "PointData/stress",
        expected().flat_map(|(id, step)| stress(id, step)).collect(),
    )?;
    compare("Steps/Values", TIMES[..steps].to_vec())?;
    let owners: Vec<i32> = expected()
        .map(|(id, step)| ((id * 7 + id / 10 + step as u64) as usize % ranks) as i32)
        .collect();
    if read::<i32>(&file, "PointData/rank")? != owners {
        return Err("rank differs from who had the points".into());
    }
    let cells: Vec<i64> = read(&file, "Connectivity")?;
    if cells.len() as u64 == total {
        Ok(())
    } else {
        Err(format!("{} cells are stored for {total}", cells.len()))
    }
}

fn series_is_exact(ranks: usize) -> Outcome {
    let file = launch_well("series", ranks)?.join("points.vtkhdf");
    check_rows(&file, TOTAL, 3, ranks)?;
    let total = TOTAL.to_string();
    check_with_vtk(
        &file,
        &[
            "--steps",
            "3",
            "--points",
            &total,
            "--fields",
            "chi,displacement,stress,rank",
        ],
    )
}

fn picture_is_drawn() -> Outcome {
    let folder = launch_well("series", 2)?;
    let picture = folder.join("points.png");
    let name = picture.to_string_lossy();
    check_with_vtk(&folder.join("points.vtkhdf"), &["--picture", &name, "--colour", "chi"])?;
    let size = fs::metadata(&picture).map_err(|error| error.to_string())?.len();
    if size > 1000 {
        Ok(())
    } else {
        Err(format!("the picture has {size} bytes"))
    }
}

fn checker_notices_a_missing_step() -> Outcome {
    let file = launch_well("few", 1)?.join("points.vtkhdf");
    match check_with_vtk(&file, &["--steps", "4"]) {
        Err(message) if message.contains("3 steps") => Ok(()),
        other => Err(format!("{other:?}")),
    }
}

fn few_points_on_many_ranks() -> Outcome {
    let file = launch_well("few", 3)?.join("points.vtkhdf");
    check_rows(&file, 2, 3, 3)?;
    check_with_vtk(&file, &["--steps", "3", "--points", "2"])
}

fn a_single_snapshot_is_read() -> Outcome {
    let file = launch_well("single", 2)?.join("points.vtkhdf");
    check_rows(&file, TOTAL, 1, 2)?;
    check_with_vtk(&file, &["--steps", "1"])
}

fn a_killed_run_leaves_its_snapshots() -> Outcome {
    let (folder, output) = launch("killed", 2)?;
    if output.status.success() {
        return Err("the run was not killed".into());
    }
    let file = folder.join("points.vtkhdf");
    check_rows(&file, TOTAL, 2, 2)?;
    check_with_vtk(&file, &["--steps", "2"])
}

fn an_unwritable_place_is_an_error_everywhere() -> Outcome {
    [1, 3]
        .into_iter()
        .try_for_each(|ranks| launch_well("nowhere", ranks).map(drop))
}

fn a_failed_snapshot_can_be_repeated(ranks: usize) -> Outcome {
    let (folder, output) = launch("limit", ranks)?;
    let errors = String::from_utf8_lossy(&output.stderr).into_owned();
    // Open MPI says a word about the failed system call, HDF5 must not.
    if !output.status.success() || errors.contains("HDF5") {
        return Err(format!("{}: {errors}", output.status));
    }
    check_rows(&folder.join("points.vtkhdf"), TOTAL, 3, ranks)
}

fn wrong_numbers_are_an_error_everywhere() -> Outcome {
    [1, 2]
        .into_iter()
        .try_for_each(|ranks| launch_well("numbers", ranks).map(drop))
}

fn redirected_progress_has_no_control_characters() -> Outcome {
    let (_, output) = launch("progress", 2)?;
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let plain = text.chars().all(|letter| letter == '\n' || !letter.is_control());
    if plain && text.lines().count() == 1 && text.contains("compress") {
        Ok(())
    } else {
        Err(format!("{text:?}"))
    }
}

fn check_all() -> ExitCode {
    let cases: [Case; 13] = [
        ("one rank writes what was meant", || series_is_exact(1)),
        ("two ranks write what was meant", || series_is_exact(2)),
        ("three ranks write what was meant", || series_is_exact(3)),
        ("a picture is drawn", picture_is_drawn),
        ("the checker notices a missing step", checker_notices_a_missing_step),
        ("few points on many ranks", few_points_on_many_ranks),
        ("a single snapshot is read", a_single_snapshot_is_read),
        ("a killed run leaves its snapshots", a_killed_run_leaves_its_snapshots),
        (
            "an unwritable place is an error everywhere",
            an_unwritable_place_is_an_error_everywhere,
        ),
        ("a failed snapshot can be repeated on one rank", || {
            a_failed_snapshot_can_be_repeated(1)
        }),
        ("a failed snapshot can be repeated on three ranks", || {
            a_failed_snapshot_can_be_repeated(3)
        }),
        (
            "wrong numbers are an error everywhere",
            wrong_numbers_are_an_error_everywhere,
        ),
        (
            "redirected progress has no control characters",
            redirected_progress_has_no_control_characters,
        ),
    ];
    let mut failed = 0;
    for (name, case) in &cases {
        match case() {
            Ok(()) => println!("test {name} ... ok"),
            Err(message) => {
                failed += 1;
                println!("test {name} ... FAILED\n{message}");
            }
        }
    }
    if failed == 0 {
        let _ = fs::remove_dir_all(scratch());
    }
    println!("{} passed, {failed} failed", cases.len() - failed);
    if failed == 0 {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}
