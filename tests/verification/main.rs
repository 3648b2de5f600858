//! The program against closed forms, balance laws and independent computations. Each file opens with the source of the
//! problem, a sketch, and what is expected.

#[path = "../common/mod.rs"]
mod common;

mod ample;
mod balance;
mod biaxial;
mod classical_shear_layer;
mod column;
mod compression;
mod couple_layer;
mod curved_cantilever;
mod everyday;
mod finite_elements;
mod gosford;
mod homogeneous_sandstone;
mod manufactured;
mod path;
mod plane_and_space;
mod plane_cantilever;
mod prescribed_motion;
mod published_splines;
mod reference;
mod round_off;
mod shear;
mod shear_layer;
mod splines;
mod torsion;
mod weak;
