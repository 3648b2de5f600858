//! One attempt at a step of a given length along the path: Newton's method on equilibrium and length together.
//!
//! With the load factor as an unknown,
//!
//! $$ r(u) - \lambda f = 0, \qquad \langle u, u \rangle = l^2, $$
//!
//! every iteration solves for two directions with one factorisation, `K a = -r` and `K b = f`, and goes by
//! `a + d b` with the change `d` of the load factor that the length asks for: docs/theory.md, "Equilibrium paths".

use super::attempt::{Approach, Search, Solution, Solver, Tried, limit_reached, not_evaluated, settle, stagnated};
use super::equilibrium::Equilibrium;
use super::failure::{Cause, Failure};
use crate::assembly::motion::{Measure, PointMotion};
use crate::continuum::{Fields, Linearisation};
use crate::error::Error;
use crate::petsc::{Evaluate, GhostVector, Iteration, Nonlinear, PetscError, Session, SolveError, Verdict};
use std::rc::Rc;

/// What a step of given length needs beside the problem.
pub struct LengthStep {
    /// External forces on own unknowns that do not change in the stage.
    pub fixed: Vec<f64>,
    /// What the load factor multiplies.
    pub growing: Vec<f64>,
    /// Load factor at the start.
    pub start: f64,
    /// Length of the step [m].
    pub length: f64,
    pub measure: Measure,
    /// Motion in the step of the stage before; `None` in the first one.
    pub before: Option<PointMotion>,
    pub approach: Approach,
}

/// Shares of a Newton step that are tried in turn until the residual falls.
const BACKTRACKING_SHARES: [f64; 4] = [1.0, 0.5, 0.25, 0.125];

/// The share that is taken where it falls for none of them.
const SMALLEST_SHARE: f64 = 0.0625;

/// A solution may be so many times as long or as short as was asked for: it lies on the path whatever its length.
const LENGTH_MARGIN: f64 = 2.0;

/// Solves a step of given length from the accepted state of the points, which stays as it is.
pub fn try_length<C: Fields<D, N>, const D: usize, const N: usize>(
    session: &Rc<Session>,
    solver: &mut Solver,
    problem: Equilibrium<'_, C, D, N>,
    step: &LengthStep,
) -> Result<Tried, Error> {
    let owned = solver.layout.owned_length();
    let mut attempt = LengthAttempt {
        session,
        local: GhostVector::new(session, &solver.layout)?,
        forces: GhostVector::new(session, &solver.layout)?,
        solver,
        problem,
        step,
        residual: vec![0.0; owned],
        flowed_on: false,
    };
    let end = match attempt.solve() {
        Ok(solution) => Ok(solution),
        Err(Halt::Failure(failure)) => Err(Failure {
            flowed_on: attempt.flowed_on,
            ..failure
        }),
        Err(Halt::Error(error)) => return Err(error),
    };
    Ok(Tried {
        end,
        records: attempt.problem.records,
        interrupted: attempt.problem.interrupted,
    })
}

/// Why an attempt stops.
enum Halt {
    Failure(Failure),
    Error(Error),
}

impl From<Error> for Halt {
    fn from(error: Error) -> Self {
        Halt::Error(error)
    }
}

impl From<PetscError> for Halt {
    fn from(error: PetscError) -> Self {
        Halt::Error(error.into())
    }
}

impl From<SolveError> for Halt {
    fn from(error: SolveError) -> Self {
        Halt::Error(error.into())
    }
}

impl From<Failure> for Halt {
    fn from(failure: Failure) -> Self {
        Halt::Failure(failure)
    }
}

/// A state on the way to the solution.
#[derive(Clone)]
struct Iterate {
    /// Increments of own unknowns.
    increments: Vec<f64>,
    motion: PointMotion,
    load_factor: f64,
}

impl Iterate {
    /// The state that a share of a change leads to.
    fn moved(&self, share: f64, change: &Iterate) -> Self {
        let mut moved = self.clone();
        let own = moved.increments.iter_mut().zip(&change.increments);
        own.for_each(|(own, change)| *own += share * change);
        moved.motion.add(share, &change.motion);
        moved.load_factor += share * change.load_factor;
        moved
    }

    /// The change with a share of its increments: what tests of convergence look at.
    fn scaled(&self, share: f64) -> Self {
        let mut scaled = self.clone();
        scaled.increments.iter_mut().for_each(|change| *change *= share);
        scaled
    }
}

/// Solutions with the tangent at an iterate.
struct Directions {
    /// Where the residual drives the unknowns.
    correction: Iterate,
    /// What a unit of load does.
    response: Iterate,
}

impl Directions {
    /// The step with a given change of the load factor.
    fn with_load(&self, change: f64) -> Iterate {
        Iterate {
            load_factor: change,
            ..self.correction.moved(change, &self.response)
        }
    }
}

struct LengthAttempt<'a, 'p, C: Fields<D, N>, const D: usize, const N: usize> {
    session: &'a Rc<Session>,
    solver: &'a mut Solver,
    problem: Equilibrium<'p, C, D, N>,
    step: &'a LengthStep,
    /// Local unknowns of the last evaluation.
    local: GhostVector,
    forces: GhostVector,
    /// On own unknowns, of the last evaluation.
    residual: Vec<f64>,
    /// Whether points flowed on in the tangent of the opening; the same on every rank.
    flowed_on: bool,
}

