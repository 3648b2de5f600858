//! The cases: each is one rank of a run. A failed assertion is a panic, which ends all ranks.

use std::process::ExitCode;
use std::rc::Rc;
use std::time::Instant;

use mpm_petsc::parallel::World;
use mpm_petsc::petsc::{
    BlockMatrix, End, Evaluate, GhostVector, Graph, Iteration, Layout, LogStage, MatrixFormat, Newton, NewtonOptions,
    Nonlinear, Partitioner, PetscError, PetscInt, Session, SolveError, Verdict, agree, partition,
};

use crate::problem::{BLOCK, Lattice, Poisson};

/// Runs the case of this name.
pub fn run(name: &str, options: &[String]) -> ExitCode {
    let world = World::start().expect("MPI starts once");
    if name == "world" {
        communication(&world);
        return ExitCode::SUCCESS;
    }
    if name == "refused" {
        let error = Session::start(&world, options)
            .err()
            .expect("PETSc refuses the options");
        println!("{error}");
        return ExitCode::SUCCESS;
    }
    let session = Session::start(&world, options).expect("PETSc starts");
    match name {
        "ghosts" => ghosts(&session),
        "matrix" => matrix(&session),
        "poisson" => poisson(&session, Lattice::new(&world, 12)),
        "empty rank" => poisson(&session, Lattice::on_first_ranks(&world, 12, world.size() - 1)),
        "repeat" => repeat(&session),
        "domain" => domain(&session, options),
        "failures" => failures(&session),
        "answers" => answers(&session),
        "panic" => panic(&session),
        "iterative" => iterative(&session),
        "partition" => partitions(&session),
        "log" => log(&session),
        "options" => unused_options(&session),
        other => panic!("no case `{other}`"),
    }
    ExitCode::SUCCESS
}

fn communication(world: &World) {
    let (rank, size) = (world.rank(), world.size());
    assert!(World::start().is_none(), "MPI starts once");
    assert_eq!(world.sum(rank + 1), size * (size + 1) / 2);
    assert_eq!(world.max_of(rank as f64), (size - 1) as f64);
    assert_eq!(world.min_of(rank as f64), 0.0);
    let mut values = [rank as f64, 1.0];
    world.sum_slice(&mut values);
    assert_eq!(values, [(size * (size - 1) / 2) as f64, size as f64]);
    assert_eq!(world.exclusive_scan(rank + 1), rank * (rank + 1) / 2);
    assert!(world.all_ok(true));
    assert!(!world.all_ok(rank != 0));
    assert!(world.any(rank + 1 == size));
    let agreed = world.agree(if rank + 1 == size { Err(rank) } else { Ok(()) }, |rank| rank);
    assert_eq!(agreed, Err(size - 1));
    // What MPI does not count in one message is sent in several.
    for largest in [1 << 30, 1000, 40, 1] {
        lists(&world.clone().with_messages_of(largest));
    }
    world.barrier();
}

fn lists(world: &World) {
    let (rank, size) = (world.rank(), world.size());
    // Rank r sends r + s numbers to rank s.
    let outgoing: Vec<Vec<f64>> = (0..size).map(|to| vec![(10 * rank + to) as f64; rank + to]).collect();
    let incoming = world.exchange(&outgoing);
    let expected: Vec<Vec<f64>> = (0..size)
        .map(|from| vec![(10 * from + rank) as f64; rank + from])
        .collect();
    assert_eq!(incoming, expected);
    // Bytes from the last rank alone: most lists are empty.
    let last = size - 1;
    let bytes = if rank == last { b"last".to_vec() } else { Vec::new() };
    assert_eq!(world.exchange(&vec![bytes.clone(); size])[last], b"last");
    assert_eq!(
        world.gather(&bytes).map(|all| all.concat()),
        (rank == 0).then(|| b"last".to_vec())
    );
    let list = |rank: usize| (0..7 * rank as u64).map(|k| 1000 * rank as u64 + k).collect::<Vec<_>>();
    let everything: Vec<Vec<u64>> = (0..size).map(list).collect();
    assert_eq!(world.gather(&list(rank)), (rank == 0).then_some(everything));
    assert_eq!(world.broadcast_text(if rank == 0 { "Grüße" } else { "" }), "Grüße");
    assert_eq!(
        world.text_from(last, if rank == last { "viele Grüße" } else { "" }),
        "viele Grüße"
    );
    let mut values: Vec<u64> = (0..11).map(|k| rank as u64 + k).collect();
    world.max_slice(&mut values);
    assert_eq!(values, (0..11).map(|k| last as u64 + k).collect::<Vec<_>>());
}

