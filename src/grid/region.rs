//! Shapes in space, and what lies inside them.

use std::f64::consts::PI;

/// A region of space. In plane strain the third coordinate of everything is zero and boxes are unbounded along it.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    Box {
        min: [f64; 3],
        max: [f64; 3],
    },
    Ball {
        centre: [f64; 3],
        radius: f64,
    },
    /// Along `axis` from `min` to `max` (absolute).
    Cylinder {
        axis: usize,
        centre: [f64; 3],
        radius: f64,
        min: f64,
        max: f64,
    },
    /// Angles in radians, counter-clockwise about `axis` seen against it, from +x (axis z), +y (axis x), +z (axis y).
    RingSector {
        axis: usize,
        centre: [f64; 3],
        inner_radius: f64,
        outer_radius: f64,
        from_angle: f64,
        to_angle: f64,
        min: f64,
        max: f64,
    },
    /// In the x-y plane, extruded from `min` to `max` along z.
    Polygon {
        vertices: Vec<[f64; 2]>,
        min: f64,
        max: f64,
    },
    All(Vec<Shape>),
    Any(Vec<Shape>),
    Not(Box<Shape>),
}

impl Shape {
    /// Whether a position is inside the shape grown by `margin` [m] on all sides (shrunk, where that is negative).
    pub fn contains(&self, position: &[f64; 3], margin: f64) -> bool {
        match self {
            Shape::Box { min, max } => {
                (0..3).all(|axis| position[axis] >= min[axis] - margin && position[axis] <= max[axis] + margin)
            }
            Shape::Ball { centre, radius } => distance(position, centre) <= radius + margin,
            Shape::Cylinder {
                axis,
                centre,
                radius,
                min,
                max,
            } => {
                let (first, second) = around(*axis, position, centre);
                first.hypot(second) <= radius + margin && between(position[*axis], *min, *max, margin)
            }
            Shape::RingSector {
                axis,
                centre,
                inner_radius,
                outer_radius,
                from_angle,
                to_angle,
                min,
                max,
            } => {
                let (first, second) = around(*axis, position, centre);
                let radius = first.hypot(second);
                between(position[*axis], *min, *max, margin)
                    && between(radius, *inner_radius, *outer_radius, margin)
                    && in_sector(second.atan2(first), *from_angle, *to_angle, margin / radius)
            }
            Shape::Polygon { vertices, min, max } => {
                between(position[2], *min, *max, margin) && in_polygon(vertices, [position[0], position[1]], margin)
            }
            Shape::All(shapes) => shapes.iter().all(|shape| shape.contains(position, margin)),
            Shape::Any(shapes) => shapes.iter().any(|shape| shape.contains(position, margin)),
            Shape::Not(shape) => !shape.contains(position, -margin),
        }
    }

    /// Position at coordinates from 0 to 1 along the shape's own axes: x, y, z of a box; of a sector of a ring its angle,
    /// its radius, and its axis. `None` for other shapes. An axis without end stays at zero.
    pub fn at(&self, coordinates: &[f64; 3]) -> Option<[f64; 3]> {
        let between = |low: f64, high: f64, share: f64| match (high - low).is_finite() {
            true => (1.0 - share) * low + share * high,
            false => 0.0,
        };
        match self {
            Shape::Box { min, max } => Some(std::array::from_fn(|k| between(min[k], max[k], coordinates[k]))),
            Shape::RingSector {
                axis,
                centre,
                inner_radius,
                outer_radius,
                from_angle,
                to_angle,
                min,
                max,
            } => {
                let angle = between(*from_angle, *to_angle, coordinates[0]);
                let radius = between(*inner_radius, *outer_radius, coordinates[1]);
                let mut position = *centre;
                position[(axis + 1) % 3] += radius * angle.cos();
                position[(axis + 2) % 3] += radius * angle.sin();
                position[*axis] = between(*min, *max, coordinates[2]);
                Some(position)
            }
            _ => None,
        }
    }

