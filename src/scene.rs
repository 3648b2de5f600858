//! A valid scene: enums instead of strings, SI units, names resolved to indices, no "maybe".
//!
//! Vectors are three-dimensional; in plane strain the third component is zero and the third extent of the grid is one.

pub use crate::continuum::ContinuumKind;

use crate::condition::dirichlet::{Boundary, Component, GridPlane};
use crate::condition::pressure::Side;
use crate::grid::basis::{BSpline, Basis, Gimp, Linear};
use crate::grid::ghost::GhostSettings;
use crate::grid::mesh::MeshFace;
use crate::material::spec::MaterialSpec;
use crate::points::seed::{Body, PointSource, Region};
use crate::points::select::Selection;
use crate::solve::settings::{SolverSettings, Stage};
use crate::verification::Manufactured;

/// Everything that a run needs to know, checked.
///
/// Bodies, regions, boundaries, loads, stages and history columns have the order and number of the entries of the file, so
/// that `boundaries[2]` is `boundary[2]` for `config::Source::problem`.
#[derive(Clone, Debug)]
pub struct Scene {
    pub title: String,
    pub kinematics: Kinematics,
    pub continuum: ContinuumKind,
    pub grid: GridSettings,
    /// Materials of the file followed by their variants in regions.
    pub materials: Vec<NamedMaterial>,
    pub bodies: Vec<Body>,
    pub regions: Vec<Region>,
    pub boundaries: Vec<Boundary>,
    pub loads: Vec<Load>,
    pub stages: Vec<Stage>,
    pub solver: SolverSettings,
    pub ghost: Option<GhostSettings>,
    /// Solution that the run is loaded for and measured against, over the first stage.
    pub manufactured: Option<Manufactured>,
    pub output: OutputSettings,
}

