//! The space that each body takes up in the initial state.

use crate::grid::region::Shape;
use crate::points::seed::{Body, PointSource, SeedPoint};
use std::collections::HashMap;

/// Depth in a body, as a share of a cell or of a domain, from which on a position is inside: what touches is outside.
const TOUCHING: f64 = 1.0e-6;

/// Where a body is.
pub struct Space<'a> {
    inside: Inside<'a>,
    low: [f64; 3],
    high: [f64; 3],
}

enum Inside<'a> {
    Shape {
        shape: &'a Shape,
        margin: f64,
    },
    Domains(Domains<'a>),
    /// A mesh, which is the only body.
    Alone,
}

/// Domains of points from a file, sorted into boxes as large as the largest of them.
struct Domains<'a> {
    points: &'a [SeedPoint],
    edges: [f64; 3],
    boxes: HashMap<[i64; 3], Vec<usize>>,
}

impl<'a> Space<'a> {
    /// Of a body on a grid whose cells have this shortest edge [m].
    pub fn of(body: &'a Body, edge: f64) -> Self {
        let inside = match &body.points {
            PointSource::Lattice { shape, .. } => Inside::Shape {
                shape,
                margin: -TOUCHING * edge,
            },
            PointSource::List(points) => Inside::Domains(Domains::new(points)),
            PointSource::Mesh(_) => Inside::Alone,
        };
        let (low, high) = match &inside {
            Inside::Shape { shape, .. } => shape.bounds(),
            Inside::Domains(domains) => domains.bounds(),
            Inside::Alone => ([0.0; 3], [0.0; 3]),
        };
        Self { inside, low, high }
    }

    /// Whether the boxes around two bodies have a place in common.
    pub fn is_near(&self, other: &Self) -> bool {
        (0..3).all(|k| self.low[k] <= other.high[k] && other.low[k] <= self.high[k])
    }

    /// Whether a position lies inside the body and not on its surface.
    pub fn holds(&self, position: &[f64; 3]) -> bool {
        let near = (0..3).all(|k| position[k] >= self.low[k] && position[k] <= self.high[k]);
        near && match &self.inside {
            Inside::Shape { shape, margin } => shape.contains(position, *margin),
            Inside::Domains(domains) => domains.hold(position),
            Inside::Alone => false,
        }
    }
}

impl<'a> Domains<'a> {
    fn new(points: &'a [SeedPoint]) -> Self {
        let mut edges = [f64::MIN_POSITIVE; 3];
        for point in points {
            (0..3).for_each(|k| edges[k] = edges[k].max(2.0 * point.half_lengths[k]));
        }
        let mut domains = Self {
            points,
            edges,
            boxes: HashMap::new(),
        };
        for (index, point) in points.iter().enumerate() {
            let place = domains.place(&point.position);
            domains.boxes.entry(place).or_default().push(index);
        }
        domains
    }

    /// Box of a position; all of them have one along an axis without extent.
    fn place(&self, position: &[f64; 3]) -> [i64; 3] {
        std::array::from_fn(|k| match self.edges[k] > f64::MIN_POSITIVE {
            true => (position[k] / self.edges[k]).floor() as i64,
            false => 0,
        })
    }

    fn bounds(&self) -> ([f64; 3], [f64; 3]) {
        let mut bounds = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for point in self.points {
            for k in 0..3 {
                bounds.0[k] = bounds.0[k].min(point.position[k] - point.half_lengths[k]);
                bounds.1[k] = bounds.1[k].max(point.position[k] + point.half_lengths[k]);
            }
        }
        bounds
    }

    /// Whether a domain holds a position: one of a point in its box or next to it.
    fn hold(&self, position: &[f64; 3]) -> bool {
        let centre = self.place(position);
        let holds = |&index: &usize| {
            let SeedPoint {
                position: middle,
                half_lengths: half,
                ..
            } = &self.points[index];
            (0..3).all(|k| (position[k] - middle[k]).abs() <= (1.0 - TOUCHING) * half[k])
        };
        (0..27).any(|mut number| {
            let place = centre.map(|index| {
                let shift = number % 3 - 1;
                number /= 3;
                index + shift
            });
            self.boxes.get(&place).is_some_and(|points| points.iter().any(holds))
        })
    }
}
