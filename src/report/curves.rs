//! Charts of the tables of a run: history, convergence, step sizes, time and memory.

use serde_json::Value as Json;

use super::bars::bars;
use super::chart::{Axis, Line, LineChart, Marker, Series};
use super::error::ReportError;
use super::results::{Iteration, Results, below, setting};
use crate::config::tree::{Node, Value};

/// Columns that every history starts with.
const FIXED: [&str; 4] = ["step", "load_factor", "step_size", "newton_iterations"];
/// What follows the name of an entry in its columns.
const COMPONENTS: [&str; 12] = ["x", "y", "z", "xx", "xy", "xz", "yx", "yy", "yz", "zx", "zy", "zz"];
/// Largest number of ranks that get a bar each.
const MOST_RANKS: usize = 32;

/// A figure: its name in files, its heading, and the document.
#[derive(Clone, Debug)]
pub struct Figure {
    pub name: String,
    pub title: String,
    pub svg: String,
}

/// What a curve can be drawn over.
#[derive(Clone, Debug)]
pub struct Abscissa {
    /// Name of the choice.
    pub name: String,
    axis: Axis,
    values: Vec<f64>,
}

/// Columns that belong together: those of one entry of `output.history`.
#[derive(Clone, Debug, PartialEq)]
pub struct Group {
    pub name: String,
    pub columns: Vec<String>,
    pub unit: &'static str,
    /// Whether this is a prescribed motion, which others are drawn over.
    motion: bool,
}

/// Columns of the history by the entries of the configuration that they come from.
pub fn groups(results: &Results) -> Vec<Group> {
    let entries = match results
        .configuration
        .as_ref()
        .and_then(|node| below(below(node, "output")?, "history"))
    {
        Some(Node {
            value: Value::List(entries),
            ..
        }) => entries.as_slice(),
        _ => &[],
    };
    let mut free: Vec<&String> = results
        .history
        .names
        .iter()
        .filter(|name| !FIXED.contains(&name.as_str()))
        .collect();
    let mut groups = Vec::new();
    for entry in entries {
        let Some(name) = setting(entry, &["name"]) else {
            continue;
        };
        let belongs = |column: &str| {
            let rest = column.strip_prefix(name);
            rest.is_some_and(|rest| rest.is_empty() || rest.strip_prefix('_').is_some_and(|c| COMPONENTS.contains(&c)))
        };
        let (own, others): (Vec<_>, Vec<_>) = free.into_iter().partition(|column| belongs(column));
        free = others;
        if !own.is_empty() {
            groups.push(Group {
                name: name.to_owned(),
                columns: own.into_iter().cloned().collect(),
                unit: unit(entry, results.plane()),
                motion: below(entry, "boundary_motion").is_some(),
            });
        }
    }
    groups.extend(free.into_iter().map(|column| Group {
        name: column.clone(),
        columns: vec![column.clone()],
        unit: "",
        motion: false,
    }));
    groups
}

/// Unit of an entry of `output.history`; in plane strain forces are per metre of depth.
fn unit(entry: &Node, plane: bool) -> &'static str {
    let component = |key: &str| setting(entry, &[key, "component"]);
    if let Some(component) = component("reaction") {
        return match (component.starts_with('r'), plane) {
            (false, false) => "N",
            (false, true) => "N/m",
            (true, false) => "N m",
            (true, true) => "N",
        };
    }
    if let Some(component) = component("boundary_motion") {
        return if component.starts_with('r') { "rad" } else { "m" };
    }
    let field = ["max", "min", "mean"].iter().find_map(|key| setting(entry, &[key]));
    match field.unwrap_or_default() {
        "displacement" | "position" => "m",
        "rotation" | "twist_x" | "twist_y" | "twist_z" => "rad",
        "pressure" | "von_mises" | "stress" => "Pa",
        "couple_stress" => "N/m",
        "wryness" => "1/m",
        "volume" => "m³",
        _ => "",
    }
}

