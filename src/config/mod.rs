//! From the text of a user to a valid [`Scene`](crate::scene::Scene), with everything that is wrong in one pass.

pub mod decode;
pub mod file;
mod nearest;
mod overrides;
pub mod path;
pub mod source;
pub mod tree;
