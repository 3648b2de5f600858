//! Partitioner, ordering and line search change the way, not the answer.

use super::scenes;
use crate::common::compare::{same_history, same_path};
use crate::common::launch::Launch;

const TOLERANCE: f64 = 1e-8;

#[test]
fn every_partitioner_gives_the_same_history() {
    let alone = scenes::block().run().completed().history();
    for (choice, used) in [("auto", "metis"), ("metis", "metis"), ("ptscotch", "ptscotch")] {
        let setting = format!("solver.partitioner={choice}");
        let run = scenes::block().set(&[&setting]).ranks(3).run().completed();
        assert_eq!(run.summary().text("partitioner"), used);
        same_history(choice, &run.history(), &alone, TOLERANCE);
    }
}

#[test]
fn a_partitioner_that_petsc_does_not_have_is_refused_with_those_it_has() {
    let run = scenes::block()
        .set(&["solver.partitioner=parmetis"])
        .ranks(2)
        .run()
        .expect_code(2);
    let complaints = run.complaints("parmetis");
    assert_eq!(complaints.len(), 1, "{}", run.stderr);
    assert!(
        complaints[0].contains("available: auto, metis, ptscotch"),
        "{}",
        complaints[0]
    );
    assert!(!run.stderr.contains("PETSC ERROR"), "{}", run.stderr);
    assert!(!run.file("history.csv").exists(), "nothing was run");
}

#[test]
fn metis_and_pord_orderings_give_the_same_history() {
    let metis = scenes::curved_cantilever().run().completed();
    assert!(
        metis.summary().text("ordering").contains("METIS"),
        "{}",
        metis.summary().text("ordering")
    );
    let pord = scenes::curved_cantilever()
        .petsc("-pc_factor_mat_ordering_type external -mat_mumps_icntl_7 4")
        .run()
        .completed();
    assert!(
        pord.summary().text("ordering").contains("PORD"),
        "{}",
        pord.summary().text("ordering")
    );
    same_history("PORD and METIS", &pord.history(), &metis.history(), TOLERANCE);
}

#[test]
fn every_line_search_gives_the_same_history() {
    let scenes: [fn() -> Launch; 3] = [scenes::shear_layer, scenes::curved_cantilever, scenes::block];
    for scene in scenes {
        let usual = scene().run().completed().history();
        for search in ["bt", "l2", "basic"] {
            let run = scene()
                .petsc(&format!("-snes_linesearch_type {search}"))
                .run()
                .completed();
            same_history(search, &run.history(), &usual, TOLERANCE);
        }
    }
}

#[test]
fn an_iterative_solver_gives_the_same_history() {
    let direct = scenes::block().run().completed().history();
    for (name, options) in [
        (
            "GMRES with block Jacobi",
            "-ksp_type gmres -pc_type bjacobi -ksp_rtol 1e-12 -ksp_max_it 2000",
        ),
        (
            "GMRES with GAMG",
            "-mat_type aij -ksp_type gmres -pc_type gamg -ksp_diagonal_scale -ksp_rtol 1e-12 -ksp_max_it 2000",
        ),
    ] {
        let run = scenes::block().ranks(2).petsc(options).run().completed();
        let used = run.summary().text("ordering").to_owned();
        assert!(!used.contains("MUMPS"), "{name}: the summary names {used}");
        same_history(name, &run.history(), &direct, TOLERANCE);
    }
}

/// The iterative solver of the file, alone and on two ranks.
#[test]
fn the_iterative_method_gives_the_same_history() {
    let direct = scenes::block().run().completed().history();
    for ranks in [1, 2] {
        let run = scenes::block()
            .set(&["solver.method=iterative"])
            .ranks(ranks)
            .run()
            .completed();
        let used = run.summary().text("ordering").to_owned();
        assert!(!used.contains("MUMPS"), "the summary names {used}");
        same_history("iterative", &run.history(), &direct, 1e-6);
    }
}

/// Whether the ranks share a factorisation or each does all of it: an answer, and who gave it.
#[test]
fn shared_and_redundant_factorisations_give_the_same_history() {
    let alone = scenes::softening_column().run().completed().history();
    for (choice, everywhere) in [("auto", true), ("always", true), ("never", false)] {
        let setting = format!("solver.repeatable={choice}");
        let run = scenes::softening_column().set(&[&setting]).ranks(3).run().completed();
        let used = run.summary().text("ordering").to_owned();
        assert!(used.starts_with("MUMPS lu, "), "{choice}: {used}");
        assert_eq!(used.ends_with(", on every rank"), everywhere, "{choice}: {used}");
        same_path(choice, &run.history(), &alone, TOLERANCE);
    }
}

/// A matrix that the rank factorises on its own takes the user's options for MUMPS and his preconditioner.
#[test]
fn options_reach_the_factorisation_on_every_rank() {
    let block = || scenes::block().set(&["solver.repeatable=always"]).ranks(2);
    let pord = block().petsc("-mat_mumps_icntl_7 4").run().completed();
    assert_eq!(pord.summary().text("ordering"), "MUMPS lu, PORD, on every rank");
    let shared = block().petsc("-pc_type lu").run().completed();
    assert!(!shared.summary().text("ordering").contains("every rank"));
}
