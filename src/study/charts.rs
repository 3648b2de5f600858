//! Charts of a study: only those that its runs have something to show in.

use super::file::ScalingName;
use super::lines::{self, Group};
use super::plan::Study;
use super::rates::Rate;
use super::table::Row;
use crate::error::Error;
use crate::report::chart::{Axis, Line, LineChart, Marker, Series};

/// A chart, with the name of its files.
#[derive(Clone, Debug)]
pub struct Figure {
    pub stem: String,
    pub chart: LineChart,
    /// What it shows, in a sentence.
    pub caption: String,
}

const MARKERS: [Marker; 3] = [Marker::Circle, Marker::Square, Marker::Triangle];

/// The charts that make sense, each written as `STEM.svg` and `STEM.png` into the folder of the study.
///
/// # Errors
/// A file cannot be written.
pub fn draw(study: &Study, rows: &[Row<'_>], rates: &[Rate]) -> Result<Vec<Figure>, Error> {
    let mut figures = work_precision(study, rows);
    figures.extend(errors_against_cells(study, rates));
    figures.extend(scaling(study, rows));
    for figure in &figures {
        figure
            .chart
            .write(&study.folder, &figure.stem)
            .map_err(|error| Error::System(error.to_string()))?;
    }
    Ok(figures)
}

fn series(number: usize, name: &str, points: Vec<(f64, f64)>) -> Series {
    Series::new(name, points)
        .marked(MARKERS[number % MARKERS.len()])
        .coloured(number)
}

/// Error against processor time, a chart per error: further down is more accurate, further left is cheaper.
fn work_precision(study: &Study, rows: &[Row<'_>]) -> Vec<Figure> {
    let groups = lines::by_parameter(study, rows);
    let figure = |(index, measure): (usize, &super::measure::Measure)| {
        let point = |row: &&Row<'_>| {
            let error = row.readings[index].error.filter(|error| *error > 0.0)?;
            Some((row.outcome.number("cpu_seconds")?, error))
        };
        let line = |(number, group): (usize, &Group<'_>)| {
            series(number, &group.name, group.rows.iter().filter_map(point).collect())
        };
        let all: Vec<Series> = groups.iter().enumerate().map(line).collect();
        if all.iter().map(|series| series.points.len()).sum::<usize>() < 2 {
            return None;
        }
        let along = study
            .along
            .map(|along| format!(" Lines join runs that differ in {} alone.", study.parameters[along]));
        Some(Figure {
            stem: format!("error_against_cpu_{}", file_name(&measure.name)),
            chart: LineChart::new(
                &format!("{}: error against processor time", study.title),
                Axis::new("processor time, all ranks", "s").log(),
                Axis::new(&error_name(&measure.name), "").log(),
                all,
            ),
            caption: format!(
                "Error of {} against processor time: further down is more accurate, further left is cheaper.{}",
                measure.name,
                along.unwrap_or_default()
            ),
        })
    };
    study.measures.iter().enumerate().filter_map(figure).collect()
}

/// Errors against the size of the cells: all in one chart where the runs make one line, otherwise a chart per error.
fn errors_against_cells(study: &Study, rates: &[Rate]) -> Vec<Figure> {
    let one_line = rates.iter().all(|rate| rate.group == rates[0].group);
    let line = |(number, rate): (usize, &&Rate)| {
        let what = if one_line { &rate.measure } else { &rate.group };
        series(number, &format!("{what}: {:.2}", rate.fitted), rate.points.clone())
    };
    let figure = |stem: String, what: &str, rates: &[&Rate]| Figure {
        stem,
        chart: LineChart::new(
            &format!("{}: error against cell size", study.title),
            Axis::new("cell size", "m").log(),
            Axis::new(what, "").log(),
            rates.iter().enumerate().map(line).collect(),
        ),
        caption: format!("{what} against cell size; the legend gives the exponent of the power law that fits best."),
    };
    if rates.is_empty() {
        return Vec::new();
    }
    if one_line {
        return vec![figure(
            "error_against_cell_size".to_owned(),
            "error",
            &rates.iter().collect::<Vec<_>>(),
        )];
    }
    let of_measure = |measure: &super::measure::Measure| {
        let own: Vec<&Rate> = rates.iter().filter(|rate| rate.measure == measure.name).collect();
        let stem = format!("error_against_cell_size_{}", file_name(&measure.name));
        (!own.is_empty()).then(|| figure(stem, &error_name(&measure.name), &own))
    };
    study.measures.iter().filter_map(of_measure).collect()
}

/// Lines of wall time, each with what would be ideal, and lines of efficiency, against ranks.
fn scaling_lines(study: &Study, rows: &[Row<'_>], weak: bool) -> (Vec<Series>, Vec<Series>) {
    let (mut times, mut efficiencies) = (Vec::new(), Vec::new());
    for (number, group) in lines::by_ranks(study, rows).iter().enumerate() {
        let point = |row: &&Row<'_>| Some((row.run.ranks as f64, row.outcome.number("wall_seconds")?));
        let points: Vec<(f64, f64)> = group.rows.iter().filter_map(point).collect();
        if points.len() < 2 || points.windows(2).any(|pair| pair[0].0 == pair[1].0) {
            continue;
        }
        let ideal = |&(ranks, _): &(f64, f64)| (ranks, ideal_time(points[0], ranks, weak));
        let efficiency = |&(ranks, time): &(f64, f64)| (ranks, ideal_time(points[0], ranks, weak) / time);
        let measured = if group.name.is_empty() { "measured" } else { &group.name };
        let dashed = if times.is_empty() { "ideal" } else { "" };
        let best = Series::new(dashed, points.iter().map(ideal).collect());
        times.push(series(number, measured, points.clone()));
        times.push(best.joined(Line::Dashed).coloured(number));
        efficiencies.push(series(number, &group.name, points.iter().map(efficiency).collect()));
    }
    (times, efficiencies)
}

/// Wall time and efficiency against ranks.
fn scaling(study: &Study, rows: &[Row<'_>]) -> Vec<Figure> {
    let weak = study.scaling == ScalingName::Weak;
    let (times, efficiencies) = scaling_lines(study, rows, weak);
    if times.is_empty() {
        return Vec::new();
    }
    let (kind, work) = if weak {
        ("weak", "work that grows with the ranks")
    } else {
        ("strong", "the same work")
    };
    let ranks = || Axis::new("ranks", "").doubling();
    let points = efficiencies.iter().flat_map(|line| &line.points);
    let best = points.fold(1.0, |best: f64, point| best.max(point.1));
    let efficiency = Axis {
        range: Some((0.0, 1.05 * best)),
        ..Axis::new("parallel efficiency", "")
    };
    let title = |what: &str| format!("{}: {what} ({kind} scaling)", study.title);
    vec![
        Figure {
            stem: "wall_time_against_ranks".to_owned(),
            chart: LineChart::new(&title("wall time"), ranks(), Axis::new("wall time", "s").log(), times),
            caption: format!("Wall time of {work}; dashed: ideal."),
        },
        Figure {
            stem: "efficiency_against_ranks".to_owned(),
            chart: LineChart::new(&title("efficiency"), ranks(), efficiency, efficiencies),
            caption: format!("Ideal over measured wall time of {work}; 1 is ideal."),
        },
    ]
}

/// Wall time on so many ranks if nothing were lost since the fewest.
fn ideal_time(fewest: (f64, f64), ranks: f64, weak: bool) -> f64 {
    if weak { fewest.1 } else { fewest.1 * fewest.0 / ranks }
}

fn error_name(measure: &str) -> String {
    if measure.contains("error") {
        measure.to_owned()
    } else {
        format!("error of {measure}")
    }
}

fn file_name(measure: &str) -> String {
    measure
        .chars()
        .map(|letter| if letter.is_ascii_alphanumeric() { letter } else { '_' })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ideal_times_fall_with_the_ranks_or_stay() {
        assert_eq!(ideal_time((2.0, 12.0), 8.0, false), 3.0);
        assert_eq!(ideal_time((2.0, 12.0), 8.0, true), 12.0);
    }
}
