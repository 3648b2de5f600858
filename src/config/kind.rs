//! What kind of file YAML text is, by its keys: one of the wrong kind gets one message instead of a list of unknown keys.

use super::path::{Path, Step};
use super::tree::Node;

/// Keys that a scene has and a study has not.
const OF_A_SCENE: [&str; 4] = ["grid", "materials", "bodies", "stages"];

/// Keys that a study has and a scene has not.
const OF_A_STUDY: [&str; 2] = ["scene", "vary"];

fn first_of(root: &Node, keys: &[&str]) -> Option<Path> {
    let step = |key: &&str| Step::Key((*key).to_owned());
    let step = keys.iter().map(step).find(|step| root.child(step).is_some())?;
    Some(Path(vec![step]))
}

/// A key that makes a file a study and no scene.
pub fn mark_of_a_study(root: &Node) -> Option<Path> {
    first_of(root, &OF_A_STUDY).filter(|_| first_of(root, &OF_A_SCENE).is_none())
}

/// A key that makes a file a scene and no study.
pub fn mark_of_a_scene(root: &Node) -> Option<Path> {
    first_of(root, &OF_A_SCENE).filter(|_| first_of(root, &OF_A_STUDY).is_none())
}