fn ghosts(session: &Rc<Session>) {
    let world = session.world();
    let lattice = Lattice::new(world, 7);
    let layout = lattice.layout();
    let mut vector = GhostVector::new(session, &layout).expect("a vector");
    for round in 0..2 {
        let value = |node: usize, c: usize| (round * 1000 + BLOCK * node + c) as f64;
        for (i, node) in lattice.range().enumerate() {
            for c in 0..BLOCK {
                vector.owned_mut()[BLOCK * i + c] = value(node, c);
            }
        }
        vector.update_ghosts().expect("an exchange");
        for (i, &ghost) in layout.ghosts.iter().enumerate() {
            for c in 0..BLOCK {
                assert_eq!(
                    vector.local()[layout.owned_length() + BLOCK * i + c],
                    value(ghost as usize, c)
                );
            }
        }
        // Every rank that sees a node adds one to it.
        vector.local_mut().fill(1.0);
        vector.add_to_owners().expect("an exchange");
        let all: Vec<f64> = layout.ghosts.iter().map(|&ghost| ghost as f64).collect();
        let seen = world.broadcast(&world.gather(&all).unwrap_or_default().concat());
        for (i, node) in lattice.range().enumerate() {
            let viewers = seen.iter().filter(|&&ghost| ghost == node as f64).count();
            assert_eq!(vector.owned()[BLOCK * i], (1 + viewers) as f64);
        }
    }
}

fn matrix(session: &Rc<Session>) {
    let lattice = Lattice::new(session.world(), 6);
    let nodes = (lattice.side * lattice.side) as PetscInt;
    for format in [MatrixFormat::Block, MatrixFormat::Scalar] {
        let mut problem = Poisson::new(lattice.clone());
        let mut k = lattice.matrix(session, format);
        let mut u = GhostVector::new(session, &lattice.layout()).expect("a vector");
        u.local_mut().fill(0.5);
        for _ in 0..2 {
            k.zero().expect("zeroed");
            problem.jacobian(u.local(), &mut k).expect("a tangent");
            k.assemble().expect("assembled");
        }
        // K times ones: the Laplacian is the flow to boundary nodes, the rest is 3 u² and the identity.
        let product = k.multiply(&vec![1.0; BLOCK * lattice.owned]).expect("a product");
        for (i, node) in lattice.range().enumerate() {
            let outflow = lattice
                .neighbours(node)
                .iter()
                .filter(|&&other| lattice.on_boundary(other))
                .count() as f64;
            let expected = if lattice.on_boundary(node) {
                1.0
            } else {
                25.0 * outflow + 0.75
            };
            for c in 0..BLOCK {
                assert!(
                    (product[BLOCK * i + c] - expected).abs() < 1e-12,
                    "{} {expected}",
                    product[BLOCK * i + c]
                );
            }
        }
        // Only the coupling of components is unsymmetric: three pairs of -0.3 per inner node.
        let inner = 16.0;
        let skew = (inner * 6.0 * 0.09_f64).sqrt();
        assert!((k.asymmetry().expect("an asymmetry") * k.norm().expect("a norm") - skew).abs() < 1e-10);
        assert!(k.nonzeros().expect("a count") > 0);
        let rows = [lattice.first as PetscInt];
        let far = [(rows[0] + nodes / 2 + 1) % nodes];
        if lattice.owned > 0 {
            let error = k
                .add_blocks(&rows, &far, &[1.0; BLOCK * BLOCK])
                .expect_err("no room for this block");
            assert!(error.message.contains("nonzero"), "{error}");
        }
    }
}

fn solver(session: &Rc<Session>, lattice: &Lattice) -> Newton {
    let format = session.matrix_format().expect("a format");
    let matrix = lattice.matrix(session, format);
    Newton::new(
        session,
        &lattice.layout(),
        matrix,
        &NewtonOptions {
            max_iterations: 30,
            ..NewtonOptions::default()
        },
    )
    .expect("a solver")
}

/// Newton converges quadratically: each of the last residuals is bounded by the square of the one before.
fn assert_quadratic(norms: &[f64]) {
    let fast = norms.windows(2).filter(|pair| pair[0] < 10.0 && pair[1] > 1e-10);
    assert!(fast.clone().count() >= 1, "{norms:?}");
    for pair in fast {
        assert!(pair[1] <= 0.1 * pair[0] * pair[0], "{norms:?}");
    }
}

