//! From the text of a user to a valid [`Scene`], with everything that is wrong found in one pass.
//!
//! In reading order: `tree` (YAML that knows its lines), `decode` (serde over it, going on after a problem), `file` (what
//! may be typed), `check` (what makes sense), `input` (where the text comes from), `arguments` (the command line),
//! `schema` (what editors and the manual are told of `file`); `table` reads files of numbers; `document` reads other files in the same way, and `kind` tells
//! them from scenes.

pub mod arguments;
mod change;
mod check;
mod decode;
mod document;
pub mod file;
mod input;
mod kind;
mod nearest;
mod overrides;
mod path;
pub mod point;
mod schema;
mod source;
pub mod table;
pub mod tree;
mod write;

pub use change::{Change, changes, changes_of_scene, read_back};
pub use decode::FlowText;
pub use document::Document;
pub use input::Input;
pub use nearest::{did_you_mean, nearest};
pub use path::Path as KeyPath;
pub use schema::schema;
pub use source::Source;

use crate::problem::Problem;
use crate::scene::Scene;

/// The scene that a configuration describes, with the places where its entries stand in the file. `overrides` are
/// `KEY.KEY=VALUE`. It reads no files: see [`Input::from_disk`] for bodies whose points come from one.
///
/// # Errors
/// Everything that is wrong, with its place, in the order of the file.
pub fn read(file_name: &str, text: &str, overrides: &[String]) -> Result<(Scene, Source), Vec<Problem>> {
    Input::from_text(file_name, text, overrides).scene()
}
