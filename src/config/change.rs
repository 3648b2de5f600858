//! What differs between two resolved configurations: of one run that goes on, and of two runs in one folder.

use super::tree::{self, Node};
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
    compare("", before, now, &|path| free(path, stage), &mut found);
    found
}

/// What makes another scene of a configuration, both as [`read_back`] gives them: everything that the digits of the
/// results depend on, tolerances and the columns of the history included. Free are the title, what is written, where and
/// how often, and how linear systems are solved.
pub fn changes_of_scene(before: &Value, now: &Value) -> Vec<Change> {
    let mut found = Vec::new();
    compare(
        "",
        before,
        now,
        &|path| only_shown(path) || only_solves(path),
        &mut found,
    );
    found
}

/// A configuration that a run wrote into its folder; `None` if the text is none.
pub fn read_back(text: &str) -> Option<Value> {
    let (root, _) = tree::parse("", text).ok()?;
    Some(value(&root))
}

/// What a node holds, without places.
fn value(node: &Node) -> Value {
    match &node.value {
        // Numbers and words as the program writes them.
        tree::Value::Plain(text) => serde_json::from_str(text).unwrap_or_else(|_| Value::from(text.as_str())),
        tree::Value::Quoted(text) => Value::from(text.as_str()),
        tree::Value::List(nodes) => nodes.iter().map(value).collect(),
        tree::Value::Mapping(entries) => {
            let entries = entries.iter().map(|entry| (entry.key.clone(), value(&entry.node)));
            Value::Object(entries.collect())
        }
        tree::Value::Hole => Value::Null,
    }
}

fn compare(path: &str, before: &Value, now: &Value, free: &dyn Fn(&str) -> bool, found: &mut Vec<Change>) {
    if before == now || free(path) {
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
                compare(&below, &before[key], &now[key], free, found);
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
                    free,
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
    let solver = path == "solver" || path.starts_with("solver.");
    later || solver || only_shown(path) || path.ends_with(".points.file")
}

/// Whether a key says how a run is shown, and not what it computes.
fn only_shown(path: &str) -> bool {
    path == "title" || path.starts_with("output.") && !path.starts_with("output.history")
}

/// Whether a key says by which way a solution is found, and not which solution or how exactly.
fn only_solves(path: &str) -> bool {
    let keys = ["method", "repeatable", "partitioner", "petsc_options", "max_iterations"];
    path.strip_prefix("solver.").is_some_and(|key| keys.contains(&key))
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
    #[test]
    fn other_tolerances_make_another_scene_and_another_title_or_way_does_not() {
        let text = "title: a\ngrid: {cell_size: 1.0e-3}\nsolver:\n  force_tolerance: 1.0e-9\noutput:\n  \
                    directory: \"x\"\n  history:\n    - {name: force}\n";
        let changed = |now: &str| -> Vec<Change> {
            let [before, now] = [text, now].map(|text| read_back(text).expect("a configuration"));
            changes_of_scene(&before, &now)
        };
        let paths = |now: &str| -> Vec<String> { changed(now).into_iter().map(|change| change.path).collect() };
        let shown = text
            .replace("title: a", "title: b")
            .replace(
                "solver:\n",
                "solver:\n  petsc_options: \"-log_view\"\n  method: direct\n",
            )
            .replace("\"x\"", "y\n  report: false");
        assert!(paths(text).is_empty() && paths(&shown).is_empty());
        let other = text
            .replace("1.0e-9", "1.0e-6")
            .replace("{name: force}", "{name: thrust}");
        assert_eq!(paths(&other), ["solver.force_tolerance", "output.history[0].name"]);
        let first = &changed(&other)[0];
        assert_eq!((first.before.as_str(), first.now.as_str()), ("1e-9", "1e-6"));
        assert_eq!((read_back("a text\n"), read_back("")), (None, None));
    }
}