impl Scene {
    /// Whether a mesh carries the points instead of the grid.
    pub fn is_on_a_mesh(&self) -> bool {
        let mesh = |body: &Body| matches!(body.points, PointSource::Mesh(_));
        self.bodies.iter().any(mesh)
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kinematics {
    PlaneStrain,
    ThreeDimensional,
}

impl Kinematics {
    pub fn dimension(self) -> usize {
        match self {
            Kinematics::PlaneStrain => 2,
            Kinematics::ThreeDimensional => 3,
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BasisKind {
    Linear,
    Gimp,
    /// Of order 1 to 3.
    BSpline(usize),
}

impl BasisKind {
    /// Whether the functions are hats, averaged over domains or not: too stiff where material keeps its volume.
    pub fn is_of_hats(self) -> bool {
        matches!(self, BasisKind::Linear | BasisKind::Gimp | BasisKind::BSpline(1))
    }

    /// The functions themselves.
    pub fn functions(self) -> Box<dyn Basis> {
        match self {
            BasisKind::Linear => Box::new(Linear),
            BasisKind::Gimp => Box::new(Gimp),
            BasisKind::BSpline(order) => Box::new(BSpline::new(order)),
        }
    }
}

/// Axis-aligned background grid; with a mesh, its cells with unit size and no place in space.
#[derive(Clone, Debug)]
pub struct GridSettings {
    pub min: [f64; 3],
    pub cell_size: [f64; 3],
    /// Cells per axis; 1 along an axis that plane strain does not have.
    pub cells: [usize; 3],
    pub basis: BasisKind,
    /// Face that follows its prescribed motion.
    pub follow_face: Option<GridPlane>,
}

impl GridSettings {
    /// Index of the plane of nodes on the lower or upper face of an axis.
    pub fn face(&self, axis: usize, upper: bool) -> GridPlane {
        let last = self.cells[axis] + self.basis.functions().order() - 1;
        let index = if upper { last } else { 0 };
        GridPlane { axis, index }
    }
}

#[derive(Clone, Debug)]
pub struct NamedMaterial {
    pub name: String,
    pub spec: MaterialSpec,
    /// Index of the material of the file that regions made it of; `None` for a material of the file.
    pub made_of: Option<usize>,
}

#[derive(Clone, Debug)]
pub struct Load {
    /// Given name, or a name made of its place in the list: `loads[0]`.
    pub name: String,
    pub kind: LoadKind,
    pub stage: usize,
}

#[derive(Clone, Debug)]
pub enum LoadKind {
    /// Weight per unit reference volume [N/m3], by index into `Scene::materials`.
    SpecificWeight(Vec<[f64; 3]>),
    /// A total force [N] (per metre of thickness in plane strain) shared equally by the selected points, or over a face.
    Force { total: [f64; 3], at: Target },
    /// A follower pressure [Pa] on points, each with a side of its domain on the surface.
    Pressure { pressure: f64, at: Vec<(Selection, Side)> },
    /// A total couple [N m], shared likewise; in plane strain only the third component counts.
    Couple { total: [f64; 3], at: Target },
}

/// What a load acts on, and where a field is looked at.
#[derive(Clone, Debug)]
pub enum Target {
    Points(Selection),
    /// A face of the mesh, over which a load is a uniform traction.
    Face(MeshFace),
}

#[derive(Clone, Debug)]
pub struct OutputSettings {
    pub directory: std::path::PathBuf,
    /// A snapshot of the points every so many accepted full steps; `None`: only first and last.
    pub snapshot_every: Option<usize>,
    /// A checkpoint every so many accepted full steps; `None`: by the time that they take.
    pub checkpoint_every: Option<usize>,
    pub history: Vec<HistoryColumn>,
    /// Whether a run ends with drawing `report.html`.
    pub report: bool,
    /// The resolved configuration as YAML text, for `config.yaml`.
    pub resolved: String,
    /// The same as a tree, to tell what changed before a restart.
    pub resolved_tree: serde_json::Value,
}

/// One entry of `output.history`; a vector or tensor quantity gives one column a component.
#[derive(Clone, Debug)]
pub struct HistoryColumn {
    pub name: String,
    pub quantity: HistoryQuantity,
}

#[derive(Clone, Debug)]
pub enum HistoryQuantity {
    /// Sum of the support's forces on the nodes of a boundary (by index), one component.
    Reaction { boundary: usize, component: Component },
    /// Prescribed motion of a boundary so far.
    BoundaryMotion { boundary: usize, component: Component },
    /// Reduction of a field of the points.
    Points {
        reduction: Reduction,
        field: PointField,
        at: Option<Selection>,
    },
    /// Mean over a face of the mesh; displacement or position.
    FaceMean { field: PointField, face: MeshFace },
    /// Load factor of a load (by index).
    LoadFactor { load: usize },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reduction {
    Maximum,
    Minimum,
    Mean,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PointField {
    Displacement,
    Position,
    Rotation,
    TwistX,
    TwistY,
    TwistZ,
    Chi,
    Alpha,
    Damage,
    Pressure,
    VonMises,
    Stress,
    CoupleStress,
    Wryness,
    Volume,
}

impl PointField {
    /// What the columns of the components are called, after the name of the entry and `_`; one empty word for a scalar.
    /// Tensors have all nine components, row by row, in both kinematics.
    pub fn components(self, kinematics: Kinematics) -> &'static [&'static str] {
        const TENSOR: &[&str] = &["xx", "xy", "xz", "yx", "yy", "yz", "zx", "zy", "zz"];
        match (self, kinematics) {
            (PointField::Displacement | PointField::Position, Kinematics::PlaneStrain) => &["x", "y"],
            (PointField::Displacement | PointField::Position | PointField::Rotation, Kinematics::ThreeDimensional) => {
                &["x", "y", "z"]
            }
            (PointField::Stress | PointField::CoupleStress | PointField::Wryness, _) => TENSOR,
            _ => &[""],
        }
    }
}

impl HistoryColumn {
    /// Names of the columns that the entry becomes.
    pub fn column_names(&self, kinematics: Kinematics) -> Vec<String> {
        let components = match self.quantity {
            HistoryQuantity::Points { field, .. } | HistoryQuantity::FaceMean { field, .. } => {
                field.components(kinematics)
            }
            _ => &[""],
        };
        let name_of = |component: &&str| match *component {
            "" => self.name.clone(),
            component => format!("{}_{component}", self.name),
        };
        components.iter().map(name_of).collect()
    }
}
