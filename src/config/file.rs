//! What a user may type: the keys of a configuration, their units and their defaults.
//!
//! These structs take whatever has the right form; `check` decides what makes sense. All values are in SI units, angles in
//! degrees, rotations in radians. A key without a value counts as not given.

use super::decode::SCALAR_OR;
use crate::material::spec::MaterialKeys;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{Deserializer, IgnoredAny, Visitor};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt;
use std::marker::PhantomData;

/// A configuration.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ConfigFile {
    /// What the run is about; shown in its output.
    #[serde(default)]
    pub title: String,
    /// Kinematics, continuum and method.
    pub model: ModelKeys,
    /// The background grid of `method: mpm`; not with `fem`.
    pub grid: Option<GridKeys>,
    /// Materials by name.
    pub materials: BTreeMap<String, MaterialKeys>,
    /// Bodies, made of material points; at least one.
    pub bodies: Vec<BodyKeys>,
    /// Changes of properties where a shape holds; they apply in order.
    #[serde(default)]
    pub regions: Vec<RegionKeys>,
    /// Conditions on nodes of the grid or mesh, or on material points.
    #[serde(default)]
    pub boundary: Vec<BoundaryKeys>,
    /// Weights, forces, couples and pressures.
    #[serde(default)]
    pub loads: Vec<LoadKeys>,
    /// Stages of the analysis, in order; at least one.
    pub stages: Vec<StageKeys>,
    /// Tolerances and the choice of solver.
    #[serde(default)]
    pub solver: SolverKeys,
    /// Remedies for cells that hold little material; none unless set.
    #[serde(default)]
    pub stabilisation: StabilisationKeys,
    /// Problems with a known solution; none unless set.
    #[serde(default)]
    pub verification: VerificationKeys,
    /// What the run writes, and where.
    #[serde(default)]
    pub output: OutputKeys,
    /// A path of deformation for `mpm-petsc point`; a run passes over it.
    pub path: Option<PathKeys>,
}

