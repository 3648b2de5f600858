//! What differs between two resolved configurations of one run.

use serde_json::Value;

/// An entry that is not what it was.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Change {
    /// Path such as `materials.rock.cohesion`.
    pub path: String,
    pub before: String,
    pub now: String,
}

/// What must not change while a run goes on: everything that the accepted state or the columns of the history depend on.
/// Free are title, solver, what is written and where (but for the history), stages after the one with index `stage`, and
/// where files of points lie.
pub fn changes(before: &Value, now: &Value, stage: usize) -> Vec<Change> {
    let mut found = Vec::new();
    compare("", before, now, stage, &mut found);
    found
}

fn compare(path: &str, before: &Value, now: &Value, stage: usize, found: &mut Vec<Change>) {
    if before == now || free(path, stage) {
        return;
    }
    match (before, now) {
        (Value::Object(old), Value::Object(new)) => {
            let added = new.keys().filter(|key| !old.contains_key(*key));
            for key in old.keys().chain(added) {
                let below = if path.is_empty() {
                    key.clone()
                } else {
                    format!("{path}.{key}")
                };
                compare(&below, &before[key], &now[key], stage, found);
            }
        }
        (Value::Array(old), Value::Array(new)) => {
            for index in 0..old.len().max(new.len()) {
                let (old, new) = (old.get(index), new.get(index));
                let below = format!("{path}[{index}]");
                compare(
                    &below,
                    old.unwrap_or(&Value::Null),
                    new.unwrap_or(&Value::Null),
                    stage,
                    found,
                );
            }
        }
        _ => found.push(Change {
            path: path.to_owned(),
            before: describe(before),
            now: describe(now),
        }),
    }
}

fn free(path: &str, stage: usize) -> bool {
    let later = path
        .strip_prefix("stages[")
        .and_then(|rest| rest.split_once(']'))
        .is_some_and(|(index, _)| index.parse::<usize>().is_ok_and(|index| index > stage));
    let section = path.split(['.', '[']).next().unwrap_or_default();
    let output = section == "output" && path.contains('.') && !path.starts_with("output.history");
    later || output || matches!(section, "title" | "solver") || path.ends_with(".points.file")
}

fn describe(value: &Value) -> String {
    match value {
        Value::Null => "nothing".to_owned(),
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn what_the_state_depends_on_must_stay_and_the_rest_may_change() {
        let before = json!({
            "title": "a", "grid": {"cell_size": 1.0}, "solver": {"force_tolerance": 1e-9},
            "stages": [{"name": "one", "steps": 4}, {"name": "two", "steps": 4}],
            "output": {"directory": "x", "history": [{"name": "force"}]},
        });
        let now = json!({
            "title": "b", "grid": {"cell_size": 2.0}, "solver": {"force_tolerance": 1e-6},
            "stages": [{"name": "one", "steps": 4}, {"name": "two", "steps": 8}, {"name": "three", "steps": 1}],
            "output": {"directory": "y", "history": [{"name": "force"}, {"name": "more"}]},
        });
        let paths = |stage| -> Vec<String> {
            changes(&before, &now, stage)
                .into_iter()
                .map(|change| change.path)
                .collect()
        };
        assert_eq!(paths(0), ["grid.cell_size", "output.history[1]"]);
        assert_eq!(paths(1), ["grid.cell_size", "stages[1].steps", "output.history[1]"]);
        assert_eq!(changes(&before, &before, 0), []);
        assert_eq!(changes(&before, &now, 0)[1].before, "nothing");
    }
}
