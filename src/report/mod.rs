//! Figures of results: charts, and the page that shows a run.
//!
//! Nothing here knows a solver or a scene: all that is shown is read from the files of a result folder.

mod axis;
mod bars;
mod bodies;
mod canvas;
pub mod chart;
mod curves;
pub mod error;
mod facts;
mod field;
mod page;
mod results;
mod snapshots;

use std::fs;
use std::panic::{self, AssertUnwindSafe};
use std::path::{Path, PathBuf};

use bodies::Bodies;
use curves::Figure;
use error::ReportError;
use page::Page;
use results::Results;

/// Draws the report of a result folder: `report.html`, and its figures as SVG and PNG under `figures`. Answers with the
/// path of the page. Only the root of a run may call it.
///
/// # Errors
/// A folder without results, files that are damaged, and what cannot be written.
pub fn write(directory: &Path) -> Result<PathBuf, ReportError> {
    without_panic(|| draw(directory))
}

/// A drawing library that gives up on odd numbers is a failed report, and no end of the program.
fn without_panic<T>(work: impl FnOnce() -> Result<T, ReportError>) -> Result<T, ReportError> {
    let usual = panic::take_hook();
    panic::set_hook(Box::new(|_| {}));
    let outcome = panic::catch_unwind(AssertUnwindSafe(work));
    panic::set_hook(usual);
    outcome.unwrap_or_else(|cause| {
        let text = cause.downcast_ref::<String>().map(String::as_str);
        let text = text
            .or(cause.downcast_ref::<&str>().copied())
            .unwrap_or("no reason is given");
        Err(ReportError::Drawing(text.to_owned()))
    })
}

fn draw(directory: &Path) -> Result<PathBuf, ReportError> {
    let results = Results::read(directory)?;
    let groups = curves::groups(&results);
    let abscissae = curves::abscissae(&results, &groups);
    let histories = curves::histories(&results, &groups, &abscissae)?;
    let bodies = match &results.snapshots {
        Some(snapshots) => bodies::draw(snapshots, results.plane())?,
        None => Bodies::default(),
    };
    let mut numerics: Vec<Figure> = curves::convergence(&results)?.into_iter().collect();
    numerics.extend(curves::steps(&results)?);
    let costs = results.summary.as_ref().map_or(Ok(Vec::new()), curves::costs)?;
    let page = Page {
        results: &results,
        abscissae: &abscissae,
        histories: &histories,
        bodies: &bodies,
        numerics: &numerics,
        costs: &costs,
        warnings: &warnings(&results),
    };
    let figures = directory.join("figures");
    fs::create_dir_all(&figures).map_err(|error| file(&figures, &error))?;
    let bodies = bodies.bodies.iter().map(|body| &body.figure);
    let histories = histories.iter().filter_map(|charts| charts.first());
    for figure in histories.chain(bodies).chain(&numerics).chain(&costs) {
        canvas::write(&figures, &figure.name, &figure.svg)?;
    }
    let path = directory.join("report.html");
    fs::write(&path, page.html()).map_err(|error| file(&path, &error))?;
    Ok(path)
}

fn file(path: &Path, error: &std::io::Error) -> ReportError {
    ReportError::File(format!("{}: cannot be written: {error}", path.display()))
}

/// What the reader should know before trusting the curves.
fn warnings(results: &Results) -> Vec<String> {
    let mut warnings = Vec::new();
    if let Some(summary) = &results.summary {
        let text = |name: &str| summary[name].as_str();
        if let Some(message) = text("message") {
            warnings.push(format!("The run ended early: {message}"));
        }
        let count = |name: &str| summary[name].as_u64().unwrap_or(0);
        let halved = count("attempts").saturating_sub(count("steps"));
        if halved > 0 {
            warnings.push(format!(
                "{halved} of {} attempts at a step were not solved.",
                count("attempts")
            ));
        }
        let noted = summary["warnings"].as_array().into_iter().flatten();
        warnings.extend(noted.filter_map(|warning| Some(warning.as_str()?.to_owned())));
    }
    if results.history.columns.iter().flatten().any(|value| !value.is_finite()) {
        warnings.push("The history holds values that are not finite; curves have gaps there.".into());
    }
    if results.history.len() == 0 {
        warnings.push("The history has no rows: not even the initial state was recorded.".into());
    }
    warnings.extend(results.missing.iter().map(|name| match *name {
        "summary.json" => "summary.json is missing: the run was killed, or goes on.".to_owned(),
        name => format!("{name} is missing."),
    }));
    warnings
}
