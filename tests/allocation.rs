//! The kernel allocates nothing once its workspace has grown.
//!
//! A counting allocator stands in for that of the system. After the first residual and tangent of a model the workspace
//! has its size, and the next ones must not ask for memory at all: in the plane and in space, elastic and plastic.
#![allow(unsafe_code)] // An allocator cannot be written without.

#[path = "common/block.rs"]
mod block;
#[path = "common/cases.rs"]
mod cases;

use block::{ELASTIC, PLASTIC, field, model};
use mpm_petsc::app::Laws;
use mpm_petsc::assembly::Sink;
use mpm_petsc::assembly::kernel::Workspace;
use mpm_petsc::clock::Clock;
use mpm_petsc::continuum::classical::Classical;
use mpm_petsc::continuum::micropolar::Micropolar;
use mpm_petsc::continuum::{Fields, Linearisation};
use mpm_petsc::grid::basis::Gimp;
use mpm_petsc::material::spec::MaterialSpec;
use mpm_petsc::parallel::World;
use std::alloc::{GlobalAlloc, Layout, System};
use std::rc::Rc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Requests for memory so far.
static REQUESTS: AtomicUsize = AtomicUsize::new(0);

struct Counting;

// SAFETY: every request goes on to the allocator of the system unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        REQUESTS.fetch_add(1, Ordering::Relaxed);
        // SAFETY: the caller keeps the contract of `GlobalAlloc`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        REQUESTS.fetch_add(1, Ordering::Relaxed);
        // SAFETY: as above.
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Takes blocks and keeps nothing but a sum.
struct Total(f64);

impl Sink for Total {
    fn add(&mut self, _: &[u32], tangent: &[f64]) {
        self.0 += tangent.iter().sum::<f64>();
    }
}

/// Evaluates residual and tangent at increments of this size, the first time to grow the workspace.
fn kernel_allocates_nothing<C: Fields<D, N> + Laws, const D: usize, const N: usize>(
    world: &World,
    spec: MaterialSpec,
    size: f64,
) {
    let mut model = model::<C, D, N>(world, Box::new(Gimp), spec);
    let system = model.search(world, 0).expect("all points lie on the grid");
    let mut workspace = Workspace::<C, D, N>::new(Rc::new(Clock::start()));
    let states = [3, 11, 12].map(|seed| field(&model, &system.active.nodes, size, seed));
    let mut forces = vec![0.0; states[0].len()];
    let mut total = Total(0.0);
    let mut requests = Vec::with_capacity(states.len());
    for u in &states {
        let before = REQUESTS.load(Ordering::Relaxed);
        workspace
            .add_internal_forces(
                &model.laws,
                &system.batches,
                &system.active,
                &mut model.points,
                u,
                &mut forces,
            )
            .expect("a response");
        workspace
            .add_tangent(
                &model.laws,
                &system.batches,
                &system.active,
                &model.points,
                u,
                Linearisation::Consistent,
                &mut total,
            )
            .expect("moduli");
        requests.push(REQUESTS.load(Ordering::Relaxed) - before);
    }
    println!("  requests for memory in each evaluation {requests:?}");
    assert!(total.0 != 0.0 && forces.iter().any(|&force| force != 0.0));
    assert!(requests[0] > 0, "the allocator does not count");
    assert_eq!(requests[1..], [0, 0]);
    let yields = model.points.trial_state.iter().any(|&variable| variable != 0.0);
    assert!(matches!(spec, MaterialSpec::Elastic(_)) || yields);
}

fn main() {
    let world = World::start().expect("MPI starts once");
    let elastic = MaterialSpec::Elastic(ELASTIC);
    let plastic = MaterialSpec::Elastoplastic(ELASTIC, PLASTIC);
    cases::run(&[
        ("plane_elastic", &|| {
            kernel_allocates_nothing::<Micropolar, 2, 3>(&world, elastic, 0.3)
        }),
        ("plane_plastic", &|| {
            kernel_allocates_nothing::<Micropolar, 2, 3>(&world, plastic, 0.05)
        }),
        ("space_elastic", &|| {
            kernel_allocates_nothing::<Micropolar, 3, 6>(&world, elastic, 0.2)
        }),
        ("space_plastic", &|| {
            kernel_allocates_nothing::<Micropolar, 3, 6>(&world, plastic, 0.05)
        }),
        ("classical_plane_plastic", &|| {
            kernel_allocates_nothing::<Classical, 2, 2>(&world, plastic, 0.05)
        }),
        ("classical_space_plastic", &|| {
            kernel_allocates_nothing::<Classical, 3, 3>(&world, plastic, 0.05)
        }),
    ]);
}