/// Kinematics, continuum and method.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ModelKeys {
    /// Plane strain has two coordinates and a thickness of 1 m.
    pub kinematics: KinematicsName,
    /// Which fields the body has.
    #[serde(default)]
    pub continuum: ContinuumName,
    /// How the body is discretised.
    #[serde(default)]
    pub method: MethodName,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum KinematicsName {
    PlaneStrain,
    ThreeDimensional,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ContinuumName {
    /// Displacement only.
    Classical,
    /// Displacement and independent rotation.
    #[default]
    Micropolar,
    /// Displacement, independent rotation and a nonlocal damage field, for `law: sandstone`.
    GradientMicropolar,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum MethodName {
    /// Material points on a background grid.
    #[default]
    Mpm,
    /// Finite elements: one body on a mesh that moves with it, without a grid.
    Fem,
}

/// The background grid, aligned with the axes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GridKeys {
    /// Lowest corner [m], one number per axis.
    pub min: Vec<f64>,
    /// Highest corner [m], one number per axis.
    pub max: Vec<f64>,
    /// Edge of a cell [m], > 0: one number or one per axis. It must divide the extent. Either this or `cells`.
    pub cell_size: Option<OneOrPerAxis<f64>>,
    /// Number of cells per axis, 1 or more. Either this or `cell_size`.
    pub cells: Option<OneOrPerAxis<usize>>,
    /// Shape functions.
    #[serde(default)]
    pub basis: BasisName,
    /// Face of the grid that moves with its prescribed motion: after each step the cells of its axis are stretched evenly.
    pub follow_face: Option<FaceName>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum BasisName {
    /// Hat functions at the centres of the points (standard MPM).
    Linear,
    /// Hat functions averaged over the domains of the points (GIMPM).
    #[default]
    Gimp,
    /// B-splines of order 1 at the centres of the points: the functions of `linear`.
    #[serde(rename = "bspline1")]
    BSpline1,
    /// B-splines of order 2, which are smooth: an axis has two functions more than cells, and conditions on planes are those
    /// on faces of the grid.
    #[serde(rename = "bspline2")]
    BSpline2,
    /// B-splines of order 3, likewise with three functions more than cells.
    #[serde(rename = "bspline3")]
    BSpline3,
}

/// A body of one material: it has a `shape`, or with `method: fem` a `mesh`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BodyKeys {
    /// Name for selections and output; each body has its own.
    pub name: String,
    /// Name of its material.
    pub material: String,
    /// What it fills in the initial state.
    pub shape: Option<ShapeKeys>,
    /// What it fills in the initial state, and the cells it is divided into, with `method: fem`.
    pub mesh: Option<MeshKeys>,
    /// Points per cell along an axis, 1 to 64: one number or one per axis. Not with a shape of `points`, which needs none;
    /// 2 unless set with a mesh.
    pub points_per_cell: Option<OneOrPerAxis<usize>>,
    /// Where in a cell the points are; `even` unless set, always `gauss` with a mesh.
    pub placement: Option<PlacementName>,
}

/// A mesh of quadrilaterals or hexahedra with axes of its own: either `box` or `ring_sector`.
///
/// In `boundary` and selections its faces are `x_min` to `z_max` along its own first, second and third axis: x, y, z of a
/// box; of a ring sector the angle from `from_angle` to `to_angle`, the radius, and the axis of the ring.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MeshKeys {
    /// A box.
    #[serde(rename = "box")]
    pub cuboid: Option<BoxKeys>,
    /// A sector of a ring with an inner radius > 0 and less than a full turn.
    pub ring_sector: Option<RingSectorKeys>,
    /// Number of cells along each axis of the mesh, 1 or more: one number or one per axis.
    pub cells: OneOrPerAxis<usize>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PlacementName {
    /// At the centres of equal parts of the cell.
    Even,
    /// At the points of Gauss' quadrature, with its weights; for points without domains.
    Gauss,
}

/// A change of properties where a shape holds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RegionKeys {
    /// Points whose centre is inside are changed.
    pub within: ShapeKeys,
    /// Factors by name of the key of the material; materials that do not set a key are left as they are.
    pub scale: BTreeMap<String, f64>,
}

/// A condition on nodes of the grid or mesh (`face`), or by a penalty on material points (`selection`).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BoundaryKeys {
    /// Name for `output.history`; each condition that has one has its own.
    pub name: Option<String>,
    /// A face of the grid or mesh, a plane `{axis: x, at: 0.0}` of the grid, or `all` nodes. Either this or `selection`.
    pub face: Option<FaceKeys>,
    /// Points that are tied to a support by springs; not a face of a mesh. Either this or `face`.
    pub selection: Option<SelectionKeys>,
    /// Stiffness of the springs of each point of the selection [N/m, for rotations N m/rad; per metre of thickness in plane
    /// strain], > 0. At most `solver.force_tolerance` / 1.1e-15 times the largest entry of the stiffness of the body; from a
    /// twentieth of that on a warning tells that steps may fail.
    pub penalty: Option<f64>,
    /// The support of the selection is a rigid platen that does not turn: translations that are neither moved nor named
    /// as free are fixed.
    pub rigid: Option<RigidKeys>,
    /// What the springs act on; `total` unless set.
    pub penalise: Option<PenaliseName>,
    /// Only nodes inside this shape; with `face`.
    pub within: Option<ShapeKeys>,
    /// Components whose increment is zero: `ux`, `uy`, `uz`, `rx`, `ry`, `rz`.
    #[serde(default)]
    pub fix: Vec<String>,
    /// How far components go over the stage [m, rad]: added linearly to where they are when it begins, and held afterwards.
    /// Back and forth by 10 mm in three stages is 0.01, -0.01, -0.01: at the ends of the stages 10, 0 and -10 mm. In a
    /// later stage 0 holds the component where it is.
    #[serde(default, rename = "move")]
    pub moves: BTreeMap<String, f64>,
    /// Stage from which it acts and over which it moves; the first one unless set.
    pub stage: Option<String>,
}