impl<C: Fields<D, N>, const D: usize, const N: usize> LengthAttempt<'_, '_, C, D, N> {
    fn solve(&mut self) -> Result<Solution, Halt> {
        let mut at = self.beginning();
        self.evaluate(&at).map_err(repeats)?;
        if self.problem.interrupted {
            return Err(Failure::plain("the run was asked to stop".into()).into());
        }
        let directions = self.directions(&at, self.step.approach.opening).map_err(repeats)?;
        let mut change = self.opening(&directions).map_err(repeats)?;
        let forward = self.step.before.clone().unwrap_or(directions.response.motion);
        at = at.moved(1.0, &change);
        self.evaluate(&at)?;
        for number in 0..=self.problem.settings.max_iterations {
            let verdict = self.problem.test(&Iteration {
                number,
                residual: &self.residual,
                update: (number > 0).then_some(&change.increments),
                residual_norm: self.residual_norm(),
            });
            match verdict {
                Verdict::Converged => return self.finish(&at, &forward),
                Verdict::Stagnates => return Err(stagnated(&self.problem).into()),
                Verdict::Diverged => return Err(not_converged("the residual is not a number").into()),
                Verdict::Continue if number == self.problem.settings.max_iterations => break,
                Verdict::Continue => {}
            }
            let directions = self.directions(&at, Linearisation::Consistent)?;
            change = self.correction(&at, &directions)?;
            (at, change) = self.search(&at, &change)?;
        }
        Err(limit_reached(&self.problem).into())
    }

    /// The accepted state.
    fn beginning(&self) -> Iterate {
        let zero = vec![0.0; self.solver.layout.local_length()];
        Iterate {
            increments: vec![0.0; self.solver.layout.owned_length()],
            motion: self.motion(&zero),
            load_factor: self.step.start,
        }
    }

    fn motion(&self, local: &[f64]) -> PointMotion {
        let system = self.problem.system;
        let measure = &self.step.measure;
        measure.of_increments::<C, D, N>(&system.batches, &system.active, local)
    }

    /// Residual at an iterate.
    fn evaluate(&mut self, at: &Iterate) -> Result<(), Halt> {
        let loads = self.step.fixed.iter().zip(&self.step.growing);
        for (external, (fixed, growing)) in self.problem.external.iter_mut().zip(loads) {
            *external = fixed + at.load_factor * growing;
        }
        self.local.owned_mut().copy_from_slice(&at.increments);
        self.local.update_ghosts()?;
        self.forces.local_mut().fill(0.0);
        let evaluated = self.problem.residual(self.local.local(), self.forces.local_mut());
        self.require(evaluated)?;
        self.forces.add_to_owners()?;
        self.residual.copy_from_slice(self.forces.owned());
        let completed = self.problem.complete(&mut self.residual);
        self.require(completed)
    }

    fn require(&self, evaluated: Result<(), Evaluate>) -> Result<(), Halt> {
        match not_evaluated(evaluated, &self.problem)? {
            None => Ok(()),
            Some(failure) => Err(Failure {
                search_matters: true,
                ..failure
            }
            .into()),
        }
    }

    fn residual_norm(&self) -> f64 {
        let own: f64 = self.residual.iter().map(|r| r * r).sum();
        self.problem.world.sum(own).sqrt()
    }

    /// Both solutions with the tangent at the iterate that was evaluated last.
    fn directions(&mut self, at: &Iterate, linearisation: Linearisation) -> Result<Directions, Halt> {
        let matrix = self.solver.newton.matrix_mut();
        matrix.zero()?;
        self.local.owned_mut().copy_from_slice(&at.increments);
        self.local.update_ghosts()?;
        let unknowns = self.local.local();
        let added = self.problem.add_tangent(unknowns, linearisation, matrix, None);
        self.flowed_on |= self.problem.world.any(*added.as_ref().unwrap_or(&false));
        self.require(added.map(drop))?;
        self.solver.newton.matrix_mut().assemble()?;
        let mask = &self.problem.prescribed.mask;
        let free = |values: &[f64], sign: f64| -> Vec<f64> {
            let values = values.iter().zip(mask);
            values
                .map(|(value, held)| if *held { 0.0 } else { sign * value })
                .collect()
        };
        let (correction, response) = (free(&self.residual, -1.0), free(&self.step.growing, 1.0));
        Ok(Directions {
            correction: self.direction(&correction, true)?,
            response: self.direction(&response, false)?,
        })
    }

