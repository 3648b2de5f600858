//! Follower pressure on the surface of a body, by Nanson's formula on the current shape (N 32-33).
//!
//! The surface is that of the points' reference domains: a side of a domain towards axis `k` has the area vector
//! `A0 N = +-(2 l)(2 l) e_k`, which the motion carries to `a n = cof(F) A0 N`. A pressure `p` pushes onto the body with
//! the force `-p a n`.

use super::Time;
use crate::continuum::Continuum;
use crate::points::Points;
use nalgebra::{Matrix3, Vector3};

/// A pressure on parts of the surface of a body.
#[derive(Clone, Debug, PartialEq)]
pub struct Pressure {
    /// Stage over which it ramps.
    pub stage: usize,
    /// At full load [Pa], positive onto the body.
    pub pressure: f64,
    pub patches: Vec<Patch>,
}

impl Pressure {
    /// The pressure at a time [Pa].
    pub fn at(&self, time: Time) -> f64 {
        self.pressure * time.ramp(self.stage)
    }
}

/// Points with one side of their domains on the surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Patch {
    /// Mark of the points.
    pub bit: usize,
    pub side: Side,
}

/// A side of an axis-aligned domain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Side {
    pub axis: usize,
    /// Whether the outward normal points along the axis or against it.
    pub upper: bool,
}

impl Side {
    fn sign(self) -> f64 {
        if self.upper { 1.0 } else { -1.0 }
    }

    /// Area [m2] of the side of a point's reference domain times its outward normal.
    pub fn area<C: Continuum, const D: usize>(self, points: &Points<C, D>, p: usize) -> Vector3<f64> {
        let half = &points.reference_half_lengths[p];
        let mut area = Vector3::zeros();
        area[self.axis] = self.sign()
            * (0..D)
                .filter(|&axis| axis != self.axis)
                .map(|axis| 2.0 * half[axis])
                .product::<f64>();
        area
    }

    /// From the centre of a point's reference domain to that of the side [m].
    pub fn offset<C: Continuum, const D: usize>(self, points: &Points<C, D>, p: usize) -> Vector3<f64> {
        let mut offset = Vector3::zeros();
        offset[self.axis] = self.sign() * points.reference_half_lengths[p][self.axis];
        offset
    }
}

/// `cof(F) A`: what a motion with gradient `F` makes of the area vector `A`.
pub fn carried_area(gradient: &Matrix3<f64>, area: &Vector3<f64>) -> Vector3<f64> {
    let column = |k: usize| Vector3::from(gradient.column(k % 3));
    (0..3).map(|k| column(k + 1).cross(&column(k + 2)) * area[k]).sum()
}

/// Derivative of [`carried_area`] by column `k` of the gradient: entry `(i, m)` is that of component `i` by `F_mk`.
pub fn carried_area_by_column(gradient: &Matrix3<f64>, area: &Vector3<f64>, k: usize) -> Matrix3<f64> {
    let (next, last) = ((k + 1) % 3, (k + 2) % 3);
    let hat = |k: usize| Vector3::from(gradient.column(k)).cross_matrix();
    hat(last) * area[next] - hat(next) * area[last]
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRADIENT: Matrix3<f64> = Matrix3::new(1.1, 0.2, -0.1, 0.05, 0.9, 0.3, -0.2, 0.1, 1.2);

    #[test]
    fn area_follows_nanson() {
        let area = Vector3::new(0.3, -0.7, 1.1);
        let inverse = GRADIENT.try_inverse().expect("a regular gradient");
        let nanson = GRADIENT.determinant() * inverse.transpose() * area;
        assert!((carried_area(&GRADIENT, &area) - nanson).norm() < 1e-15);
    }

    #[test]
    fn derivatives_are_those_of_the_area() {
        let area = Vector3::new(0.3, -0.7, 1.1);
        for k in 0..3 {
            let slope = carried_area_by_column(&GRADIENT, &area, k);
            for m in 0..3 {
                // Quadratic in the gradient: central differences are exact but for round-off.
                let at = |h: f64| {
                    let mut moved = GRADIENT;
                    moved[(m, k)] += h;
                    carried_area(&moved, &area)
                };
                let difference = (at(0.5) - at(-0.5)) - slope.column(m);
                assert!(difference.norm() < 1e-15, "{difference}");
            }
        }
    }
}