/// A rigid platen.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RigidKeys {
    /// Translations in which it moves freely, as the mean of its points: some of `ux`, `uy`, `uz`, but not all.
    #[serde(default)]
    pub free: Vec<String>,
}

/// What a penalty acts on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PenaliseName {
    /// The distance from the support since the condition began.
    Total,
    /// The distance that a step adds: the force of earlier steps is forgotten.
    Increment,
}

/// A face of the grid by name, or a plane of its nodes.
pub type FaceKeys = ScalarOr<FaceName, PlaneKeys>;

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FaceName {
    XMin,
    XMax,
    YMin,
    YMax,
    ZMin,
    ZMax,
    /// All nodes.
    All,
}

/// A plane of nodes of the grid.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlaneKeys {
    /// Normal of the plane.
    pub axis: AxisName,
    /// Coordinate along the axis [m]; nodes must lie there.
    pub at: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum AxisName {
    X,
    Y,
    Z,
}

/// A load: exactly one of `specific_weight`, `gravity`, `force`, `couple` and `pressure`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LoadKeys {
    /// Name for `load_factor` and for selections; each load that has one has its own.
    pub name: Option<String>,
    /// Weight per reference volume [N/m3], one number per axis.
    pub specific_weight: Option<Vec<f64>>,
    /// Acceleration [m/s2], one number per axis; the materials of all bodies need a `density`.
    pub gravity: Option<Vec<f64>>,
    /// Total force [N], one number per axis, shared equally by the points selected with `at`, or evenly over a face.
    pub force: Option<Vec<f64>>,
    /// Total couple [N m], shared likewise: three numbers, or in plane strain the one about z.
    pub couple: Option<OneOrPerAxis<f64>>,
    /// Pressure [Pa], positive onto the body, on a surface of a body: it stays normal to the surface, on its current area.
    pub pressure: Option<f64>,
    /// Points that carry a force or couple; for a pressure `surface`, or a `layer` towards one axis.
    pub at: Option<SelectionKeys>,
    /// Stage over which it ramps up; the first one unless set.
    pub stage: Option<String>,
}

/// A set of material points, found in the initial state; or a face of a mesh.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SelectionKeys {
    /// The point nearest to a position [m].
    Nearest(Vec<f64>),
    /// The points of a body that lie farthest in a direction.
    Layer(LayerKeys),
    /// The points on the surface of a body.
    Surface(SurfaceKeys),
    /// The points whose centre is inside a shape.
    Within(ShapeKeys),
    /// The points, or the face, that a named load acts on.
    Load(String),
    /// A face of the mesh with `method: fem`: a load acts there as uniform traction, and `mean` is that of `displacement`
    /// or `position` over the face.
    Face(FaceName),
}

/// The points of a body that lie farthest in a direction: either `face` or `direction`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LayerKeys {
    /// Name of the body.
    pub body: String,
    /// Towards a face of the grid: `x_min` to `z_max`; not with a mesh.
    pub face: Option<FaceName>,
    /// Any direction, one number per axis, not zero.
    pub direction: Option<Vec<f64>>,
}

/// The points of a body that have no neighbour of the same body in some direction: the surface of the union of their
/// domains. A curved surface is one of steps, whose areas have the right sums. Not of a mesh, nor of points from a file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SurfaceKeys {
    /// Name of the body.
    pub body: String,
    /// Directions that count: some of `x_min` to `z_max`; all unless set.
    pub facing: Option<Vec<FaceName>>,
}

/// A region of space. A point on its boundary counts as outside, a node as inside.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ShapeKeys {
    Box(BoxKeys),
    Ball(BallKeys),
    Cylinder(CylinderKeys),
    RingSector(RingSectorKeys),
    Polygon(PolygonKeys),
    /// Material points read from a file: only as the shape of a body.
    Points(PointsKeys),
    /// What all of the shapes hold.
    All(Vec<ShapeKeys>),
    /// What any of the shapes holds.
    Any(Vec<ShapeKeys>),
    /// What the shape does not hold.
    Not(Box<ShapeKeys>),
}

