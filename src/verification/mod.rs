//! Problems whose solution is known, made by the method of manufactured solutions: a displacement and a rotation are
//! chosen, the forces that they need follow from the strong form, and the run is measured against what was chosen.

mod errors;
mod manufactured;
mod varying;

pub use errors::{Errors, errors};
pub use manufactured::{BodyLoad, Exact, Manufactured, Solution};
