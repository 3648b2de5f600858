//! How fast errors fall with the size of the cells.

use super::lines::by_parameter;
use super::plan::Study;
use super::table::Row;
use std::fmt::Write;

/// The rate at which one error falls along one line of runs.
#[derive(Clone, Debug, PartialEq)]
pub struct Rate {
    pub measure: String,
    /// What the runs have in common.
    pub group: String,
    /// Size of a cell [m] and error, from coarse to fine.
    pub points: Vec<(f64, f64)>,
    /// Exponent of the power law that fits all points best.
    pub fitted: f64,
    /// Exponents between neighbouring points.
    pub pairs: Vec<f64>,
}

/// Rates of every error along every line on which the cells differ.
pub fn table(study: &Study, rows: &[Row<'_>]) -> Vec<Rate> {
    let groups = by_parameter(study, rows);
    let mut rates = Vec::new();
    for (index, measure) in study.measures.iter().enumerate() {
        for group in &groups {
            let point = |row: &&Row<'_>| Some((row.run.cell_size?, row.readings[index].error?));
            let points = group.rows.iter().filter_map(point).collect();
            rates.extend(rate(&measure.name, &group.name, points));
        }
    }
    rates
}

/// The rate through points whose cells differ; `None` where there are fewer than two, or an error is zero.
fn rate(measure: &str, group: &str, mut points: Vec<(f64, f64)>) -> Option<Rate> {
    points.sort_by(|one, other| other.0.total_cmp(&one.0));
    let distinct = points.windows(2).all(|pair| pair[0].0 > pair[1].0 * (1.0 + 1e-9));
    if points.len() < 2 || !distinct || points.iter().any(|point| point.1 <= 0.0) {
        return None;
    }
    let logarithms: Vec<(f64, f64)> = points.iter().map(|(size, error)| (size.ln(), error.ln())).collect();
    let slope = |pair: &[(f64, f64)]| (pair[1].1 - pair[0].1) / (pair[1].0 - pair[0].0);
    Some(Rate {
        measure: measure.to_owned(),
        group: group.to_owned(),
        points,
        fitted: fitted_slope(&logarithms),
        pairs: logarithms.windows(2).map(slope).collect(),
    })
}

/// Slope of the straight line with the least squares of differences.
fn fitted_slope(points: &[(f64, f64)]) -> f64 {
    let count = points.len() as f64;
    let mean_x = points.iter().map(|point| point.0).sum::<f64>() / count;
    let mean_y = points.iter().map(|point| point.1).sum::<f64>() / count;
    let product: f64 = points.iter().map(|(x, y)| (x - mean_x) * (y - mean_y)).sum();
    let square: f64 = points.iter().map(|(x, _)| (x - mean_x).powi(2)).sum();
    product / square
}

/// The rates in words, a line each.
pub fn text(rates: &[Rate]) -> String {
    let mut text = String::new();
    for rate in rates {
        let group = if rate.group.is_empty() {
            String::new()
        } else {
            format!(" ({})", rate.group)
        };
        let pairs: Vec<String> = rate.pairs.iter().map(|pair| format!("{pair:.2}")).collect();
        let (measure, fitted) = (&rate.measure, rate.fitted);
        let _ = writeln!(
            text,
            "{measure}{group} falls with the cell size to the power {fitted:.2}, from coarse to fine {}",
            pairs.join(", ")
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_power_law_gives_its_exponent_back() {
        let points = [0.5, 0.125, 0.25].map(|size: f64| (size, 3.0 * size.powf(1.75)));
        let rate = rate("e", "", points.to_vec()).unwrap();
        assert!((rate.fitted - 1.75).abs() < 1e-12);
        assert!(rate.pairs.len() == 2 && rate.pairs.iter().all(|pair| (pair - 1.75).abs() < 1e-12));
        assert_eq!(rate.points[0].0, 0.5, "from coarse to fine");
    }

    #[test]
    fn a_fit_goes_between_points_that_are_no_power_law() {
        // Logarithms (0, 0), (1, 1), (2, 4): the best line has slope 2.
        let points: Vec<(f64, f64)> = [(0.0, 0.0), (1.0, 1.0), (2.0, 4.0)]
            .map(|(x, y): (f64, f64)| (x.exp(), y.exp()))
            .into();
        let rate = rate("e", "", points).unwrap();
        assert!((rate.fitted - 2.0).abs() < 1e-12, "{}", rate.fitted);
    }

    #[test]
    fn equal_cells_and_single_points_have_no_rate() {
        assert_eq!(rate("e", "", vec![(0.1, 1.0), (0.1, 2.0)]), None);
        assert_eq!(rate("e", "", vec![(0.1, 1.0)]), None);
        assert_eq!(rate("e", "", vec![(0.2, 1.0), (0.1, 0.0)]), None);
    }
}