/// A box, aligned with the axes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BoxKeys {
    /// Lowest corner [m], one number per axis.
    pub min: Vec<f64>,
    /// Highest corner [m], one number per axis.
    pub max: Vec<f64>,
}

/// A ball; a disc in plane strain.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BallKeys {
    /// Centre [m], one number per axis.
    pub centre: Vec<f64>,
    /// Radius [m], > 0.
    pub radius: f64,
}

/// A circular cylinder; in plane strain a disc, and then `axis`, `min` and `max` are not given.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CylinderKeys {
    /// Axis of the cylinder.
    pub axis: Option<AxisName>,
    /// A point of the axis [m], one number per axis.
    pub centre: Vec<f64>,
    /// Radius [m], > 0.
    pub radius: f64,
    /// Lower end, a coordinate along the axis [m].
    pub min: Option<f64>,
    /// Upper end, a coordinate along the axis [m].
    pub max: Option<f64>,
}

/// A sector of a ring; in plane strain `axis`, `min` and `max` are not given.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RingSectorKeys {
    /// Axis of the ring.
    pub axis: Option<AxisName>,
    /// A point of the axis [m], one number per axis.
    pub centre: Vec<f64>,
    /// Inner radius [m], >= 0.
    pub inner_radius: f64,
    /// Outer radius [m], larger than the inner one.
    pub outer_radius: f64,
    /// Where the sector begins [degrees], counter-clockwise about the axis seen against it: axis z from +x towards y,
    /// x from +y towards z, y from +z towards x.
    pub from_angle: f64,
    /// Where the sector ends [degrees]: beyond its begin by at most 360.
    pub to_angle: f64,
    /// Lower end, a coordinate along the axis [m].
    pub min: Option<f64>,
    /// Upper end, a coordinate along the axis [m].
    pub max: Option<f64>,
}

/// A polygon in the plane of x and y; in three dimensions extruded from `min` to `max`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PolygonKeys {
    /// Corners `[x, y]` in order [m], three or more.
    pub vertices: Vec<Vec<f64>>,
    /// Lower end along z [m].
    pub min: Option<f64>,
    /// Upper end along z [m].
    pub max: Option<f64>,
}

/// Material points read from a file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PointsKeys {
    /// CSV file, relative to the configuration: position, volume and half-lengths of the domain in m and m3, with a thickness
    /// of 1 m in plane strain. Columns have the names in the first line, in any order: `x`, `y`, `z` (or `position_x` ..),
    /// `volume` (`vol`) and `lx`, `ly`, `lz` (`half_length_x` ..), in small or capital letters, a unit in brackets behind;
    /// without names the order is `x, y, volume, lx, ly`, or `x, y, z, volume, lx, ly, lz`. Commas, semicolons or tabs
    /// separate columns; decimals have points. Lines that begin with `#` are passed over.
    pub file: String,
}

/// A stage of the analysis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StageKeys {
    /// Name for `stage` of boundaries and loads; each stage has its own.
    pub name: String,
    /// Number of equal steps, 1 or more: the largest step, or with `adaptive` or `control` the first.
    pub steps: usize,
    /// How often a failed step may be halved, 0 to 40.
    #[serde(default = "default_halvings")]
    pub max_halvings: u32,
    /// Steps that grow and shrink with the number of iterations; `steps` sets the first one. Equal steps unless set.
    pub adaptive: Option<AdaptiveKeys>,
    /// Follows the equilibrium path beyond a limit point: the load is an unknown. Only in the last stage.
    pub control: Option<ControlKeys>,
}

/// What a step of a stage is measured by, in place of load and motion.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ControlKeys {
    /// The length of the path.
    pub arc_length: ArcLengthKeys,
}

