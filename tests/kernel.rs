//! The kernel as a whole: the tangent is the derivative of the residual, for points on a grid with random increments.
//!
//! Goal: for every continuum, both dimensions, every basis, elastic and plastic points, with ghost penalty, penalties on
//! points, platens and follower pressure, the remainder
//! `r(u + h d) - r(u) - h K d` falls as `h^2`; a rigid motion of virgin points makes no forces; and residual and
//! tangent leave the accepted state of the points untouched.

#[path = "common/block.rs"]
mod block;
#[path = "common/cases.rs"]
mod cases;

use block::{ELASTIC, PLASTIC, SANDSTONE, field, model};
use mpm_petsc::app::Laws;
use mpm_petsc::assembly::Sink;
use mpm_petsc::assembly::balance::{Balance, StepTerms};
use mpm_petsc::assembly::kernel::Workspace;
use mpm_petsc::assembly::model::{Model, StepSystem};
use mpm_petsc::clock::Clock;
use mpm_petsc::condition::Time;
use mpm_petsc::condition::pressure::{Patch, Pressure, Side};
use mpm_petsc::condition::weak::{Goal, Measure, Tie, platen_of};
use mpm_petsc::continuum::classical::Classical;
use mpm_petsc::continuum::gradient_micropolar::GradientMicropolar;
use mpm_petsc::continuum::micropolar::Micropolar;
use mpm_petsc::continuum::{Fields, Linearisation};
use mpm_petsc::grid::basis::{BSpline, Basis, Gimp, Linear};
use mpm_petsc::material::spec::MaterialSpec;
use mpm_petsc::parallel::World;
use std::rc::Rc;

/// A dense matrix over local unknowns.
struct Dense {
    unknowns: usize,
    width: usize,
    entries: Vec<f64>,
}

impl Sink for Dense {
    fn add(&mut self, nodes: &[u32], tangent: &[f64]) {
        let index = |k: usize| nodes[k / self.unknowns] as usize * self.unknowns + k % self.unknowns;
        let size = nodes.len() * self.unknowns;
        for row in 0..size {
            for column in 0..size {
                self.entries[index(row) * self.width + index(column)] += tangent[row * size + column];
            }
        }
    }
}

/// Everything that the points carry, bit by bit.
fn record<C: Fields<D, N> + Laws, const D: usize, const N: usize>(model: &Model<C, D, N>) -> Vec<u64> {
    let mut record = Vec::new();
    (0..model.points.len()).for_each(|p| model.points.pack(p, &mut record));
    record.into_iter().map(f64::to_bits).collect()
}

/// All internal forces, as the solver adds them up.
fn forces<C: Fields<D, N> + Laws, const D: usize, const N: usize>(
    balance: &mut Balance<C, D, N>,
    model: &mut Model<C, D, N>,
    system: &StepSystem<D>,
    u: &[f64],
) -> Vec<f64> {
    let mut forces = vec![0.0; u.len()];
    let acting = &model.surface.acting(NOW);
    balance
        .add_forces(model, &StepTerms { system, acting }, u, &mut forces)
        .expect("a response");
    forces
}

/// The end of the step.
const NOW: Time = Time {
    stage: 0,
    fraction: 0.7,
};

/// Ties the points at the lower end of the first axis to a platen that is free along it, those at its upper end in all
/// other unknowns to a platen that is not, and puts all sides of the block under a pressure as large as the moduli.
fn load<C: Fields<D, N> + Laws, const D: usize, const N: usize>(model: &mut Model<C, D, N>) {
    let mut patches = Vec::new();
    for axis in 0..D {
        for upper in [false, true] {
            let side = Side { axis, upper };
            patches.push(Patch {
                bit: patches.len(),
                side,
            });
        }
    }
    for (p, marks) in model.points.marks.iter_mut().enumerate() {
        for (bit, patch) in patches.iter().enumerate() {
            // The block has four points along each axis, the first axis fastest.
            let place = model.points.id[p] as usize / 4usize.pow(patch.side.axis as u32) % 4;
            *marks |= u64::from(place == if patch.side.upper { 3 } else { 0 }) << bit;
        }
    }
    model.surface.pressures.push(Pressure {
        stage: 0,
        pressure: 4.0e6,
        patches,
    });
    for component in 0..N {
        let free = component == 0;
        model.surface.ties.push(Tie {
            boundary: usize::from(!free),
            bit: usize::from(!free),
            slot: component,
            component,
            stage: 0,
            penalty: if C::IS_TRANSLATION[component] { 1.0e6 } else { 1.0e2 },
            goal: if free { Goal::Free } else { Goal::Prescribed(1.0e-3) },
            measure: Measure::Total,
        });
    }
    model.points.keep_gaps(N);
}