fn poisson(session: &Rc<Session>, lattice: Lattice) {
    let mut newton = solver(session, &lattice);
    let mut problem = Poisson::new(lattice.clone());
    let mut u = vec![0.0; BLOCK * lattice.owned];
    let outcome = newton.solve(&mut problem, &mut u).expect("no error");
    assert_eq!(outcome.end, End::Converged, "{outcome:?}");
    assert_eq!(outcome.iterations + 1, problem.norms.len());
    assert_eq!(outcome.iterations, problem.updates_seen);
    assert!(outcome.evaluated_at_solution);
    assert_quadratic(&problem.norms);
    let ordering = newton.ordering_used().expect("an ordering");
    if let Some(all) = session.world().gather(&u) {
        let numbers: Vec<String> = all.concat().iter().map(|value| format!("{value:e}")).collect();
        println!("ordering: {ordering}");
        println!("norms: {:?}", problem.norms);
        println!("solution: {}", numbers.join(" "));
    }
}

/// One solver over several loads, an opening linear solve, and a new numbering.
fn repeat(session: &Rc<Session>) {
    let lattice = Lattice::new(session.world(), 8);
    let mut newton = solver(session, &lattice);
    let mut u = vec![0.0; BLOCK * lattice.owned];
    let mut final_norms = Vec::new();
    for load in [10.0, 20.0, 40.0] {
        let mut problem = Poisson::new(lattice.clone());
        problem.load = load;
        // Opening solve with the tangent at the last solution: K x = K 1 has the solution 1.
        let mut ghosted = GhostVector::new(session, &lattice.layout()).expect("a vector");
        ghosted.owned_mut().copy_from_slice(&u);
        ghosted.update_ghosts().expect("an exchange");
        newton.matrix_mut().zero().expect("zeroed");
        problem
            .jacobian(ghosted.local(), newton.matrix_mut())
            .expect("a tangent");
        newton.matrix_mut().assemble().expect("assembled");
        let rhs = newton.matrix().multiply(&vec![1.0; u.len()]).expect("a product");
        let mut x = vec![0.0; u.len()];
        let linear = newton.linear_solve(&rhs, &mut x).expect("no error");
        assert!(linear.converged, "{linear:?}");
        assert!(x.iter().all(|value| (value - 1.0).abs() < 1e-10));
        let outcome = newton.solve(&mut problem, &mut u).expect("no error");
        assert_eq!(outcome.end, End::Converged, "{outcome:?}");
        assert_quadratic(&problem.norms);
        final_norms.push(outcome.residual_norm);
    }
    assert!(final_norms.iter().all(|&norm| norm < 1e-9));
    let smaller = Lattice::new(session.world(), 5);
    let mut newton = solver(session, &smaller);
    let mut problem = Poisson::new(smaller.clone());
    let mut u = vec![0.0; BLOCK * smaller.owned];
    let outcome = newton.solve(&mut problem, &mut u).expect("no error");
    assert_eq!(outcome.end, End::Converged, "{outcome:?}");
    assert!(outcome.iterations <= 8, "no old state in the way: {outcome:?}");
}

/// The full Newton step leaves the domain on one rank only. Whatever the line search does, all ranks end alike.
fn domain(session: &Rc<Session>, options: &[String]) {
    let lattice = Lattice::new(session.world(), 12);
    let mut newton = solver(session, &lattice);
    let mut problem = Poisson::new(lattice.clone());
    // The solution stays below the cube root of the largest load, 7.2; the first Newton step overshoots to about 20.
    problem.load = 120.0;
    problem.ceiling = if session.world().rank() == 0 {
        7.5
    } else {
        f64::INFINITY
    };
    let mut u = vec![0.0; BLOCK * lattice.owned];
    let outcome = newton.solve(&mut problem, &mut u).expect("no error");
    // Backtracking shortens the step; the others give up, and the load step must be cut.
    let shortens = options.iter().any(|word| word == "bt" || word == "l2");
    assert_eq!(
        outcome.end,
        if shortens { End::Converged } else { End::OutOfDomain },
        "{outcome:?}"
    );
    assert_eq!(
        outcome.end == End::OutOfDomain,
        u.iter().all(|&value| value == 0.0),
        "a failed solve changes nothing"
    );
    assert_eq!(session.world().broadcast_text(&outcome.reason), outcome.reason);
    // Out of the domain from the start.
    problem.ceiling = -1.0;
    problem.norms.clear();
    let mut u = vec![0.0; BLOCK * lattice.owned];
    let outcome = newton.solve(&mut problem, &mut u).expect("no error");
    assert_eq!((outcome.end, outcome.iterations), (End::OutOfDomain, 0), "{outcome:?}");
    // And back: the solver is as good as new.
    problem.ceiling = f64::INFINITY;
    problem.load = 10.0;
    problem.norms.clear();
    let outcome = newton.solve(&mut problem, &mut u).expect("no error");
    assert_eq!(outcome.end, End::Converged, "{outcome:?}");
}