/// Steps of a given length, the mean motion of points, along the equilibrium path. The load factor of the stage, which
/// all its loads share, is found with the motion and may fall again.
///
/// A step that fails is halved. The stage ends with its loads at full size, as `until` asks, or after `max_steps`: all
/// with exit code 0.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ArcLengthKeys {
    /// Points whose motion counts: root of the mean square, by volume. All unless set; not a face of a mesh.
    pub at: Option<SelectionKeys>,
    /// Length of a step [m], > 0. Unless set, the first step is one of load, 1/`steps` of it, and how far it moves the
    /// points is the length of those that follow.
    pub length: Option<f64>,
    /// Longest step [m], at least `length`: the next step is as many times as long as the last as `target_iterations` are
    /// more than the last one took, by a factor of 2 at most. Equal steps unless set.
    pub max_length: Option<f64>,
    /// Iterations that a step should take, 1 to `solver.max_iterations`, with `max_length`.
    #[serde(default = "default_target_iterations")]
    pub target_iterations: usize,
    /// Most steps that are taken, 1 or more.
    pub max_steps: usize,
    /// Where the path ends before; only at full load and after `max_steps` unless set.
    pub until: Option<UntilKeys>,
}

/// Where a path ends.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct UntilKeys {
    /// Mean displacement of the points of `at` since the initial state [m], > 0.
    pub displacement: f64,
}

/// Steps that grow and shrink with the number of iterations.
///
/// The next step is as many times as long as the last as `target_iterations` are more than the last one took, by a factor
/// of 2 at most. A step that fails is halved.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AdaptiveKeys {
    /// Longest step as a share of the stage, at least that of an equal step, 1/`steps`, and at most 1.
    pub max_step: f64,
    /// Iterations that a step should take, 1 to `solver.max_iterations`: linear solves, as in `newton_iterations` of the
    /// history.
    #[serde(default = "default_target_iterations")]
    pub target_iterations: usize,
}

fn default_target_iterations() -> usize {
    6
}

fn default_halvings() -> u32 {
    12
}

/// Tolerances and the choice of solver.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SolverKeys {
    /// Out-of-balance force over external and support force, > 0 and < 1; also the residual of a nonlocal damage field
    /// over its own terms.
    pub force_tolerance: f64,
    /// Work of the out-of-balance force on the last correction [J], > 0; off unless set.
    pub energy_tolerance: Option<f64>,
    /// Residual of the local iteration of a plastic law, > 0 and < 1.
    pub return_map_tolerance: f64,
    /// Newton iterations before a step is cut, 1 or more.
    pub max_iterations: usize,
    /// Linear solver; `auto` is the iterative one in space from 50 000 unknowns on, otherwise the direct one.
    pub method: SolverMethodName,
    /// Whether the direct solver repeats to the last bit on the same number of ranks; `auto` is up to 250 000 entries in the
    /// matrix, where that takes no longer.
    pub repeatable: RepeatableName,
    /// How the grid is shared among the ranks.
    pub partitioner: PartitionerName,
    /// Options for PETSc, as on its command line; those that start a debugger, trap or abort are refused.
    pub petsc_options: String,
}

