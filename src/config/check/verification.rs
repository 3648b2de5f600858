//! Problems with a known solution: whether the scene is the one that the solution is for.

use super::Check;
use super::material::Material;
use crate::condition::dirichlet::Boundary;
use crate::config::decode::number;
use crate::config::file::ShapeKeys;
use crate::config::path::Path;
use crate::material::spec::{ElasticModuli, MaterialSpec};
use crate::points::seed::{Body, PointSource};
use crate::scene::ContinuumKind;
use crate::verification::Manufactured;

/// How far faces may be from those of the unit cube [m].
const ROUND_OFF: f64 = 1e-9;

/// What is known of the scene that the solution is for.
pub(super) struct Parts<'a> {
    pub bodies: Option<&'a [Body]>,
    pub materials: Option<&'a [Material]>,
    pub boundaries: Option<&'a [Boundary]>,
}

impl Check<'_> {
    /// The manufactured solution, where one is asked for; `Some(None)` where not.
    pub(super) fn manufactured(&mut self, parts: &Parts<'_>) -> Option<Option<Manufactured>> {
        let config = self.config;
        let Some(keys) = &config.verification.manufactured else {
            return Some(None);
        };
        let path = Path::root().key("verification").key("manufactured");
        let message = "the manufactured solution is one of material points of the micropolar continuum";
        let micropolar = self.continuum == ContinuumKind::Micropolar && !self.has_mesh();
        if !self.require(micropolar, &path, message, "continuum: micropolar and method: mpm") {
            return None;
        }
        let amplitude = self.amplitude(&path.key("amplitude"), &keys.amplitude);
        self.no_own_loads();
        self.unit_cube();
        if let Some(boundaries) = parts.boundaries {
            self.fixed_faces(boundaries);
        }
        let moduli = parts.bodies.zip(parts.materials);
        let moduli = moduli.and_then(|(bodies, materials)| self.one_elastic_body(bodies, materials));
        Some(Some(Manufactured {
            amplitude: amplitude?,
            moduli: moduli?,
        }))
    }

    fn amplitude(&mut self, path: &Path, text: &str) -> Option<f64> {
        let value = match text.split_once('/') {
            Some((above, below)) => number(above.trim()).zip(number(below.trim())).map(|(a, b)| a / b),
            None => number(text.trim()),
        };
        let value = value.filter(|value| *value > 0.0 && value.is_finite());
        let message = format!("\"{}\" is not an amplitude", crate::config::tree::shorten(text));
        self.require(
            value.is_some(),
            path,
            message,
            "a number > 0 or a fraction, such as 1/30",
        );
        value.filter(|_| self.sound(path))
    }

    fn no_own_loads(&mut self) {
        let config = self.config;
        let message = "the manufactured solution brings the loads that it needs";
        let expected = "no loads with verification.manufactured";
        self.require(config.loads.is_empty(), &Path::root().key("loads"), message, expected);
        let message = "the manufactured solution is one of uniform properties";
        let expected = "no regions with verification.manufactured";
        self.require(
            config.regions.is_empty(),
            &Path::root().key("regions"),
            message,
            expected,
        );
    }

    /// The faces of the grid must be those where the solution vanishes.
    fn unit_cube(&mut self) {
        let Some(grid) = self.grid.clone() else { return };
        let unit = |axis: usize| {
            let length = grid.cells[axis] as f64 * grid.cell_size[axis];
            grid.min[axis].abs() <= ROUND_OFF && (length - 1.0).abs() <= ROUND_OFF
        };
        let right = (0..self.kinematics.dimension()).all(unit);
        let message = "the manufactured solution is one of the unit cube";
        self.require(
            right,
            &Path::root().key("grid"),
            message,
            "a grid from 0 to 1 along each axis",
        );
    }

    /// Moduli of the material of the only body, which fills the grid.
    fn one_elastic_body(&mut self, bodies: &[Body], materials: &[Material]) -> Option<ElasticModuli> {
        let section = Path::root().key("bodies");
        let expected = "one body with verification.manufactured";
        self.require(bodies.len() <= 1, &section, "there are several bodies", expected);
        let body = bodies.first().filter(|_| bodies.len() == 1)?;
        let fills = |shape: &Option<ShapeKeys>| match shape {
            Some(ShapeKeys::Box(keys)) => {
                let at = |corner: &[f64], end: f64| corner.iter().all(|x| (x - end).abs() <= ROUND_OFF);
                at(&keys.min, 0.0) && at(&keys.max, 1.0)
            }
            _ => false,
        };
        let filled = matches!(body.points, PointSource::Lattice { .. }) && fills(&self.config.bodies[0].shape);
        let message = "the body of the manufactured solution does not fill the grid";
        let place = section.index(0).key("shape");
        self.require(filled, &place, message, "a box from 0 to 1 along each axis");
        match materials[body.material].named.spec {
            MaterialSpec::Elastic(moduli) => Some(moduli),
            MaterialSpec::Elastoplastic(..) | MaterialSpec::Sandstone(_) => {
                let message = "the manufactured solution is one of the elastic law";
                self.report(
                    &section.index(0).key("material"),
                    message,
                    "a material with law: elastic",
                );
                None
            }
        }
    }

    /// Each component of the unknowns must be fixed on each face, and nothing else prescribed.
    fn fixed_faces(&mut self, boundaries: &[Boundary]) {
        let Some(grid) = self.grid.clone() else { return };
        let section = Path::root().key("boundary");
        let faces = |axis: usize| [false, true].map(|upper| grid.face(axis, upper));
        let faces: Vec<_> = (0..self.kinematics.dimension()).flat_map(faces).collect();
        for (index, boundary) in boundaries.iter().enumerate() {
            let nodes = boundary.nodes();
            let plane = nodes.and_then(|nodes| nodes.plane);
            let on_face = plane.is_some_and(|plane| faces.contains(&plane));
            let plain = on_face && boundary.moves.is_empty() && boundary.stage == 0;
            let message = "the manufactured solution allows no other condition than fixed faces of the grid";
            let expected = "a face of the grid with fix, from the first stage on";
            let whole = nodes.is_some_and(|nodes| nodes.within.is_none());
            self.require(plain && whole, &section.index(index), message, expected);
        }
        for (number, face) in faces.iter().enumerate() {
            for (component, unknown) in self.unknowns().iter().enumerate() {
                let fixes = |boundary: &Boundary| {
                    let plane = boundary.nodes().and_then(|nodes| nodes.plane);
                    plane == Some(*face) && boundary.fix.contains(&component)
                };
                if boundaries.iter().any(fixes) {
                    continue;
                }
                let end = if number % 2 == 0 { "min" } else { "max" };
                let name = ["x", "y", "z"][face.axis];
                let message =
                    format!("{unknown} is not fixed on {name}_{end}, where the manufactured solution vanishes");
                self.report(&section, message, "all components fixed on all faces");
                return;
            }
        }
    }
}