    /// Lowest and highest corner of a box that holds the shape; infinite where the shape has no end, and crossed
    /// (a lowest beyond the highest) where it is empty. It is the smallest one where [`Shape::has_tight_bounds`].
    pub fn bounds(&self) -> ([f64; 3], [f64; 3]) {
        match self {
            Shape::Box { min, max } => (*min, *max),
            Shape::Ball { centre, radius } => (centre.map(|value| value - radius), centre.map(|value| value + radius)),
            Shape::Cylinder {
                axis,
                centre,
                radius,
                min,
                max,
            } => {
                let mut bounds = (centre.map(|value| value - radius), centre.map(|value| value + radius));
                (bounds.0[*axis], bounds.1[*axis]) = (*min, *max);
                bounds
            }
            Shape::RingSector {
                axis,
                centre,
                inner_radius,
                outer_radius,
                from_angle,
                to_angle,
                min,
                max,
            } => {
                let corners = sector_corners([*inner_radius, *outer_radius], *from_angle, *to_angle);
                let (low, high) = bounds_of(&corners);
                let (first, second) = ((axis + 1) % 3, (axis + 2) % 3);
                let mut bounds = (*centre, *centre);
                for (along, index) in [(first, 0), (second, 1)] {
                    bounds.0[along] += low[index];
                    bounds.1[along] += high[index];
                }
                (bounds.0[*axis], bounds.1[*axis]) = (*min, *max);
                bounds
            }
            Shape::Polygon { vertices, min, max } => {
                let (low, high) = bounds_of(vertices);
                ([low[0], low[1], *min], [high[0], high[1], *max])
            }
            Shape::All(shapes) => shapes
                .iter()
                .fold(EVERYWHERE, |all, shape| intersection(all, shape.bounds())),
            Shape::Any(shapes) => shapes
                .iter()
                .fold((EVERYWHERE.1, EVERYWHERE.0), |any, shape| union(any, shape.bounds())),
            Shape::Not(_) => EVERYWHERE,
        }
    }

    /// Whether the bounds are those of the shape itself, and not just of a box that holds it.
    pub fn has_tight_bounds(&self) -> bool {
        match self {
            Shape::Any(shapes) => shapes.iter().all(Shape::has_tight_bounds),
            Shape::All(shapes) => shapes.iter().all(|shape| matches!(shape, Shape::Box { .. })),
            Shape::Not(_) => false,
            _ => true,
        }
    }
}

const EVERYWHERE: ([f64; 3], [f64; 3]) = ([f64::NEG_INFINITY; 3], [f64::INFINITY; 3]);

/// Corners of a box.
pub type Bounds = ([f64; 3], [f64; 3]);

/// The box that two boxes share; crossed where they share none.
pub fn intersection(one: Bounds, other: Bounds) -> Bounds {
    let pick = |index: usize| (one.0[index].max(other.0[index]), one.1[index].min(other.1[index]));
    let [x, y, z] = [pick(0), pick(1), pick(2)];
    ([x.0, y.0, z.0], [x.1, y.1, z.1])
}

fn union(one: Bounds, other: Bounds) -> Bounds {
    let pick = |index: usize| (one.0[index].min(other.0[index]), one.1[index].max(other.1[index]));
    let [x, y, z] = [pick(0), pick(1), pick(2)];
    ([x.0, y.0, z.0], [x.1, y.1, z.1])
}

fn bounds_of(points: &[[f64; 2]]) -> ([f64; 2], [f64; 2]) {
    let start = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    points.iter().fold(start, |(low, high), point| {
        (
            [low[0].min(point[0]), low[1].min(point[1])],
            [high[0].max(point[0]), high[1].max(point[1])],
        )
    })
}

fn distance(one: &[f64; 3], other: &[f64; 3]) -> f64 {
    (0..3).map(|axis| (one[axis] - other[axis]).powi(2)).sum::<f64>().sqrt()
}

fn between(value: f64, min: f64, max: f64, margin: f64) -> bool {
    value >= min - margin && value <= max + margin
}