    /// The solution of one linear system; `fresh` where its matrix has not been factorised yet.
    fn direction(&mut self, right_hand_side: &[f64], fresh: bool) -> Result<Iterate, Halt> {
        let mut increments = vec![0.0; right_hand_side.len()];
        let newton = &mut self.solver.newton;
        let solved = match fresh {
            true => newton.linear_solve(right_hand_side, &mut increments)?,
            false => newton.linear_solve_again(right_hand_side, &mut increments)?,
        };
        if !solved.converged {
            return Err(Failure {
                cause: if solved.singular { Cause::Singular } else { Cause::Other },
                linear: true,
                search_matters: true,
                ..Failure::plain(solved.reason)
            }
            .into());
        }
        self.local.owned_mut().copy_from_slice(&increments);
        self.local.update_ghosts()?;
        Ok(Iterate {
            motion: self.motion(self.local.local()),
            increments,
            load_factor: 0.0,
        })
    }

    /// The first step, of exactly the length: of its two solutions the one that goes on in the direction of the step
    /// before, or without one towards more load.
    fn opening(&self, directions: &Directions) -> Result<Iterate, Halt> {
        let (a, b) = (&directions.correction.motion, &directions.response.motion);
        let before = self.step.before.as_ref().unwrap_or(b);
        let pairs = [(a, a), (a, b), (b, b), (before, b)];
        let [square, mixed, response, ahead] = PointMotion::products(self.problem.world, pairs);
        let rest = square - self.step.length.powi(2);
        match forward_root(response, mixed, rest, ahead < 0.0) {
            Some(change) => Ok(directions.with_load(change)),
            None if response > 0.0 => Err(Failure::plain(
                "the step is shorter than what the new grid alone moves the points by".into(),
            )
            .into()),
            None => Err(Failure::plain("the load does not move the measured points".into()).into()),
        }
    }

    /// Newton's step on residual and length.
    fn correction(&self, at: &Iterate, directions: &Directions) -> Result<Iterate, Halt> {
        let (u, a, b) = (&at.motion, &directions.correction.motion, &directions.response.motion);
        let [square, by_residual, by_load] = PointMotion::products(self.problem.world, [(u, u), (u, a), (u, b)]);
        let change = (0.5 * (self.step.length.powi(2) - square) - by_residual) / by_load;
        if change.is_finite() {
            Ok(directions.with_load(change))
        } else {
            Err(not_converged("the load does not change the length of the step").into())
        }
    }

    /// The next iterate, evaluated, with the change that led there: the whole step, or with backtracking the first
    /// share of it for which the residual falls.
    fn search(&mut self, at: &Iterate, change: &Iterate) -> Result<(Iterate, Iterate), Halt> {
        let norm = self.residual_norm();
        let (earlier, smallest) = match self.step.approach.search {
            Search::Configured => (&[][..], 1.0),
            Search::Other => (&BACKTRACKING_SHARES[..], SMALLEST_SHARE),
        };
        for &share in earlier {
            let next = at.moved(share, change);
            match self.evaluate(&next) {
                Ok(()) if self.residual_norm() < norm => return Ok((next, change.scaled(share))),
                Ok(()) | Err(Halt::Failure(_)) => {}
                Err(error) => return Err(error),
            }
        }
        let next = at.moved(smallest, change);
        self.evaluate(&next)?;
        Ok((next, change.scaled(smallest)))
    }

    /// The solution, unless it is not the step that was asked for.
    fn finish(&mut self, at: &Iterate, forward: &PointMotion) -> Result<Solution, Halt> {
        let pairs = [(&at.motion, &at.motion), (&at.motion, forward)];
        let [square, ahead] = PointMotion::products(self.problem.world, pairs);
        let ratio = square.sqrt() / self.step.length;
        if !(1.0 / LENGTH_MARGIN..=LENGTH_MARGIN).contains(&ratio) || ahead <= 0.0 {
            let reason = "the iteration found another part of the path than the step ahead";
            return Err(not_converged(reason).into());
        }
        Ok(Solution {
            load_factor: Some(at.load_factor),
            ..settle(self.session, self.solver, &mut self.problem, &at.increments, true)?
        })
    }
}

/// The larger or, `backwards`, the smaller root of `a x^2 + 2 b x + c`; `None` where there are none.
fn forward_root(a: f64, b: f64, c: f64, backwards: bool) -> Option<f64> {
    let discriminant = b * b - a * c;
    let sign = if backwards { -1.0 } else { 1.0 };
    // Not a number is no root either.
    (discriminant >= 0.0 && a > 0.0).then(|| (sign * discriminant.sqrt() - b) / a)
}

/// A failure that another line search may mend.
fn not_converged(reason: &str) -> Failure {
    Failure {
        search_matters: true,
        ..Failure::plain(reason.into())
    }
}

/// A failure before the iterations would come again with another line search.
fn repeats(halt: Halt) -> Halt {
    match halt {
        Halt::Failure(failure) => Halt::Failure(Failure {
            search_matters: false,
            ..failure
        }),
        error => error,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_root_ahead_is_taken() {
        // x^2 - x - 6
        assert_eq!(forward_root(1.0, -0.5, -6.0, false), Some(3.0));
        assert_eq!(forward_root(1.0, -0.5, -6.0, true), Some(-2.0));
        assert_eq!(forward_root(1.0, 0.0, 1.0, false), None);
        assert_eq!(forward_root(0.0, 0.0, -1.0, false), None);
        assert_eq!(forward_root(f64::NAN, 0.0, -1.0, false), None);
    }
}
