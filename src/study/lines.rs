//! Which runs of a study belong on one line of a chart.

use super::plan::Study;
use super::table::Row;

/// Runs that are joined by a line, in the order of the study.
#[derive(Clone, Debug)]
pub struct Group<'a> {
    /// What they have in common, where others differ from it; empty if there is nothing to tell.
    pub name: String,
    pub rows: Vec<&'a Row<'a>>,
}

/// Runs that differ in the parameter along lines and nothing else.
pub fn by_parameter<'a>(study: &Study, rows: &'a [Row<'a>]) -> Vec<Group<'a>> {
    let many_ranks = rows
        .iter()
        .any(|row| !row.run.is_reference() && row.run.ranks != rows[rows.len() - 1].run.ranks);
    let in_variants = study.scaling == super::file::ScalingName::Weak;
    grouped(study, rows, study.along, many_ranks && !in_variants)
}

/// Runs that differ in the number of ranks; where the work grows with them, also in the parameter along lines.
pub fn by_ranks<'a>(study: &Study, rows: &'a [Row<'a>]) -> Vec<Group<'a>> {
    let along = study.along.filter(|_| study.scaling == super::file::ScalingName::Weak);
    let mut groups = grouped(study, rows, along, false);
    for group in &mut groups {
        group.rows.sort_by_key(|row| row.run.ranks);
    }
    groups
}

/// Groups of the completed runs, apart from the reference, that agree in everything but one parameter.
fn grouped<'a>(study: &Study, rows: &'a [Row<'a>], without: Option<usize>, ranks: bool) -> Vec<Group<'a>> {
    let completed = rows
        .iter()
        .filter(|row| row.outcome.completed() && !row.run.is_reference());
    let mut groups: Vec<Group<'a>> = Vec::new();
    for row in completed {
        let parts = (0..study.parameters.len()).filter_map(|index| {
            if Some(index) == without {
                return row.run.lines[index].clone();
            }
            let label = &row.run.labels[index];
            // A bare number needs to say what it is.
            let bare = label.chars().all(|letter| !letter.is_alphabetic());
            let short = study.parameters[index].rsplit('.').next().unwrap_or_default();
            Some(if bare {
                format!("{short} {label}")
            } else {
                label.clone()
            })
        });
        let mut parts: Vec<String> = parts.collect();
        if ranks {
            parts.push(format!("{} ranks", row.run.ranks));
        }
        let name = parts.join(", ");
        match groups.iter_mut().find(|group| group.name == name) {
            Some(group) => group.rows.push(row),
            None => groups.push(Group { name, rows: vec![row] }),
        }
    }
    groups
}
