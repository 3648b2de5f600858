//! Following a curve of solutions: `N - 1` equations in `N` unknowns, from a known point on.
//!
//! Where Newton's method finds no way from a start to a solution, the equations are given one more unknown, a parameter with
//! a value for which the solution is known. The points that satisfy them are a curve, which may turn back in the parameter
//! without harm: steps go along it (pseudo-arclength), and are as short as its corrections ask for.

use super::dense::System;

/// Longest step along the curve; unknowns are of the size of one.
const LONGEST: f64 = 0.2;
/// First step.
const FIRST: f64 = 0.05;
/// A step that is no longer than this ends the way.
const SHORTEST: f64 = 1e-7;
const MOST_STEPS: usize = 300;
const MOST_CORRECTIONS: usize = 8;
/// Norm of the residuals of a point of the curve.
const ACCURACY: f64 = 1e-14;
/// Norm that is still one of a point, where rounding allows no less.
const ROUNDING: f64 = 1e-12;

/// `N - 1` equations in `N` unknowns. The last entry of a residual and the last row of the derivatives are free.
pub trait Equations<const N: usize> {
    /// Residuals; `None` outside the domain.
    fn residual(&self, x: &[f64; N]) -> Option<[f64; N]>;
    /// Derivatives of the residuals.
    fn derivatives(&self, x: &[f64; N]) -> Option<System<N>>;
}

/// A step along a curve: from `start` in direction `tangent`, `length` long.
pub struct Segment<'a, E, const N: usize> {
    equations: &'a E,
    pub start: [f64; N],
    pub end: [f64; N],
    tangent: [f64; N],
    pub length: f64,
}

impl<E: Equations<N>, const N: usize> Segment<'_, E, N> {
    /// The point of the curve at this length from the start.
    pub fn at(&self, length: f64) -> Option<[f64; N]> {
        correct(self.equations, &self.start, &self.tangent, length).map(|(point, _)| point)
    }
}

/// Goes along the curve from a point of it, at first with the last unknown rising (`direction = 1`) or falling (-1), up to
/// the first step at whose end `stop` holds; `None` where the curve cannot be followed that far.
pub fn follow<'a, E: Equations<N>, const N: usize>(
    equations: &'a E,
    start: [f64; N],
    direction: f64,
    stop: impl Fn(&[f64; N]) -> bool,
) -> Option<Segment<'a, E, N>> {
    let mut forward = [0.0; N];
    forward[N - 1] = direction;
    let mut point = start;
    let mut length = FIRST;
    for _ in 0..MOST_STEPS {
        let tangent = tangent(equations, &point, &forward)?;
        let (end, corrections) = loop {
            match correct(equations, &point, &tangent, length) {
                Some(found) => break found,
                None if length > SHORTEST => length *= 0.25,
                None => return None,
            }
        };
        if stop(&end) {
            return Some(Segment {
                equations,
                start: point,
                end,
                tangent,
                length,
            });
        }
        (point, forward) = (end, tangent);
        if corrections <= 3 {
            length = (2.0 * length).min(LONGEST);
        }
    }
    None
}

/// Unit tangent of the curve, on the side of `forward`.
fn tangent<E: Equations<N>, const N: usize>(equations: &E, at: &[f64; N], forward: &[f64; N]) -> Option<[f64; N]> {
    let mut system = equations.derivatives(at)?;
    system.rows[N - 1] = *forward;
    let mut right = [0.0; N];
    right[N - 1] = 1.0;
    let tangent = system.factorise()?.solve_one(&right);
    let norm = norm(&tangent);
    norm.is_finite().then(|| tangent.map(|component| component / norm))
}

/// The point of the curve in the plane across the tangent, with the number of corrections; `None` where they do not bring
/// it close, or bring it far from where the step leads.
fn correct<E: Equations<N>, const N: usize>(
    equations: &E,
    from: &[f64; N],
    tangent: &[f64; N],
    length: f64,
) -> Option<([f64; N], usize)> {
    let mut point: [f64; N] = std::array::from_fn(|i| from[i] + length * tangent[i]);
    let mut moved = 0.0;
    let mut last = f64::INFINITY;
    for corrections in 0..=MOST_CORRECTIONS {
        let mut residual = equations.residual(&point)?;
        residual[N - 1] = 0.0;
        let error = norm(&residual);
        if error <= ACCURACY || (error <= ROUNDING && error >= 0.5 * last) {
            return Some((point, corrections));
        }
        // Written so that what is not a number is no progress.
        let falls = error < last;
        if !falls {
            return None;
        }
        last = error;
        let mut system = equations.derivatives(&point)?;
        system.rows[N - 1] = *tangent;
        let change = system.factorise()?.solve_one(&residual);
        (0..N).for_each(|i| point[i] -= change[i]);
        moved += norm(&change);
        if moved > length {
            return None;
        }
    }
    None
}

fn norm<const N: usize>(values: &[f64; N]) -> f64 {
    values.iter().map(|value| value * value).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `x^2 + y^2 = 1`, whose `y` turns back.
    struct Circle;

    impl Equations<2> for Circle {
        fn residual(&self, x: &[f64; 2]) -> Option<[f64; 2]> {
            Some([x[0] * x[0] + x[1] * x[1] - 1.0, 0.0])
        }

        fn derivatives(&self, x: &[f64; 2]) -> Option<System<2>> {
            let mut system = System::zero();
            system.rows[0] = [2.0 * x[0], 2.0 * x[1]];
            Some(system)
        }
    }

    #[test]
    fn goes_round_where_the_parameter_turns_back() {
        let around = follow(&Circle, [1.0, 0.0], 1.0, |x| x[0] < -0.5).expect("a way round");
        for point in [
            around.start,
            around.end,
            around.at(0.5 * around.length).expect("a point"),
        ] {
            assert!((point[0].hypot(point[1]) - 1.0).abs() < 1e-12);
        }
        assert!(around.start[0] >= -0.5 && around.end[0] < -0.5 && around.end[1] > 0.5);
    }

    #[test]
    fn gives_up_where_nothing_stops_it() {
        assert!(follow(&Circle, [1.0, 0.0], 1.0, |x| x[0] > 2.0).is_none());
    }
}