/// Coordinates about an axis: along the next axis and the one after it, in cyclic order.
fn around(axis: usize, position: &[f64; 3], centre: &[f64; 3]) -> (f64, f64) {
    let (first, second) = ((axis + 1) % 3, (axis + 2) % 3);
    (position[first] - centre[first], position[second] - centre[second])
}

/// Whether an angle lies in a sector that is widened by `margin` at both ends [rad].
fn in_sector(angle: f64, from: f64, to: f64, margin: f64) -> bool {
    let half = 0.5 * (to - from);
    if half >= PI {
        return true;
    }
    let from_middle = (angle - from - half).rem_euclid(2.0 * PI);
    from_middle.min(2.0 * PI - from_middle) <= half + margin
}

/// Extreme points of a sector of a ring about the origin: its corners, and where its arcs cross the axes.
fn sector_corners(radii: [f64; 2], from: f64, to: f64) -> Vec<[f64; 2]> {
    let crossings = (0..4)
        .map(|quarter| 0.5 * PI * f64::from(quarter))
        .filter(|angle| in_sector(*angle, from, to, 0.0));
    let angles: Vec<f64> = crossings.chain([from, to]).collect();
    radii
        .iter()
        .flat_map(|radius| {
            angles
                .iter()
                .map(move |angle| [radius * angle.cos(), radius * angle.sin()])
        })
        .collect()
}

fn in_polygon(vertices: &[[f64; 2]], point: [f64; 2], margin: f64) -> bool {
    let mut inside = false;
    let mut nearest = f64::INFINITY;
    for (index, end) in vertices.iter().enumerate() {
        let start = vertices[if index == 0 { vertices.len() - 1 } else { index - 1 }];
        // Even-odd rule: count the edges that a ray towards +x crosses.
        if (start[1] > point[1]) != (end[1] > point[1]) {
            let crossing = start[0] + (point[1] - start[1]) / (end[1] - start[1]) * (end[0] - start[0]);
            inside ^= point[0] < crossing;
        }
        nearest = nearest.min(distance_to_edge(start, *end, point));
    }
    if inside { nearest >= -margin } else { nearest <= margin }
}