/// What curves can be drawn over, the best first: a prescribed motion that goes on, the time, the step.
pub fn abscissae(results: &Results, groups: &[Group]) -> Vec<Abscissa> {
    let history = &results.history;
    let column = |name: &str| history.column(name).unwrap_or_default().to_vec();
    let moves = |values: &[f64]| values.iter().any(|value| *value != 0.0);
    let motion = groups.iter().filter(|group| group.motion).map(|group| Abscissa {
        name: group.name.clone(),
        axis: Axis::new(&readable(&group.name), group.unit),
        values: column(&group.columns[0]),
    });
    let time = Abscissa {
        name: "time".into(),
        axis: Axis::new("time (stages done and load factor)", ""),
        values: history.time(),
    };
    let step = Abscissa {
        name: "step".into(),
        axis: Axis::new("step", "").whole(),
        values: column("step"),
    };
    motion
        .filter(|motion| moves(&motion.values))
        .take(2)
        .chain([time, step])
        .collect()
}

/// For each group its charts over the abscissae; none of a history without rows.
///
/// # Errors
/// What the drawing library refuses.
pub fn histories(results: &Results, groups: &[Group], all: &[Abscissa]) -> Result<Vec<Vec<Figure>>, ReportError> {
    if results.history.len() == 0 {
        return Ok(Vec::new());
    }
    let other = |group: &Group| all.iter().find(|over| over.name != group.name);
    let over = |group: &Group, over: &Abscissa| {
        // A quantity over itself is a straight line that says nothing.
        let over = if over.name == group.name {
            other(group).cloned()
        } else {
            Some(over.clone())
        };
        history(results, group, &over.unwrap_or_else(|| all[0].clone()))
    };
    groups
        .iter()
        .map(|group| all.iter().map(|abscissa| over(group, abscissa)).collect())
        .collect()
}

/// The chart of a group over one of the abscissae.
///
/// # Errors
/// What the drawing library refuses.
fn history(results: &Results, group: &Group, over: &Abscissa) -> Result<Figure, ReportError> {
    let series = group.columns.iter().map(|name| {
        let values = results.history.column(name).unwrap_or_default();
        let points: Vec<(f64, f64)> = over.values.iter().copied().zip(values.iter().copied()).collect();
        let marker = if points.len() <= 40 {
            Marker::Circle
        } else {
            Marker::None
        };
        let shown = if group.columns.len() > 1 {
            readable(name)
        } else {
            String::new()
        };
        Series::new(&shown, points).marked(marker)
    });
    let title = readable(&group.name);
    let chart = LineChart::new(
        &title,
        over.axis.clone(),
        Axis::new(&title, group.unit),
        series.collect(),
    );
    Ok(Figure {
        name: file_name(&group.name),
        title,
        svg: chart.svg()?,
    })
}

/// Residuals of the last steps and of the one that took most iterations.
///
/// # Errors
/// What the drawing library refuses.
pub fn convergence(results: &Results) -> Result<Option<Figure>, ReportError> {
    let attempts: Vec<&[Iteration]> = results
        .convergence
        .chunk_by(|a, b| (a.step, a.attempt) == (b.step, b.attempt))
        .collect();
    let Some(longest) = attempts.iter().rev().max_by_key(|attempt| attempt.len()) else {
        return Ok(None);
    };
    let mut shown: Vec<&[Iteration]> = attempts.iter().rev().take(5).rev().copied().collect();
    if !shown.iter().any(|attempt| std::ptr::eq(*attempt, *longest)) {
        shown.insert(0, longest);
    }
    let named = |attempt: &[Iteration]| {
        let first = attempt[0];
        let most = if std::ptr::eq(attempt, *longest) {
            ", most iterations"
        } else {
            ""
        };
        let failed = if first.accepted { "" } else { ", not solved" };
        let again = if first.attempt > 1 {
            format!(", attempt {}", first.attempt)
        } else {
            String::new()
        };
        format!("step {}{again}{failed}{most}", first.step)
    };
    let mut series: Vec<Series> = shown
        .iter()
        .map(|attempt| {
            let points = attempt
                .iter()
                .map(|row| (row.iteration as f64, row.force_residual))
                .collect();
            let line = if attempt[0].accepted { Line::Solid } else { Line::Dashed };
            Series::new(&named(attempt), points).marked(Marker::Circle).joined(line)
        })
        .collect();
    let most = shown.iter().map(|attempt| attempt.len()).max().unwrap_or(1).max(2) as f64 - 1.0;
    if let Some(tolerance) = results
        .setting(&["solver", "force_tolerance"])
        .and_then(|text| text.parse::<f64>().ok())
    {
        series.push(
            Series::new("tolerance", vec![(0.0, tolerance), (most, tolerance)])
                .joined(Line::Dashed)
                .coloured(6),
        );
    }
    let x = Axis::new("Newton iteration", "").whole();
    let chart = LineChart::new(
        "Newton convergence",
        x,
        Axis::new("relative residual", "").log(),
        series,
    );
    Ok(Some(Figure {
        name: "convergence".into(),
        title: "Newton convergence".into(),
        svg: chart.svg()?,
    }))
}

