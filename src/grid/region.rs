//! Shapes in space, and what lies inside them.

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
    pub fn contains(&self, _position: &[f64; 3], _margin: f64) -> bool {
        true
    }
    pub fn bounds(&self) -> ([f64; 3], [f64; 3]) {
        ([0.0; 3], [0.0; 3])
    }
}
