//! What the resolved configuration says of a scene, in a few words.

use super::results::{Results, below, setting};
use crate::config::tree::{Node, Value};

impl Results {
    fn section(&self, path: &[&str]) -> Option<&Node> {
        path.iter()
            .try_fold(self.configuration.as_ref()?, |node, key| below(node, key))
    }

    /// A number or a list of numbers as text.
    pub fn list(&self, path: &[&str]) -> Option<String> {
        listed(self.section(path)?)
    }

    /// Corners of the background grid.
    pub fn extent(&self) -> Option<String> {
        Some(format!(
            "{} to {}",
            self.list(&["grid", "min"])?,
            self.list(&["grid", "max"])?
        ))
    }

    /// Names of the materials with their laws.
    pub fn materials(&self) -> Option<String> {
        let Value::Mapping(entries) = &self.section(&["materials"])?.value else {
            return None;
        };
        let named = entries.iter().map(|entry| match setting(&entry.node, &["law"]) {
            Some(law) => format!("{} ({})", entry.key, law.replace('_', " ")),
            None => entry.key.clone(),
        });
        Some(named.collect::<Vec<_>>().join(", "))
    }

    /// Names of the stages with their steps.
    pub fn stages(&self) -> Option<String> {
        let Value::List(entries) = &self.section(&["stages"])?.value else {
            return None;
        };
        let named = entries.iter().filter_map(|entry| {
            let steps = setting(entry, &["steps"]).map_or_else(String::new, |steps| format!(" ({steps} steps)"));
            Some(format!("{}{steps}", setting(entry, &["name"])?))
        });
        Some(named.collect::<Vec<_>>().join(", "))
    }
}

fn listed(node: &Node) -> Option<String> {
    match &node.value {
        Value::List(entries) => {
            let entries: Option<Vec<String>> = entries.iter().map(listed).collect();
            Some(format!("({})", entries?.join(", ")))
        }
        _ => setting(node, &[]).filter(|text| !text.is_empty()).map(str::to_owned),
    }
}