impl Default for SolverKeys {
    fn default() -> SolverKeys {
        SolverKeys {
            force_tolerance: 1e-9,
            energy_tolerance: None,
            return_map_tolerance: 1e-9,
            max_iterations: 15,
            method: SolverMethodName::Auto,
            repeatable: RepeatableName::Auto,
            partitioner: PartitionerName::Auto,
            petsc_options: String::new(),
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SolverMethodName {
    Auto,
    /// A factorisation by MUMPS: takes any system that has a solution.
    Direct,
    /// GMRES with incomplete factors: a fraction of memory and time for compact bodies in space; may fail on slender ones.
    Iterative,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum RepeatableName {
    Auto,
    /// Every rank factorises all of the matrix: more time and memory for large ones.
    Always,
    /// The ranks share every factorisation; sums are taken in the order in which messages arrive.
    Never,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum PartitionerName {
    Auto,
    Metis,
    PtScotch,
    ParMetis,
}

/// Remedies for cells that hold little material.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct StabilisationKeys {
    /// Ghost penalty on faces of cells at the edge of the body.
    pub ghost: Option<GhostKeys>,
}

/// Ghost penalty.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GhostKeys {
    /// Factor for translations, gamma_g1 [Pa], >= 0.
    pub translation: f64,
    /// Factor for rotations, gamma_g2 [N], >= 0: given where there are rotations.
    pub rotation: Option<f64>,
    /// Power of the cell size.
    #[serde(default)]
    pub scaling: GhostScalingName,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum GhostScalingName {
    /// h^3 / 3, as printed by O'Hare (2025).
    #[default]
    Paper,
    /// h / 3, which has the units of a stiffness.
    Stiffness,
}

/// Problems with a known solution.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct VerificationKeys {
    /// Loads the body for the sine-product solution of O'Hare (2025), section 3.5.1, and writes how far the run is from it
    /// (`error_u`, `error_theta`, `error_sigma`, `error_mu`) into `summary.json`. For one elastic body that fills the unit
    /// cube (square in plane strain) of the grid, all components fixed on all faces, without other loads.
    pub manufactured: Option<ManufacturedKeys>,
}

/// The sine-product solution: every component of displacement and rotation vector is
/// `amplitude sin(2 pi x) sin(2 pi y) sin(2 pi z)` of the reference position.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ManufacturedKeys {
    /// Amplitude [m, rad], > 0: a number or a simple fraction.
    #[serde(default = "default_amplitude")]
    pub amplitude: String,
}

fn default_amplitude() -> String {
    "1/30".to_owned()
}

/// What the run writes, and where.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct OutputKeys {
    /// Result folder; `results/NAME_OF_THE_FILE` unless set.
    pub directory: Option<String>,
    /// Snapshots of the material points; the first and the last state are always written.
    pub snapshots: Option<EveryKeys>,
    /// Checkpoints from which `--restart` goes on; unless set, as often as takes a fiftieth of the wall time. The last
    /// state, and the one before a stop by a signal, always give one.
    pub checkpoint: Option<EveryKeys>,
    /// Columns of `history.csv`.
    pub history: Vec<HistoryKeys>,
    /// Whether a run ends with drawing `report.html` and its figures.
    pub report: bool,
}

impl Default for OutputKeys {
    fn default() -> Self {
        OutputKeys {
            directory: None,
            snapshots: None,
            checkpoint: None,
            history: Vec::new(),
            report: true,
        }
    }
}

/// How often something is written.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EveryKeys {
    /// Number of steps between two of them, 1 or more.
    pub every: usize,
}

/// A column of `history.csv`, or one per component: exactly one of the quantities.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HistoryKeys {
    /// Name of the column, before `_x`, `_y` of its components.
    pub name: String,
    /// Force [N] or couple [N m] of the support on the body.
    pub reaction: Option<BoundaryComponentKeys>,
    /// Prescribed motion so far [m, rad].
    pub boundary_motion: Option<BoundaryComponentKeys>,
    /// Largest value of a field.
    pub max: Option<FieldName>,
    /// Smallest value of a field.
    pub min: Option<FieldName>,
    /// Mean value of a field.
    pub mean: Option<FieldName>,
    /// Load factor of a named load.
    pub load_factor: Option<String>,
    /// Points for `max`, `min` and `mean`; all unless set.
    pub at: Option<SelectionKeys>,
}

/// A component of a named boundary.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BoundaryComponentKeys {
    /// Name of an entry of `boundary`.
    pub boundary: String,
    /// `ux`, `uy`, `uz`, `rx`, `ry` or `rz`.
    pub component: String,
}

/// A field of the material points.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FieldName {
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

/// One value, or a list of one per axis.
pub type OneOrPerAxis<T> = ScalarOr<T, Vec<T>>;

/// A scalar of one type, or a list or mapping of another.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum ScalarOr<S, C> {
    Scalar(S),
    Collection(C),
}