/// A problem that goes wrong in a given way.
struct Broken {
    inner: Poisson,
    kind: Failure,
    rank: usize,
}

#[derive(Clone, Copy, PartialEq)]
enum Failure {
    Residual,
    Jacobian,
    JacobianDomain,
    NanResidual,
    NanMatrix,
    SingularMatrix,
    Verdict,
    Panic,
}

impl Nonlinear for Broken {
    fn residual(&mut self, u: &[f64], r: &mut [f64]) -> Result<(), Evaluate> {
        self.inner.residual(u, r)?;
        match self.kind {
            Failure::Residual if self.rank == 0 => Err(failed("no such material")),
            Failure::NanResidual if self.inner.evaluations > 1 => {
                r.fill(f64::NAN);
                Ok(())
            }
            _ => Ok(()),
        }
    }

    fn complete(&mut self, r: &mut [f64]) -> Result<(), Evaluate> {
        self.inner.complete(r)
    }

    fn jacobian(&mut self, u: &[f64], k: &mut BlockMatrix) -> Result<(), Evaluate> {
        match self.kind {
            Failure::Jacobian if self.rank == 0 => return Err(failed("no such tangent")),
            Failure::JacobianDomain if self.rank == 0 => return Err(Evaluate::OutOfDomain),
            Failure::SingularMatrix => return Ok(()),
            Failure::Panic if self.rank == 0 => panic!("the material law has a bug"),
            _ => {}
        }
        self.inner.jacobian(u, k)?;
        if self.kind == Failure::NanMatrix && self.rank == 0 {
            k.add_diagonal(self.inner.lattice.first as PetscInt + 1, 0, f64::NAN)?;
        }
        Ok(())
    }

    fn test(&mut self, iteration: &Iteration<'_>) -> Verdict {
        if self.kind == Failure::Verdict && iteration.number == 1 {
            return Verdict::Diverged;
        }
        self.inner.test(iteration)
    }
}

fn failed(message: &str) -> Evaluate {
    Evaluate::Failed(SolveError::Evaluation(message.into()))
}

fn broken(session: &Rc<Session>, lattice: &Lattice, kind: Failure) -> Broken {
    // The last rank is the one that fails.
    let rank = session.world().size() - 1 - session.world().rank();
    Broken {
        inner: Poisson::new(lattice.clone()),
        kind,
        rank,
    }
}

/// What a smaller step may mend is an outcome; the rest is an error, on all ranks.
fn failures(session: &Rc<Session>) {
    let lattice = Lattice::new(session.world(), 6);
    let mut newton = solver(session, &lattice);
    let start = vec![0.0; BLOCK * lattice.owned];
    let mild = [
        Failure::NanResidual,
        Failure::NanMatrix,
        Failure::SingularMatrix,
        Failure::Verdict,
    ];
    for kind in mild {
        let mut u = start.clone();
        let outcome = newton
            .solve(&mut broken(session, &lattice, kind), &mut u)
            .expect("no error");
        assert_eq!(outcome.end, End::NotConverged, "{} {outcome:?}", kind as u8);
        assert_eq!(u, start);
        let outcome = newton
            .solve(&mut Poisson::new(lattice.clone()), &mut u)
            .expect("no error");
        assert_eq!(outcome.end, End::Converged, "after failure {}: {outcome:?}", kind as u8);
    }
    let at = match session.world().size() {
        1 => String::new(),
        size => format!("rank {}: ", size - 1),
    };
    let severe = [
        (Failure::Residual, format!("{at}no such material")),
        (Failure::Jacobian, format!("{at}no such tangent")),
        (Failure::JacobianDomain, "the derivative does not exist".to_owned()),
    ];
    for (kind, expected) in severe {
        let mut newton = solver(session, &lattice);
        let mut problem = broken(session, &lattice, kind);
        let error = newton.solve(&mut problem, &mut start.clone()).expect_err("an error");
        let SolveError::Evaluation(message) = error else {
            panic!("{error}")
        };
        assert!(message.starts_with(&expected), "{message}");
    }
}