fn distance_to_edge(start: [f64; 2], end: [f64; 2], point: [f64; 2]) -> f64 {
    let edge = [end[0] - start[0], end[1] - start[1]];
    let offset = [point[0] - start[0], point[1] - start[1]];
    let length_squared = edge[0] * edge[0] + edge[1] * edge[1];
    let along = if length_squared > 0.0 {
        (offset[0] * edge[0] + offset[1] * edge[1]) / length_squared
    } else {
        0.0
    };
    let along = along.clamp(0.0, 1.0);
    (offset[0] - along * edge[0]).hypot(offset[1] - along * edge[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    const NEAR: f64 = 1e-9;

    /// On the boundary: inside for a node, outside for a point.
    fn on_boundary(shape: &Shape, position: [f64; 3]) {
        assert!(shape.contains(&position, NEAR), "{position:?} of {shape:?}");
        assert!(!shape.contains(&position, -NEAR), "{position:?} of {shape:?}");
    }

    #[test]
    fn a_boundary_is_outside_for_points_and_inside_for_nodes() {
        let cube = Shape::Box {
            min: [0.0; 3],
            max: [1.0, 2.0, 3.0],
        };
        on_boundary(&cube, [1.0, 1.0, 1.0]);
        on_boundary(
            &Shape::Ball {
                centre: [0.0; 3],
                radius: 0.5,
            },
            [0.3, 0.4, 0.0],
        );
        let tube = Shape::Cylinder {
            axis: 0,
            centre: [9.0, 1.0, 0.0],
            radius: 0.5,
            min: 0.0,
            max: 2.0,
        };
        on_boundary(&tube, [1.0, 1.5, 0.0]);
        on_boundary(&tube, [2.0, 1.2, 0.0]);
        on_boundary(&Shape::Not(Box::new(cube.clone())), [1.0, 1.0, 1.0]);
        on_boundary(
            &Shape::All(vec![cube.clone(), Shape::Not(Box::new(tube))]),
            [1.0, 1.5, 0.0],
        );
        let triangle = Shape::Polygon {
            vertices: vec![[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]],
            min: -1.0,
            max: 1.0,
        };
        on_boundary(&triangle, [0.5, 0.5, 0.0]);
        on_boundary(&triangle, [0.25, 0.0, 0.0]);
        on_boundary(&triangle, [0.2, 0.2, 1.0]);
        assert!(triangle.contains(&[0.2, 0.2, 0.0], -NEAR) && !triangle.contains(&[0.6, 0.6, 0.0], NEAR));
    }

    fn sector(axis: usize, from: f64, to: f64) -> Shape {
        Shape::RingSector {
            axis,
            centre: [0.0; 3],
            inner_radius: 1.0,
            outer_radius: 2.0,
            from_angle: from.to_radians(),
            to_angle: to.to_radians(),
            min: -1.0,
            max: 1.0,
        }
    }

    #[test]
    fn angles_run_counter_clockwise_about_each_axis() {
        let at_quarter = [[0.0, 1.1, 1.1], [1.1, 0.0, 1.1], [1.1, 1.1, 0.0]];
        for (axis, position) in at_quarter.iter().enumerate() {
            assert!(sector(axis, 0.0, 90.0).contains(position, -NEAR), "axis {axis}");
            assert!(!sector(axis, 90.0, 360.0).contains(position, NEAR), "axis {axis}");
        }
        // About z, the quarter from +x towards y; about y, the one from +z towards x.
        assert!(sector(2, 0.0, 45.0).contains(&[1.5, 0.1, 0.0], -NEAR));
        assert!(sector(1, 0.0, 45.0).contains(&[0.1, 0.0, 1.5], -NEAR));
        on_boundary(&sector(2, 0.0, 90.0), [1.5, 0.0, 0.0]);
        on_boundary(&sector(2, 0.0, 90.0), [0.0, 1.5, 0.0]);
        on_boundary(&sector(2, -30.0, 30.0), [1.0, 0.0, 0.0]);
        assert!(sector(2, 350.0, 370.0).contains(&[1.5, 0.0, 0.0], -NEAR));
        assert!(sector(2, 0.0, 360.0).contains(&[-1.5, 0.0, 0.0], -NEAR));
        assert!(!sector(2, 0.0, 360.0).contains(&[0.5, 0.0, 0.0], NEAR));
    }

    #[test]
    fn bounds_hold_the_shape_and_no_more() {
        let near = |one: [f64; 3], other: [f64; 3]| distance(&one, &other) < 1e-12;
        let (low, high) = sector(2, 0.0, 90.0).bounds();
        assert!(
            near(low, [0.0, 0.0, -1.0]) && near(high, [2.0, 2.0, 1.0]),
            "{low:?} {high:?}"
        );
        let (low, high) = sector(2, -45.0, 135.0).bounds();
        let half = 2.0 * 0.5_f64.sqrt();
        assert!(
            near(low, [-half, -half, -1.0]) && near(high, [2.0, 2.0, 1.0]),
            "{low:?} {high:?}"
        );
        let ball = Shape::Ball {
            centre: [1.0, 2.0, 3.0],
            radius: 1.0,
        };
        let cut = Shape::All(vec![
            ball.clone(),
            Shape::Not(Box::new(Shape::Box {
                min: [0.0; 3],
                max: [1.0; 3],
            })),
        ]);
        assert_eq!(cut.bounds(), ([0.0, 1.0, 2.0], [2.0, 3.0, 4.0]));
        assert!(ball.has_tight_bounds() && !cut.has_tight_bounds());
        let both = Shape::Any(vec![
            ball,
            Shape::Box {
                min: [-1.0; 3],
                max: [0.0; 3],
            },
        ]);
        assert_eq!(both.bounds(), ([-1.0; 3], [2.0, 3.0, 4.0]));
    }
}