impl<S: JsonSchema, C: JsonSchema> JsonSchema for ScalarOr<S, C> {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        format!("{}Or{}", S::schema_name(), C::schema_name()).into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let (scalar, collection) = (generator.subschema_for::<S>(), generator.subschema_for::<C>());
        json_schema!({ "anyOf": [scalar, collection] })
    }
}

impl<'de, S: Deserialize<'de>, C: Deserialize<'de>> Deserialize<'de> for ScalarOr<S, C> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_newtype_struct(SCALAR_OR, ScalarOrVisitor(PhantomData))
    }
}

/// Told by the deserializer of `decode` which of the two stands there.
struct ScalarOrVisitor<S, C>(PhantomData<(S, C)>);

impl<'de, S: Deserialize<'de>, C: Deserialize<'de>> Visitor<'de> for ScalarOrVisitor<S, C> {
    type Value = ScalarOr<S, C>;

    fn expecting(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "one value or several")
    }

    fn visit_newtype_struct<D: Deserializer<'de>>(self, deserializer: D) -> Result<Self::Value, D::Error> {
        S::deserialize(deserializer).map(ScalarOr::Scalar)
    }

    fn visit_some<D: Deserializer<'de>>(self, deserializer: D) -> Result<Self::Value, D::Error> {
        C::deserialize(deserializer).map(ScalarOr::Collection)
    }
}

/// The path of deformation of `mpm-petsc point`: end values that are reached linearly in `steps` steps (the deformation
/// gradient from none, the wryness and the rotation vector from zero), or a `file` of states.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PathKeys {
    /// Name of the material that is driven.
    pub material: String,
    /// That of `model` unless set.
    pub kinematics: Option<KinematicsName>,
    /// That of `model` unless set, or `micropolar`.
    pub continuum: Option<ContinuumName>,
    /// Number of equal steps, 1 to 1000000; not with a `file`.
    pub steps: Option<usize>,
    /// Deformation gradient at the end [-]: rows of 3 numbers, or of 2 in plane strain; none unless set.
    pub deformation_gradient: Option<Vec<Vec<f64>>>,
    /// Rotation vector at the end [rad]: 3 numbers, or in plane strain the angle about z; none unless set.
    pub rotation: Option<OneOrPerAxis<f64>>,
    /// Wryness at the end [1/m]: 3 rows of 3 numbers, in plane strain only `zx` and `zy` not zero; none unless set.
    pub wryness: Option<Vec<Vec<f64>>>,
    /// Nonlocal damage field at the end [-], where the continuum has one; zero unless set.
    pub alpha: Option<f64>,
    /// CSV file of states (written like one of points), relative to the configuration, with names in its first line: any of
    /// `F_xx` to `F_zz`, `rotation_x` to `rotation_z`, `wryness_xx` to `wryness_zz` and `alpha`, the others as without
    /// deformation; further columns that `point` prints are passed over.
    pub file: Option<String>,
}

/// What `mpm-petsc point` reads of a configuration; the other keys of a scene may stand there.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PointFile {
    #[serde(default, rename = "title")]
    pub _title: String,
    pub model: Option<ModelKeys>,
    pub materials: BTreeMap<String, MaterialKeys>,
    #[serde(default)]
    pub solver: SolverKeys,
    pub path: PathKeys,
    #[serde(default, rename = "grid")]
    pub _grid: IgnoredAny,
    #[serde(default, rename = "bodies")]
    pub _bodies: IgnoredAny,
    #[serde(default, rename = "regions")]
    pub _regions: IgnoredAny,
    #[serde(default, rename = "boundary")]
    pub _boundary: IgnoredAny,
    #[serde(default, rename = "loads")]
    pub _loads: IgnoredAny,
    #[serde(default, rename = "stages")]
    pub _stages: IgnoredAny,
    #[serde(default, rename = "stabilisation")]
    pub _stabilisation: IgnoredAny,
    #[serde(default, rename = "verification")]
    pub _verification: IgnoredAny,
    #[serde(default, rename = "output")]
    pub _output: IgnoredAny,
}
