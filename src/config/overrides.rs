//! `--set a.b.c=VALUE`: one key of a configuration, from the command line.

use super::decode::Findings;
use super::path::{Path, Step};
use super::tree::{Node, Place, Value, parse_value};
use crate::problem::Problem;

/// Sets the values in the tree; what cannot be set is reported. Keys that nobody knows are found when the tree is read.
pub fn apply(root: &mut Node, overrides: &[String], findings: &mut Findings) {
    for text in overrides {
        if let Err((path, message, expected)) = apply_one(root, text) {
            let (file, place) = ("--set".to_owned(), None);
            findings.problems.push(Problem {
                file,
                place,
                path,
                message,
                expected: expected.to_owned(),
            });
        }
    }
}

type Refusal = (String, String, &'static str);

fn apply_one(root: &mut Node, text: &str) -> Result<(), Refusal> {
    let form = "KEY.KEY=VALUE, with list entries by their index from 0";
    let (path_text, value_text) = text
        .split_once('=')
        .ok_or_else(|| (String::new(), format!("\"{text}\" has no \"=\""), form))?;
    let path = Path::parse(path_text.trim());
    let Some((last, before)) = path.0.split_last() else {
        return Err((String::new(), format!("\"{text}\" names no key"), form));
    };
    let refuse = |message: String, expected| (path.to_string(), message, expected);
    let (mut value, problems) = match parse_value("--set", value_text) {
        Ok(read) => read,
        Err(problems) => (empty(), problems),
    };
    if let Some(problem) = problems.first() {
        return Err(refuse(
            format!("\"{value_text}\": {}", problem.message),
            "a value written as in YAML",
        ));
    }
    from_command_line(&mut value);
    let mut node = root;
    for step in before {
        node = descend(node, step).map_err(|message| refuse(message, "a key or an index that exists"))?;
    }
    let target = descend(node, last).map_err(|message| refuse(message, "a key or an index that exists"))?;
    *target = value;
    Ok(())
}

/// The node below; a key that is not there is made.
fn descend<'a>(node: &'a mut Node, step: &Step) -> Result<&'a mut Node, String> {
    if node.is_empty() {
        *node = Node {
            place: Place::CommandLine,
            value: Value::Mapping(Vec::new()),
        };
    }
    match (&node.value, step) {
        (Value::List(nodes), Step::Index(index)) if *index >= nodes.len() => {
            return Err(format!("the list has no entry {index}: it has {}", nodes.len()));
        }
        (Value::List(_), Step::Key(key)) => return Err(format!("\"{key}\" is not an index, but a list stands there")),
        (Value::Mapping(_), _) if node.child(step).is_none() => {
            let key = match step {
                Step::Key(key) => key.clone(),
                Step::Index(index) => index.to_string(),
            };
            node.set(&key, Place::CommandLine, empty());
        }
        _ => {}
    }
    let described = node.describe();
    node.child_mut(step).ok_or_else(|| format!("{described} has no keys"))
}

fn empty() -> Node {
    Node {
        place: Place::CommandLine,
        value: Value::Plain(String::new()),
    }
}

fn from_command_line(node: &mut Node) {
    node.place = Place::CommandLine;
    match &mut node.value {
        Value::List(nodes) => nodes.iter_mut().for_each(from_command_line),
        Value::Mapping(entries) => {
            for entry in entries {
                entry.place = Place::CommandLine;
                from_command_line(&mut entry.node);
            }
        }
        Value::Plain(_) | Value::Quoted(_) | Value::Hole => {}
    }
}

#[cfg(test)]
mod tests {
    use super::super::tree::parse;
    use super::*;

    fn set(overrides: &[&str]) -> (Node, Vec<Problem>) {
        let (mut root, _) = parse("a.yaml", "bodies:\n  - {points_per_cell: 2}\nsolver:\ntitle: a\n").unwrap();
        let mut findings = Findings::default();
        let overrides: Vec<_> = overrides.iter().map(|text| (*text).to_owned()).collect();
        apply(&mut root, &overrides, &mut findings);
        (root, findings.problems)
    }

    #[test]
    fn values_are_set_by_key_and_by_index() {
        let (root, problems) = set(&[
            "bodies.0.points_per_cell=[2, 4]",
            "solver.method=direct",
            "output.x.y=\"a = b\"",
        ]);
        assert!(problems.is_empty(), "{problems:?}");
        let value = |path: &str| {
            Path::parse(path)
                .0
                .iter()
                .try_fold(&root, Node::child)
                .map(|node| node.value.clone())
        };
        assert_eq!(
            value("bodies[0].points_per_cell[1]"),
            Some(Value::Plain("4".to_owned()))
        );
        assert_eq!(value("solver.method"), Some(Value::Plain("direct".to_owned())));
        assert_eq!(value("output.x.y"), Some(Value::Quoted("a = b".to_owned())));
        assert_eq!(
            root.place_of(&Path::parse("bodies[0].points_per_cell")),
            Place::CommandLine
        );
    }

    #[test]
    fn what_cannot_be_set_is_reported() {
        let wrong = [
            "title",
            "=3",
            "bodies.7.name=a",
            "bodies.first.name=a",
            "title.x=1",
            "title=[1",
        ];
        let (_, problems) = set(&wrong);
        assert_eq!(problems.len(), wrong.len(), "{problems:?}");
        assert!(problems.iter().all(|problem| problem.file == "--set"));
    }
}