fn taylor<C: Fields<D, N> + Laws, const D: usize, const N: usize>(
    world: &World,
    basis: Box<dyn Basis>,
    spec: MaterialSpec,
    size: f64,
) {
    let mut model = model::<C, D, N>(world, basis, spec);
    load(&mut model);
    let mut balance = Balance::<C, D, N>::new(Rc::new(Clock::start()));
    // One accepted step first, so that the state is not virgin and domains have grown.
    let system = model.search(world, 0).unwrap();
    assert!(!system.faces.faces.is_empty());
    let u = field(&model, &system.active.nodes, 0.7 * size, 3);
    forces(&mut balance, &mut model, &system, &u);
    model.accept_gaps(&system, &model.surface.acting(NOW), &u);
    model.accept(world, &mut balance.points, &system.batches, &system.active, &u);
    assert!(model.points.gaps.iter().any(|&gap| gap != 0.0));
    let system = model.search(world, 0).unwrap();
    assert_eq!(
        system
            .active
            .nodes
            .iter()
            .filter(|&&key| platen_of(key).is_some())
            .count(),
        2
    );
    let accepted = record(&model);
    let u = field(&model, &system.active.nodes, size, 11);
    let direction = field(&model, &system.active.nodes, size, 12);
    let start = forces(&mut balance, &mut model, &system, &u);
    let width = u.len();
    let mut dense = Dense {
        unknowns: N,
        width,
        entries: vec![0.0; width * width],
    };
    let (system, acting) = (&system, &model.surface.acting(NOW));
    let terms = StepTerms { system, acting };
    balance
        .add_stiffness(&model, &terms, &u, Linearisation::Consistent, &mut dense)
        .expect("moduli");
    let product: Vec<f64> = dense
        .entries
        .chunks_exact(width)
        .map(|row| row.iter().zip(&direction).map(|(k, d)| k * d).sum())
        .collect();
    let scale = product.iter().map(|value| value * value).sum::<f64>().sqrt();
    let remainder = |h: f64, model: &mut Model<C, D, N>, balance: &mut Balance<C, D, N>| {
        let moved: Vec<f64> = u.iter().zip(&direction).map(|(u, d)| u + h * d).collect();
        let end = forces(balance, model, system, &moved);
        let squares = (0..width)
            .map(|i| (end[i] - start[i] - h * product[i]).powi(2))
            .sum::<f64>();
        squares.sqrt() / (h * scale)
    };
    let errors: Vec<f64> = [1e-2, 1e-3, 1e-4]
        .iter()
        .map(|&h| remainder(h, &mut model, &mut balance))
        .collect();
    println!("  remainders relative to the first-order term {errors:?}");
    assert!(
        errors[1] < 0.13 * errors[0] && errors[2] < 0.13 * errors[1],
        "not of second order: {errors:?}"
    );
    assert!(errors[2] < 1e-3, "{errors:?}");
    assert!(record(&model) == accepted, "an evaluation changed the accepted state");
}