/// The worst answer of any rank becomes that of all, with its kind and the message of the rank that failed.
fn answers(session: &Rc<Session>) {
    let world = session.world();
    let (last, size) = (world.rank() + 1 == world.size(), world.size());
    let short = PetscError {
        code: 55,
        message: "too much was asked for".into(),
    };
    let wrong = PetscError {
        code: 63,
        message: "no room for this block".into(),
    };
    let told = |words: &str| match size {
        1 => words.to_owned(),
        _ => format!("rank {}: {words}", size - 1),
    };
    let cases = [
        (Ok(()), Ok(())),
        (Err(Evaluate::OutOfDomain), Err(Evaluate::OutOfDomain)),
        (
            Err(wrong.into()),
            Err(failed(&told("PETSc error 63: no room for this block"))),
        ),
        (
            Err(short.into()),
            Err(Evaluate::Failed(SolveError::Memory(told(
                "there is not enough memory: too much was asked for",
            )))),
        ),
    ];
    for (own, expected) in cases {
        let mine = if last { own } else { Ok(()) };
        assert_eq!(agree(world, mine), expected);
    }
    // An error counts more than a point outside the domain of its law.
    let mine = if last {
        Err(failed("worse"))
    } else {
        Err(Evaluate::OutOfDomain)
    };
    assert_eq!(agree(world, mine), Err(failed(&told("worse"))));
}

fn panic(session: &Rc<Session>) {
    let lattice = Lattice::new(session.world(), 6);
    let mut newton = solver(session, &lattice);
    let mut problem = broken(session, &lattice, Failure::Panic);
    let mut u = vec![0.0; BLOCK * lattice.owned];
    let outcome = newton.solve(&mut problem, &mut u);
    println!("the solve came back: {outcome:?}");
}

/// Algebraic multigrid with GMRES (`-pc_type gamg`) gets scalar storage and the near null space, and does what LU does.
fn iterative(session: &Rc<Session>) {
    assert_eq!(session.matrix_format().expect("a format"), MatrixFormat::Scalar);
    let lattice = Lattice::new(session.world(), 30);
    let mut matrix = lattice.matrix(session, MatrixFormat::Scalar);
    let mode = |c: usize| {
        (0..BLOCK * lattice.owned)
            .map(|i| f64::from(u8::from(i % BLOCK == c)))
            .collect()
    };
    // The sum of the others depends on them and must be left out.
    let mut modes: Vec<Vec<f64>> = (0..BLOCK).map(mode).collect();
    modes.push(vec![1.0; BLOCK * lattice.owned]);
    matrix.set_near_null_space(&modes).expect("a near null space");
    let options = NewtonOptions {
        max_iterations: 30,
        ..NewtonOptions::default()
    };
    let mut newton = Newton::new(session, &lattice.layout(), matrix, &options).expect("a solver");
    let mut u = vec![0.0; BLOCK * lattice.owned];
    let outcome = newton
        .solve(&mut Poisson::new(lattice.clone()), &mut u)
        .expect("no error");
    assert_eq!(outcome.end, End::Converged, "{outcome:?}");
    assert!(
        outcome.linear_iterations > outcome.iterations,
        "more than one iteration a system: {outcome:?}"
    );
    assert!(
        outcome.linear_iterations < 25 * outcome.iterations,
        "multigrid works: {outcome:?}"
    );
    assert_eq!(newton.ordering_used().expect("a text"), "gamg, no factorisation");
}

/// A lattice graph in balanced parts, also from ranks without vertices.
fn partitions(session: &Rc<Session>) {
    assert!(session.world().is_thread_safe(), "PT-Scotch needs it");
    for partitioner in [Partitioner::Metis, Partitioner::PtScotch, Partitioner::Auto] {
        for all_on_last in [false, true] {
            balanced(session, partitioner, all_on_last);
        }
        fewer_vertices_than_parts(session, partitioner);
    }
    if let Err(error) = partition(session, &lattice_graph(session, 8, false), 2, Partitioner::ParMetis) {
        assert!(
            error.message.contains("`parmetis`; available: auto, metis, ptscotch"),
            "{error}"
        );
    }
}

