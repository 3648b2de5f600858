//! A small block of scattered points on a grid, for tests of the kernel.

use mpm_petsc::app::Laws;
use mpm_petsc::assembly::model::Model;
use mpm_petsc::assembly::penalty::GhostPenalty;
use mpm_petsc::continuum::Fields;
use mpm_petsc::grid::Grid;
use mpm_petsc::grid::basis::Basis;
use mpm_petsc::grid::ghost::{GhostScaling, GhostSettings};
use mpm_petsc::material::Components;
use mpm_petsc::material::spec::{
    ElasticModuli, MaterialSpec, PlasticParameters, SandstoneDamage, SandstoneParameters, SandstoneYield,
};
use mpm_petsc::parallel::World;
use mpm_petsc::points::seed::{Body, PointSource, SeedPoint, seed};

pub const ELASTIC: ElasticModuli = ElasticModuli {
    lambda: 8.0e6,
    mu: 6.0e6,
    kappa: 1.0e6,
    alpha: 5.0,
    beta: 40.0,
    gamma: 100.0,
};
pub const PLASTIC: PlasticParameters = PlasticParameters {
    friction_slope: 0.6,
    dilatancy_slope: 0.2,
    yield_strength: 50.0e3,
    hardening_modulus: 1.0e5,
    plastic_length: 2.0e-3,
    tolerance: 1.0e-13,
};

#[allow(dead_code, reason = "not every test of the kernel has a damage field")]
pub const SANDSTONE: SandstoneParameters = SandstoneParameters {
    shear_modulus: 6.0e6,
    bulk_modulus: 12.0e6,
    coupling_modulus: 1.0e6,
    alpha: 5.0,
    beta: 40.0,
    gamma: 100.0,
    plastic: Some(SandstoneYield {
        strength: 50.0e3,
        friction_slope: 0.6,
        dilatancy_slope: 0.4,
        hardening_stress: 10.0e3,
        hardening_rate: 50.0,
        dilation_rate: 1.0,
        plastic_length: 2.0e-3,
        weights: [0.5, 0.0, 0.5, 0.0],
        apex_rounding: 1.0e3,
        tolerance: 1.0e-13,
    }),
    damage: Some(SandstoneDamage {
        length: 5.0e-3,
        softening_modulus: 0.11,
        max_damage: 0.99,
    }),
};

/// Deterministic numbers in [-1, 1).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

/// A block of 2^D cells with 2^D scattered points each, in a grid one cell larger on each side.
pub fn model<C: Fields<D, N> + Laws, const D: usize, const N: usize>(
    world: &World,
    basis: Box<dyn Basis>,
    spec: MaterialSpec,
) -> Model<C, D, N> {
    const H: f64 = 0.01;
    let grid = Grid {
        min: [0.0; D],
        cell_size: [H; D],
        cells: [4; D],
        order: basis.order(),
    };
    let mut random = Random(7);
    let mut list = Vec::new();
    for flat in 0..4usize.pow(D as u32) {
        let mut position = [0.0; 3];
        let mut rest = flat;
        for x in position.iter_mut().take(D) {
            *x = H * (1.25 + 0.5 * (rest % 4) as f64 + 0.1 * random.next());
            rest /= 4;
        }
        let half = 0.27 * H;
        list.push(SeedPoint {
            position,
            volume: (0.5 * H).powi(D as i32),
            half_lengths: [half, half, half],
        });
    }
    let components = if D == 2 { Components::Plane } else { Components::Space };
    let laws = vec![C::law(&spec, components)];
    let bodies = [Body {
        name: "block".into(),
        material: 0,
        points: PointSource::List(list),
    }];
    let (points, _) = seed(world, &grid, &bodies, &[]);
    let settings = GhostSettings {
        translation: 1.0e9,
        rotation: 1.0e5,
        scaling: GhostScaling::Paper,
    };
    let ghost = Some(GhostPenalty::new(&settings, &C::KIND));
    let mut model = Model {
        initial_grid: grid.clone(),
        elements: None,
        follow_face: None,
        grid,
        basis,
        laws,
        points,
        boundaries: Vec::new(),
        loads: Vec::new(),
        face_loads: Vec::new(),
        surface: Default::default(),
        ghost,
        path_points: None,
    };
    model.start_histories();
    model
}

/// Increments of a smooth random field: its gradient stays of the order of `size` at every point.
pub fn field<C: Fields<D, N> + Laws, const D: usize, const N: usize>(
    model: &Model<C, D, N>,
    nodes: &[u64],
    size: f64,
    seed: u64,
) -> Vec<f64> {
    let mut random = Random(seed);
    let coefficients: Vec<[f64; 4]> = (0..N).map(|_| std::array::from_fn(|_| random.next())).collect();
    nodes
        .iter()
        .flat_map(|&key| {
            let x = model.grid.node_position(&model.grid.node(key));
            let values: Vec<f64> = coefficients
                .iter()
                .zip(C::IS_TRANSLATION)
                .map(|(c, translation)| {
                    let linear = c[0] * x[0] + c[1] * x[1] + c[2] * x[2] + 30.0 * c[3] * x[0] * x[1];
                    // Rotations vary over a length of the order of the internal one.
                    if translation {
                        size * linear
                    } else {
                        size * (10.0 * linear + 0.3 * c[3])
                    }
                })
                .collect();
            values
        })
        .collect()
}
