//! What the tests of the whole program share: launching it, reading its results, comparing numbers.
//!
//! A test program needs only some of it.
#![allow(dead_code)]

pub mod compare;
pub mod folder;
pub mod launch;
pub mod results;
pub mod scene;
pub mod snapshots;
