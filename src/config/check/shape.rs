//! Shapes: in plane strain unbounded along z, so that the third coordinate never counts.

use super::Check;
use crate::config::file::{AxisName, BallKeys, BoxKeys, CylinderKeys, PolygonKeys, RingSectorKeys, ShapeKeys};
use crate::config::path::Path;
use crate::grid::region::Shape;
use crate::problem::figure;
use crate::scene::Kinematics;

/// Where something lies along an axis: axis, lower and upper end.
type Extrusion = (usize, f64, f64);

impl Check<'_> {
    /// A region of space; a file of points is refused.
    pub(super) fn shape(&mut self, path: &Path, keys: &ShapeKeys) -> Option<Shape> {
        match keys {
            ShapeKeys::Box(keys) => self.box_shape(&path.key("box"), keys),
            ShapeKeys::Ball(keys) => self.ball(&path.key("ball"), keys),
            ShapeKeys::Cylinder(keys) => self.cylinder(&path.key("cylinder"), keys),
            ShapeKeys::RingSector(keys) => self.ring_sector(&path.key("ring_sector"), keys),
            ShapeKeys::Polygon(keys) => self.polygon(&path.key("polygon"), keys),
            ShapeKeys::Points(_) => {
                self.report(
                    &path.key("points"),
                    "a file of points can be the shape of a body only",
                    "box, ball, cylinder, ring_sector, polygon, all, any, not",
                );
                None
            }
            ShapeKeys::All(list) => self.shapes(&path.key("all"), list).map(Shape::All),
            ShapeKeys::Any(list) => self.shapes(&path.key("any"), list).map(Shape::Any),
            ShapeKeys::Not(keys) => self
                .shape(&path.key("not"), keys)
                .map(|shape| Shape::Not(Box::new(shape))),
        }
    }

    fn shapes(&mut self, path: &Path, list: &[ShapeKeys]) -> Option<Vec<Shape>> {
        let some = self.require(
            !list.is_empty(),
            path,
            "the list of shapes is empty",
            "one shape or more",
        );
        let shapes: Vec<_> = list
            .iter()
            .enumerate()
            .map(|(index, keys)| self.shape(&path.index(index), keys))
            .collect();
        shapes.into_iter().collect::<Option<Vec<_>>>().filter(|_| some)
    }

    fn box_shape(&mut self, path: &Path, keys: &BoxKeys) -> Option<Shape> {
        let min = self.vector(&path.key("min"), &keys.min);
        let max = self.vector(&path.key("max"), &keys.max);
        let (mut min, mut max) = (min?, max?);
        if self.kinematics == Kinematics::PlaneStrain {
            (min[2], max[2]) = (f64::NEG_INFINITY, f64::INFINITY);
        }
        let mut right = true;
        for axis in 0..3 {
            let message = format!(
                "{} is not larger than min[{axis}] = {}",
                figure(max[axis]),
                figure(min[axis])
            );
            right &= self.require(
                max[axis] > min[axis],
                &path.key("max").index(axis),
                message,
                "max > min along every axis",
            );
        }
        right.then_some(Shape::Box { min, max })
    }

    fn ball(&mut self, path: &Path, keys: &BallKeys) -> Option<Shape> {
        let centre = self.vector(&path.key("centre"), &keys.centre);
        let radius = self.positive(&path.key("radius"), keys.radius);
        let (centre, radius) = (centre?, radius?);
        Some(match self.kinematics {
            Kinematics::PlaneStrain => Shape::Cylinder {
                axis: 2,
                centre,
                radius,
                min: f64::NEG_INFINITY,
                max: f64::INFINITY,
            },
            Kinematics::ThreeDimensional => Shape::Ball { centre, radius },
        })
    }

    fn cylinder(&mut self, path: &Path, keys: &CylinderKeys) -> Option<Shape> {
        let centre = self.vector(&path.key("centre"), &keys.centre);
        let radius = self.positive(&path.key("radius"), keys.radius);
        let (axis, min, max) = self.extrusion(path, Some(keys.axis), keys.min, keys.max)?;
        Some(Shape::Cylinder {
            axis,
            centre: centre?,
            radius: radius?,
            min,
            max,
        })
    }

    fn ring_sector(&mut self, path: &Path, keys: &RingSectorKeys) -> Option<Shape> {
        let centre = self.vector(&path.key("centre"), &keys.centre);
        let inner = keys.inner_radius;
        let right = [
            self.require(
                inner >= 0.0,
                &path.key("inner_radius"),
                format!("{} is negative", figure(inner)),
                "a number >= 0",
            ),
            self.require(
                keys.outer_radius > inner || !self.sound(&path.key("inner_radius")),
                &path.key("outer_radius"),
                format!(
                    "{} is not larger than inner_radius = {}",
                    figure(keys.outer_radius),
                    figure(inner)
                ),
                "outer_radius > inner_radius",
            ),
            self.require(
                (keys.to_angle > keys.from_angle && keys.to_angle <= keys.from_angle + 360.0)
                    || !self.sound(&path.key("from_angle")),
                &path.key("to_angle"),
                format!(
                    "{} does not follow from_angle = {} by at most 360",
                    figure(keys.to_angle),
                    figure(keys.from_angle)
                ),
                "from_angle < to_angle <= from_angle + 360",
            ),
        ];
        let (axis, min, max) = self.extrusion(path, Some(keys.axis), keys.min, keys.max)?;
        if right.contains(&false) || !self.sound(path) {
            return None;
        }
        Some(Shape::RingSector {
            axis,
            centre: centre?,
            inner_radius: inner,
            outer_radius: keys.outer_radius,
            from_angle: keys.from_angle.to_radians(),
            to_angle: keys.to_angle.to_radians(),
            min,
            max,
        })
    }

    fn polygon(&mut self, path: &Path, keys: &PolygonKeys) -> Option<Shape> {
        let place = path.key("vertices");
        let mut right = true;
        let mut vertices = Vec::new();
        for (index, vertex) in keys.vertices.iter().enumerate() {
            let message = format!("a corner of {}", super::numbers(vertex.len()));
            right &= self.require(vertex.len() == 2, &place.index(index), message, "[x, y]");
            vertices.extend(<[f64; 2]>::try_from(vertex.as_slice()).ok());
        }
        let message = format!("{} corners", keys.vertices.len());
        right &= self.require(keys.vertices.len() >= 3, &place, message, "three corners or more");
        let (_, min, max) = self.extrusion(path, None, keys.min, keys.max)?;
        if !right || !self.sound(&place) {
            return None;
        }
        let flat = self.require(
            area(&vertices) > 0.0,
            &place,
            "the polygon has no area",
            "corners around an area",
        );
        flat.then_some(Shape::Polygon { vertices, min, max })
    }

    /// Axis and ends: in three dimensions all are given, in plane strain none, since z is the axis and has no end.
    /// `axis` is `None` where it is always z.
    fn extrusion(
        &mut self,
        path: &Path,
        axis: Option<Option<AxisName>>,
        min: Option<f64>,
        max: Option<f64>,
    ) -> Option<Extrusion> {
        if self.kinematics == Kinematics::PlaneStrain {
            for (key, given) in [
                ("axis", axis.flatten().is_some()),
                ("min", min.is_some()),
                ("max", max.is_some()),
            ] {
                self.require(
                    !given,
                    &path.key(key),
                    "plane strain has no use for this key",
                    "no value in plane strain",
                );
            }
            return Some((2, f64::NEG_INFINITY, f64::INFINITY));
        }
        let lacking = [
            ("axis", axis == Some(None)),
            ("min", min.is_none()),
            ("max", max.is_none()),
        ];
        for (key, lacks) in lacking {
            self.require(
                !lacks,
                &path.key(key),
                "this key is missing",
                "a value in three dimensions",
            );
        }
        let axis = match axis {
            Some(axis) => axis_index(axis?),
            None => 2,
        };
        let (min, max) = (min?, max?);
        let message = format!("{} is not larger than min = {}", figure(max), figure(min));
        self.require(max > min, &path.key("max"), message, "max > min")
            .then_some((axis, min, max))
    }
}

pub(super) fn axis_index(axis: AxisName) -> usize {
    match axis {
        AxisName::X => 0,
        AxisName::Y => 1,
        AxisName::Z => 2,
    }
}

/// Area of a polygon.
fn area(vertices: &[[f64; 2]]) -> f64 {
    let next = vertices.iter().cycle().skip(1);
    let twice: f64 = vertices
        .iter()
        .zip(next)
        .map(|(one, two)| one[0] * two[1] - two[0] * one[1])
        .sum();
    0.5 * twice.abs()
}