/// A rigid rotation and translation of virgin points makes no forces but those of the penalty, which is switched off.
fn rigid_motion<C: Fields<3, N> + Laws, const N: usize>(world: &World, basis: Box<dyn Basis>, spec: MaterialSpec) {
    let mut model = model::<C, 3, N>(world, basis, spec);
    let system = model.search(world, 0).unwrap();
    let vector = nalgebra::Vector3::new(0.4, -0.7, 0.5);
    let rotation = nalgebra::Rotation3::new(vector);
    let u: Vec<f64> = system
        .active
        .nodes
        .iter()
        .flat_map(|&key| {
            let x = nalgebra::Vector3::from(model.grid.node_position(&model.grid.node(key)));
            let moved = rotation * x - x + nalgebra::Vector3::new(0.01, 0.0, -0.02);
            // Translations, and where there are any the rotations and a damage field of zero behind them.
            moved
                .iter()
                .chain(&vector)
                .chain(&[0.0])
                .take(N)
                .copied()
                .collect::<Vec<_>>()
        })
        .collect();
    model.ghost = None;
    let mut workspace = Workspace::<C, 3, N>::new(Rc::new(Clock::start()));
    let mut forces = vec![0.0; u.len()];
    let Model { laws, points, .. } = &mut model;
    workspace
        .add_internal_forces(laws, &system.batches, &system.active, points, &u, &mut forces)
        .unwrap();
    let largest = forces.iter().fold(0.0f64, |largest, force| largest.max(force.abs()));
    // A stress of the order of the moduli would make forces of 1e6 Pa x 1e-4 m2 = 100 N.
    assert!(largest < 1e-10, "largest force {largest}");
}

/// A pressure on all sides of a body has no resultant, also after a rotation: the area vectors close and turn as one.
fn pressure_on_a_closed_surface<C: Fields<3, N> + Laws, const N: usize>(world: &World) {
    let mut model = model::<C, 3, N>(world, Box::new(Gimp), MaterialSpec::Elastic(ELASTIC));
    load(&mut model);
    let system = model.search(world, 0).unwrap();
    let rotation = nalgebra::Rotation3::new(nalgebra::Vector3::new(0.4, -0.7, 0.5));
    let mut u = vec![0.0; system.active.nodes.len() * N];
    for (&key, u) in system.active.nodes.iter().zip(u.chunks_exact_mut(N)) {
        let x = nalgebra::Vector3::from(model.grid.node_position(&model.grid.node(key)));
        u[..3].copy_from_slice((rotation * x - x).as_slice());
    }
    let acting = model.surface.acting(NOW);
    let mut forces = vec![0.0; u.len()];
    let terms = StepTerms {
        system: &system,
        acting: &acting,
    };
    terms.surface(&model).add_pressure_forces(&u, -1.0, &mut forces);
    let sum = |k: usize| forces.chunks_exact(N).map(|node| node[k]).sum::<f64>();
    let largest = forces.iter().fold(0.0f64, |largest, force| largest.max(force.abs()));
    // 16 points of a side share 0.7 x 4 MPa on 16 x (0.54 h)^2: some 80 N each.
    assert!(largest > 10.0, "largest force {largest}");
    let resultant: Vec<f64> = (0..3).map(sum).collect();
    assert!(resultant.iter().all(|sum| sum.abs() < 1e-10 * largest), "{resultant:?}");
    // The pressure pushes onto the body: its forces do negative work on a growing one.
    let work: f64 = system
        .active
        .nodes
        .iter()
        .zip(forces.chunks_exact(N))
        .filter(|&(&key, _)| platen_of(key).is_none())
        .map(|(&key, force)| {
            let x = nalgebra::Vector3::from(model.grid.node_position(&model.grid.node(key)));
            (rotation * x).dot(&nalgebra::Vector3::new(force[0], force[1], force[2]))
        })
        .sum();
    assert!(work < -1.0, "{work}");
}