/// Step sizes and iterations, over steps.
///
/// # Errors
/// What the drawing library refuses.
pub fn steps(results: &Results) -> Result<Vec<Figure>, ReportError> {
    let history = &results.history;
    let step = history.column("step").unwrap_or_default();
    let over_steps = |title: &str, name: &str, column: &str, y: Axis| -> Result<Figure, ReportError> {
        let values = history.column(column).unwrap_or_default();
        // The initial state is no step.
        let points: Vec<(f64, f64)> = step.iter().copied().zip(values.iter().copied()).skip(1).collect();
        let (marker, line) = if points.len() <= 60 {
            (Marker::Circle, Line::Solid)
        } else {
            (Marker::None, Line::Solid)
        };
        let series = Series::new("", points).marked(marker).joined(line);
        let mut chart = LineChart::new(title, Axis::new("step", "").whole(), y, vec![series]);
        chart.size.1 = 320;
        Ok(Figure {
            name: name.into(),
            title: title.into(),
            svg: chart.svg()?,
        })
    };
    if history.len() < 2 {
        return Ok(Vec::new());
    }
    Ok(vec![
        over_steps("Step sizes", "step_size", "step_size", Axis::new("step size", "").log())?,
        over_steps(
            "Newton iterations",
            "newton_iterations",
            "newton_iterations",
            Axis::new("iterations", "").whole(),
        )?,
    ])
}

/// Where wall time went, and the memory of each rank.
///
/// # Errors
/// What the drawing library refuses.
pub fn costs(summary: &Json) -> Result<Vec<Figure>, ReportError> {
    let mut figures = Vec::new();
    if let Some(phases) = summary["phases"].as_object() {
        let total: f64 = phases.values().filter_map(Json::as_f64).sum();
        let mut rows: Vec<(String, f64, String)> = phases
            .iter()
            .filter_map(|(name, seconds)| Some((name, seconds.as_f64()?)))
            .map(|(name, seconds)| {
                let share = 100.0 * seconds / total.max(f64::MIN_POSITIVE);
                (name.clone(), seconds, format!("{seconds:.2} s, {share:.1} %"))
            })
            .collect();
        rows.sort_by(|a, b| b.1.total_cmp(&a.1));
        figures.push(("time", "Wall time by phase", rows));
    }
    if let Some(memory) = summary["peak_memory_mb"].as_array() {
        let known = memory
            .iter()
            .enumerate()
            .filter_map(|(rank, value)| Some((rank, value.as_f64()?)));
        let mut rows: Vec<(usize, f64)> = known.collect();
        let title = if rows.len() > MOST_RANKS {
            "Peak memory of the 32 largest ranks"
        } else {
            "Peak memory by rank"
        };
        rows.sort_by(|a, b| b.1.total_cmp(&a.1));
        rows.truncate(MOST_RANKS);
        rows.sort_by_key(|row| row.0);
        let rows = rows
            .into_iter()
            .map(|(rank, mb)| (format!("rank {rank}"), mb, format!("{mb:.1} MiB")));
        figures.push(("memory", title, rows.collect()));
    }
    let drawn = figures
        .into_iter()
        .filter(|(_, _, rows)| !rows.is_empty())
        .map(|(name, title, rows)| {
            Ok(Figure {
                name: name.into(),
                title: title.into(),
                svg: bars(title, &rows)?,
            })
        });
    drawn.collect()
}

/// A name of the configuration as words.
pub fn readable(name: &str) -> String {
    name.replace('_', " ")
}

/// A name as part of the name of a file.
fn file_name(name: &str) -> String {
    let safe = |c: char| {
        if c.is_alphanumeric() || "-_.".contains(c) {
            c
        } else {
            '_'
        }
    };
    format!("history_{}", name.chars().map(safe).collect::<String>())
}
