//! What the summary tells of a run.

use super::scenes;
use crate::common::compare::Comparison;

#[test]
fn the_phases_add_up_to_the_wall_time_and_every_rank_is_listed() {
    for ranks in [1, 2, 3] {
        let run = scenes::curved_cantilever().ranks(ranks).run().completed();
        let summary = run.summary();
        let phases = summary.0["phases"].as_object().expect("phases");
        let mut names: Vec<&str> = phases.keys().map(String::as_str).collect();
        names.sort_unstable();
        let promised = [
            "assembly",
            "constitutive",
            "factorise",
            "other",
            "output",
            "search",
            "solve",
        ];
        assert_eq!(names, promised);
        let seconds: Vec<f64> = phases.values().map(|value| value.as_f64().expect("seconds")).collect();
        assert!(seconds.iter().all(|&seconds| seconds > 0.0), "{phases:?}");
        let (wall, cpu) = (summary.number("wall_seconds"), summary.number("cpu_seconds"));
        let mut comparison = Comparison::new(&format!("times on {ranks} ranks"));
        comparison.relative("sum of phases and wall time", seconds.iter().sum(), wall, 0.02);
        comparison.at_most("wall time, and that of the process", wall, run.seconds);
        comparison.at_most("CPU time, and that of all ranks", cpu, 1.1 * ranks as f64 * run.seconds);
        comparison.finish();
        assert!(cpu > 0.0);

        let memory = summary.numbers("peak_memory_mb");
        assert_eq!(memory.len(), ranks);
        assert!(
            memory.iter().all(|&memory| memory > 5.0 && memory < 500.0),
            "{memory:?}"
        );
    }
}

#[test]
fn counts_partitioner_ordering_and_versions_are_named() {
    let run = scenes::block().ranks(2).run().completed();
    let (summary, history, convergence) = (run.summary(), run.history(), run.convergence());
    assert_eq!((summary.text("status"), summary.count("exit_code")), ("completed", 0));
    assert_eq!(summary.count("points"), 3 * 3 * 4 * 2 * 2 * 2);
    assert_eq!(summary.count("steps"), history.rows.len() - 1);
    assert_eq!(summary.count("attempts"), convergence.attempts.len());
    let iterations: usize = convergence.attempts.iter().map(|attempt| attempt.residuals.len()).sum();
    assert_eq!(summary.count("newton_iterations"), iterations);
    assert_eq!(
        history.column("newton_iterations").iter().sum::<f64>() as usize,
        iterations
    );
    assert!(summary.count("nonzeros") > summary.count("dofs"));
    assert_eq!(summary.text("partitioner"), "metis");
    assert!(
        summary.text("ordering").contains("MUMPS"),
        "{}",
        summary.text("ordering")
    );
    for library in ["petsc", "mpi", "hdf5", "mpm-petsc", "commit"] {
        let version = summary.0["versions"][library].as_str().unwrap_or_default();
        assert!(!version.is_empty(), "no version of {library}");
    }
}

#[test]
fn cells_and_unknowns_are_those_that_the_points_touch() {
    let run = scenes::one_cell().ranks(2).run().completed();
    let summary = run.summary();
    let counts = ["points", "active_cells", "dofs"].map(|key| summary.count(key));
    assert_eq!(counts, [4, 1, 4 * 3]);
    // Four nodes that all see each other.
    assert_eq!(summary.count("nonzeros"), 12 * 12);
}