fn main() {
    let world = World::start().expect("MPI starts once");
    let elastic = MaterialSpec::Elastic(ELASTIC);
    let plastic = MaterialSpec::Elastoplastic(ELASTIC, PLASTIC);
    let sandstone = MaterialSpec::Sandstone(SANDSTONE);
    cases::run(&[
        ("plane_linear_elastic", &|| {
            taylor::<Micropolar, 2, 3>(&world, Box::new(Linear), elastic, 0.3)
        }),
        ("plane_gimp_elastic", &|| {
            taylor::<Micropolar, 2, 3>(&world, Box::new(Gimp), elastic, 0.3)
        }),
        ("plane_gimp_plastic", &|| {
            taylor::<Micropolar, 2, 3>(&world, Box::new(Gimp), plastic, 0.05)
        }),
        ("space_linear_elastic", &|| {
            taylor::<Micropolar, 3, 6>(&world, Box::new(Linear), elastic, 0.3)
        }),
        ("space_gimp_elastic", &|| {
            taylor::<Micropolar, 3, 6>(&world, Box::new(Gimp), elastic, 0.2)
        }),
        ("space_gimp_plastic", &|| {
            taylor::<Micropolar, 3, 6>(&world, Box::new(Gimp), plastic, 0.05)
        }),
        ("plane_splines", &|| {
            for order in 1..=3 {
                taylor::<Micropolar, 2, 3>(&world, Box::new(BSpline::new(order)), elastic, 0.3);
                taylor::<Micropolar, 2, 3>(&world, Box::new(BSpline::new(order)), plastic, 0.05);
            }
        }),
        ("space_splines", &|| {
            for order in [2, 3] {
                taylor::<Micropolar, 3, 6>(&world, Box::new(BSpline::new(order)), elastic, 0.2);
            }
        }),
        ("classical_plane_linear_elastic", &|| {
            taylor::<Classical, 2, 2>(&world, Box::new(Linear), elastic, 0.3)
        }),
        ("classical_plane_gimp_plastic", &|| {
            taylor::<Classical, 2, 2>(&world, Box::new(Gimp), plastic, 0.05)
        }),
        ("classical_space_linear_elastic", &|| {
            taylor::<Classical, 3, 3>(&world, Box::new(Linear), elastic, 0.2)
        }),
        ("classical_space_gimp_plastic", &|| {
            taylor::<Classical, 3, 3>(&world, Box::new(Gimp), plastic, 0.05)
        }),
        ("pressure_on_a_closed_surface", &|| {
            pressure_on_a_closed_surface::<Micropolar, 6>(&world)
        }),
        ("damage_plane_linear_elastic", &|| {
            taylor::<GradientMicropolar, 2, 4>(&world, Box::new(Linear), sandstone, 0.001)
        }),
        ("damage_plane_gimp_plastic", &|| {
            taylor::<GradientMicropolar, 2, 4>(&world, Box::new(Gimp), sandstone, 0.05)
        }),
        ("damage_plane_splines_plastic", &|| {
            taylor::<GradientMicropolar, 2, 4>(&world, Box::new(BSpline::new(2)), sandstone, 0.05)
        }),
        ("damage_space_linear_plastic", &|| {
            taylor::<GradientMicropolar, 3, 7>(&world, Box::new(Linear), sandstone, 0.02)
        }),
        ("damage_space_gimp_plastic", &|| {
            taylor::<GradientMicropolar, 3, 7>(&world, Box::new(Gimp), sandstone, 0.02)
        }),
        ("damage_space_splines_plastic", &|| {
            taylor::<GradientMicropolar, 3, 7>(&world, Box::new(BSpline::new(2)), sandstone, 0.02)
        }),
        ("damage_rigid_motion_makes_no_forces", &|| {
            rigid_motion::<GradientMicropolar, 7>(&world, Box::new(Gimp), sandstone);
            rigid_motion::<GradientMicropolar, 7>(&world, Box::new(BSpline::new(2)), sandstone);
        }),
        ("rigid_motion_makes_no_forces", &|| {
            rigid_motion::<Micropolar, 6>(&world, Box::new(Gimp), elastic);
            rigid_motion::<Micropolar, 6>(&world, Box::new(BSpline::new(2)), elastic);
        }),
        ("classical_rigid_motion_makes_no_forces", &|| {
            rigid_motion::<Classical, 3>(&world, Box::new(Gimp), elastic);
            rigid_motion::<Classical, 3>(&world, Box::new(BSpline::new(3)), elastic);
        }),
    ]);
}