/// The graph of a lattice; its vertices dealt out, or all on the last rank.
fn lattice_graph(session: &Rc<Session>, side: usize, all_on_last: bool) -> Graph {
    let mut lattice = Lattice::new(session.world(), side);
    if all_on_last {
        let last = session.world().rank() + 1 == session.world().size();
        (lattice.first, lattice.owned) = if last { (0, side * side) } else { (0, 0) };
    }
    let mut graph = Graph {
        first: lattice.first,
        offsets: vec![0],
        neighbours: Vec::new(),
        vertex_weights: vec![1; lattice.owned],
    };
    for node in lattice.range() {
        graph
            .neighbours
            .extend(lattice.neighbours(node).iter().map(|&other| other as PetscInt));
        graph.offsets.push(graph.neighbours.len() as PetscInt);
        // The first row is three times as heavy.
        if node < side {
            graph.vertex_weights[node - lattice.first] = 3;
        }
    }
    graph
}

fn balanced(session: &Rc<Session>, partitioner: Partitioner, all_on_last: bool) {
    let world = session.world();
    let side = 24;
    let graph = lattice_graph(session, side, all_on_last);
    for parts in [1, 2, 3, 5] {
        let answer = partition(session, &graph, parts, partitioner).expect("a partition");
        assert_eq!(answer.len(), graph.vertices());
        let mut weights = vec![0.0; parts];
        for (&part, &weight) in answer.iter().zip(&graph.vertex_weights) {
            weights[part] += weight as f64;
        }
        world.sum_slice(&mut weights);
        let mean = (side * side + 2 * side) as f64 / parts as f64;
        assert!(
            weights.iter().all(|&weight| (weight / mean - 1.0).abs() < 0.12),
            "{partitioner} {weights:?}"
        );
        // A cut as long as a few sides, not a scatter of vertices.
        let all = world.broadcast(&world.gather(&answer).unwrap_or_default().concat());
        let lattice = Lattice::new(world, side);
        let cut: usize = lattice
            .range()
            .map(|node| {
                lattice
                    .neighbours(node)
                    .iter()
                    .filter(|&&other| all[other] != all[node])
                    .count()
            })
            .sum();
        assert!(
            world.sum(cut) / 2 <= side * parts,
            "{partitioner} cuts {cut} edges into {parts} parts"
        );
        if partitioner != Partitioner::PtScotch {
            let again = partition(session, &graph, parts, partitioner).expect("a partition");
            assert_eq!(answer, again, "{partitioner}: every time the same");
        }
    }
}

fn fewer_vertices_than_parts(session: &Rc<Session>, partitioner: Partitioner) {
    let graph = lattice_graph(session, 2, true);
    let parts = partition(session, &graph, 6, partitioner).expect("a partition");
    assert!(parts.is_empty() || parts == [0, 1, 2, 3]);
    let none = Graph {
        first: 0,
        offsets: vec![0],
        neighbours: Vec::new(),
        vertex_weights: Vec::new(),
    };
    assert!(
        partition(session, &none, 2, partitioner)
            .expect("a partition")
            .is_empty()
    );
}

/// Factorisation and solve are told apart, and stages nest.
fn log(session: &Rc<Session>) {
    let stage = LogStage::new(session, "equilibrium").expect("a stage");
    let again = LogStage::new(session, "equilibrium").expect("the same stage");
    let before = session.phase_seconds().expect("times");
    let begin = Instant::now();
    {
        let _outer = stage.enter().expect("entered");
        let _inner = again.enter().expect("entered");
        let lattice = Lattice::new(session.world(), 60);
        let mut newton = solver(session, &lattice);
        let mut u = vec![0.0; BLOCK * lattice.owned];
        newton
            .solve(&mut Poisson::new(lattice.clone()), &mut u)
            .expect("no error");
    }
    let after = session.phase_seconds().expect("times");
    let (factorisation, solve) = (after.factorisation - before.factorisation, after.solve - before.solve);
    let all = begin.elapsed().as_secs_f64();
    println!("factorisation {factorisation} s, solve {solve} s, of {all} s");
    assert!(factorisation > 0.0 && solve > 0.0);
    // On a busy machine ranks wait for each other in either.
    assert!(
        factorisation + solve < all,
        "the solve does not contain the factorisation"
    );
}

fn unused_options(session: &Rc<Session>) {
    poisson(session, Lattice::new(session.world(), 12));
    assert_eq!(session.unused_options().expect("a list"), ["-ksp_typo 3"]);
    assert_eq!(session.version().split('.').count(), 3);
    assert!(Session::start(session.world(), &[]).is_err(), "PETSc starts once");
    let layout = Layout {
        block: 1,
        owned: 1,
        first: 0,
        ghosts: vec![7],
    };
    let error = GhostVector::new(session, &layout).err().expect("no such node");
    assert!(error.code != 0 && !error.message.is_empty(), "{error}");
}
