//! Where in a cell the points of a lattice are, and what share of the cell each stands for.

/// How points are placed along an axis of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Placement {
    /// At the centres of equal parts.
    Even,
    /// At the points of Gauss' quadrature, with its weights.
    Gauss,
}

/// A point along an axis of a cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisPoint {
    /// Position, from 0 to 1.
    pub position: f64,
    /// Share of the cell's length; the shares sum to 1.
    pub weight: f64,
}

impl Placement {
    /// `count` points along an axis, in ascending order.
    pub fn axis_points(self, count: usize) -> Vec<AxisPoint> {
        match self {
            Placement::Even => {
                let n = count as f64;
                (0..count)
                    .map(|k| AxisPoint {
                        position: (k as f64 + 0.5) / n,
                        weight: 1.0 / n,
                    })
                    .collect()
            }
            Placement::Gauss => (0..count).map(|k| gauss_point(k, count)).collect(),
        }
    }
}

/// Point `k` of Gauss' quadrature with `count` points on the unit interval: a root of Legendre's polynomial by Newton's
/// method from the usual asymptotic estimate.
fn gauss_point(k: usize, count: usize) -> AxisPoint {
    let n = count as f64;
    let mut x = -(std::f64::consts::PI * (k as f64 + 0.75) / (n + 0.5)).cos();
    // Four iterations reach round-off from the estimate; the rest cost nothing and make that certain.
    for _ in 0..10 {
        let (value, derivative) = legendre(count, x);
        x -= value / derivative;
    }
    let (_, derivative) = legendre(count, x);
    AxisPoint {
        position: 0.5 * (1.0 + x),
        weight: 1.0 / ((1.0 - x * x) * derivative * derivative),
    }
}

/// Legendre's polynomial of a degree of at least 1 and its derivative, inside (-1, 1).
fn legendre(degree: usize, x: f64) -> (f64, f64) {
    let (mut before, mut value) = (1.0, x);
    for k in 2..=degree {
        let k = k as f64;
        (before, value) = (value, ((2.0 * k - 1.0) * x * value - (k - 1.0) * before) / k);
    }
    (value, degree as f64 * (x * value - before) / (x * x - 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `count` Gauss points integrate polynomials up to degree `2 count - 1` exactly, and no more.
    #[test]
    fn gauss_points_integrate_polynomials() {
        for count in 1..=12 {
            let points = Placement::Gauss.axis_points(count);
            let error = |degree: i32| {
                let sum: f64 = points
                    .iter()
                    .map(|point| point.weight * point.position.powi(degree))
                    .sum();
                (sum - 1.0 / f64::from(degree + 1)).abs()
            };
            let exact = 2 * count as i32 - 1;
            assert!((0..=exact).all(|degree| error(degree) < 1e-14), "{count} points");
            assert!(count > 6 || error(exact + 1) > 1e-9, "{count} points");
            assert!(points.is_sorted_by(|a, b| a.position < b.position));
        }
    }

    #[test]
    fn even_points_share_the_cell() {
        let points = Placement::Even.axis_points(4);
        assert_eq!(
            points[0],
            AxisPoint {
                position: 0.125,
                weight: 0.25
            }
        );
        assert_eq!(points[3].position, 0.875);
    }
}
