//! Numbers read from the results of a run, and how far they are from a reference.

use super::file::{MeasureKeys, OneOrSeveral};
use super::outcome::Outcome;
use crate::config::file::ScalarOr;
use crate::config::table::{Table, plain_name};
use crate::file::read_text;
use std::collections::BTreeMap;
use std::path::Path;

/// Longest table of results that is read [byte]: ten million rows are shorter.
const MAXIMUM_TABLE: u64 = 4 << 30;

/// Something that is measured.
#[derive(Clone, Debug, PartialEq)]
pub struct Measure {
    /// Its place in the list of the file.
    pub entry: usize,
    pub name: String,
    kind: Kind,
}

#[derive(Clone, Debug, PartialEq)]
enum Kind {
    Last(Vec<String>),
    Max(String),
    Min(String),
    At {
        columns: Vec<String>,
        when: String,
        equals: f64,
    },
    Distance {
        x: String,
        y: String,
    },
    Summary(String),
    Error(String),
}

/// What measures are compared with.
#[derive(Clone, Debug)]
pub enum Reference {
    None,
    /// The first run of the study.
    Run,
    /// Values by the name of the measure.
    Values(BTreeMap<String, Vec<f64>>),
    Table(History),
}

/// What a measure gives for one run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Reading {
    /// One number per column of the measure; none where it is an error by itself.
    pub values: Vec<f64>,
    /// Relative to the reference, where there is one.
    pub error: Option<f64>,
}

fn list(names: &OneOrSeveral<String>) -> Vec<String> {
    match names {
        ScalarOr::Scalar(name) => vec![name.clone()],
        ScalarOr::Collection(names) => names.clone(),
    }
}

impl Measure {
    /// What an entry of `measure` means.
    ///
    /// # Errors
    /// What is wrong, and what is accepted.
    pub fn of(entry: usize, keys: &MeasureKeys) -> Result<Measure, (&'static str, &'static str)> {
        let at = keys.at.as_ref().map(|at| Kind::At {
            columns: list(&at.column),
            when: at.when.clone(),
            equals: at.equals,
        });
        let distance = keys.distance.as_ref().map(|distance| Kind::Distance {
            x: distance.x.clone(),
            y: distance.y.clone(),
        });
        let kinds = [
            keys.last.as_ref().map(|names| Kind::Last(list(names))),
            keys.max.clone().map(Kind::Max),
            keys.min.clone().map(Kind::Min),
            at,
            distance,
            keys.summary.clone().map(Kind::Summary),
            keys.error.clone().map(Kind::Error),
        ];
        let mut kinds: Vec<Kind> = kinds.into_iter().flatten().collect();
        let expected = "exactly one of last, max, min, at, distance, summary, error";
        let kind = kinds.pop().filter(|_| kinds.is_empty());
        let kind = kind.ok_or(("it is not clear what is measured", expected))?;
        if matches!(&kind, Kind::Last(names) | Kind::At { columns: names, .. } if names.is_empty()) {
            return Err(("the list of columns is empty", "names of columns"));
        }
        let name = keys.name.clone();
        Ok(Measure { entry, name, kind })
    }

    /// How many numbers it has.
    pub fn size(&self) -> usize {
        match &self.kind {
            Kind::Last(names) | Kind::At { columns: names, .. } => names.len(),
            _ => 1,
        }
    }

    /// Columns that it becomes in the table: its values, then its error.
    pub fn columns(&self) -> Vec<String> {
        let mut columns = match &self.kind {
            Kind::Distance { .. } | Kind::Error(_) => Vec::new(),
            Kind::Last(names) | Kind::At { columns: names, .. } if names.len() > 1 => {
                names.iter().map(|name| format!("{}.{name}", self.name)).collect()
            }
            _ => vec![self.name.clone()],
        };
        columns.push(self.error_column());
        columns
    }

    fn error_column(&self) -> String {
        match &self.kind {
            Kind::Distance { .. } | Kind::Error(_) => self.name.clone(),
            _ => format!("{}_error", self.name),
        }
    }

    /// Whether it needs the curve of a reference.
    pub fn needs_curve(&self) -> bool {
        matches!(self.kind, Kind::Distance { .. })
    }

    /// Columns of the history that it reads.
    pub fn history_columns(&self) -> Vec<&str> {
        let names: Vec<&String> = match &self.kind {
            Kind::Last(names) => names.iter().collect(),
            Kind::Max(name) | Kind::Min(name) => vec![name],
            Kind::At { columns, when, .. } => columns.iter().chain([when]).collect(),
            Kind::Distance { x, y } => vec![x, y],
            Kind::Summary(_) | Kind::Error(_) => Vec::new(),
        };
        names.into_iter().map(String::as_str).collect()
    }

    /// Its numbers in one run, or `None` where the results do not hold them.
    pub fn values(&self, history: Option<&History>, outcome: Option<&Outcome>) -> Option<Vec<f64>> {
        match &self.kind {
            Kind::Last(names) => {
                let last = |name: &String| history?.column(name)?.last().copied();
                names.iter().map(last).collect()
            }
            Kind::Max(name) => Some(vec![history?.column(name)?.iter().copied().reduce(f64::max)?]),
            Kind::Min(name) => Some(vec![history?.column(name)?.iter().copied().reduce(f64::min)?]),
            Kind::At { columns, when, equals } => {
                let place = crossing(history?.column(when)?, *equals)?;
                let value = |name: &String| Some(between(history?.column(name)?, place));
                columns.iter().map(value).collect()
            }
            Kind::Distance { .. } => None,
            Kind::Summary(key) | Kind::Error(key) => Some(vec![outcome?.number(key)?]),
        }
    }

    /// What stands for its numbers in a run that did not complete.
    pub fn unread(&self) -> Reading {
        let values = match self.kind {
            Kind::Distance { .. } | Kind::Error(_) => Vec::new(),
            _ => vec![f64::NAN; self.size()],
        };
        Reading { values, error: None }
    }

    /// Its numbers in one run, and their error.
    pub fn read(&self, history: Option<&History>, outcome: &Outcome, reference: &ReferenceResults) -> Reading {
        match &self.kind {
            Kind::Distance { x, y } => {
                let curves = history.zip(reference.history.as_ref());
                let distance = curves.and_then(|(own, exact)| distance(own.curve(x, y)?, exact.curve(x, y)?));
                Reading {
                    values: Vec::new(),
                    error: distance,
                }
            }
            Kind::Error(_) => Reading {
                values: Vec::new(),
                error: self.values(history, Some(outcome)).map(|values| values[0]),
            },
            _ => {
                let values = self.values(history, Some(outcome));
                let exact = reference.values.get(&self.name);
                let error = values
                    .as_ref()
                    .zip(exact)
                    .and_then(|(values, exact)| relative(values, exact));
                Reading {
                    values: values.unwrap_or_else(|| vec![f64::NAN; self.size()]),
                    error,
                }
            }
        }
    }
}

/// What the runs of a study are compared with, read once.
#[derive(Clone, Debug, Default)]
pub struct ReferenceResults {
    /// Values by the name of the measure.
    pub values: BTreeMap<String, Vec<f64>>,
    pub history: Option<History>,
}

impl ReferenceResults {
    /// `run` is the outcome and the folder of the reference run, where there is one and it completed.
    pub fn of(reference: &Reference, measures: &[Measure], run: Option<(&Outcome, &Path)>) -> Self {
        let (history, outcome) = match reference {
            Reference::None => (None, None),
            Reference::Values(values) => {
                let values = values.clone();
                return ReferenceResults { values, history: None };
            }
            Reference::Table(table) => (Some(table.clone()), None),
            Reference::Run => match run {
                Some((outcome, folder)) => (History::read(&folder.join("history.csv")).ok(), Some(outcome)),
                None => (None, None),
            },
        };
        let value = |measure: &Measure| Some((measure.name.clone(), measure.values(history.as_ref(), outcome)?));
        let values = measures.iter().filter_map(value).collect();
        ReferenceResults { values, history }
    }
}

/// |values - exact| / |exact| with Euclid's norm; `None` where that is no number.
fn relative(values: &[f64], exact: &[f64]) -> Option<f64> {
    let norm = |values: &mut dyn Iterator<Item = f64>| values.map(|value| value * value).sum::<f64>().sqrt();
    let difference = norm(&mut values.iter().zip(exact).map(|(value, exact)| value - exact));
    let error = difference / norm(&mut exact.iter().copied());
    error.is_finite().then_some(error)
}

/// Row, with a fraction, at which a column first reaches a value.
fn crossing(column: &[f64], value: f64) -> Option<f64> {
    if column.first() == Some(&value) {
        return Some(0.0);
    }
    let reaches = |pair: &[f64]| (pair[0] - value) * (pair[1] - value) <= 0.0 && pair[0] != pair[1];
    let row = column.windows(2).position(reaches)?;
    Some(row as f64 + (value - column[row]) / (column[row + 1] - column[row]))
}

/// A column at a row with a fraction.
fn between(column: &[f64], place: f64) -> f64 {
    let row = (place as usize).min(column.len().saturating_sub(2));
    let part = place - row as f64;
    match column.get(row + 1) {
        Some(next) => column[row] + part * (next - column[row]),
        None => column[row],
    }
}

/// A piecewise straight curve: places that increase, and values.
type Curve = Vec<(f64, f64)>;

/// sqrt(integral of (own - exact)^2 / integral of exact^2) over the range that both curves have. Between neighbouring
/// places of either, both are straight, and Simpson's rule is exact for their squares.
fn distance(own: Curve, exact: Curve) -> Option<f64> {
    let begin = own.first()?.0.max(exact.first()?.0);
    let end = own.last()?.0.min(exact.last()?.0);
    let mut places: Vec<f64> = own.iter().chain(&exact).map(|point| point.0).collect();
    places.retain(|place| (begin..=end).contains(place));
    places.sort_by(f64::total_cmp);
    places.dedup();
    let integral = |value: &dyn Fn(f64) -> f64| -> f64 {
        let piece = |pair: &[f64]| {
            let middle = 0.5 * (pair[0] + pair[1]);
            (pair[1] - pair[0]) / 6.0 * (value(pair[0]) + 4.0 * value(middle) + value(pair[1]))
        };
        places.windows(2).map(piece).sum()
    };
    let difference = integral(&|x| (value_at(&own, x) - value_at(&exact, x)).powi(2));
    let size = integral(&|x| value_at(&exact, x).powi(2));
    let distance = (difference / size).sqrt();
    distance.is_finite().then_some(distance)
}

/// A curve at a place within its range.
fn value_at(curve: &Curve, x: f64) -> f64 {
    let next = curve.partition_point(|point| point.0 < x).clamp(1, curve.len() - 1);
    let ((x0, y0), (x1, y1)) = (curve[next - 1], curve[next]);
    y0 + (y1 - y0) * (x - x0) / (x1 - x0)
}

/// Columns of numbers, as in `history.csv`; cells that are no numbers count as NaN.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct History {
    columns: BTreeMap<String, Vec<f64>>,
}

impl History {
    /// Reads a CSV file with a line of names.
    ///
    /// # Errors
    /// It cannot be read, its columns cannot be told apart, its rows differ in length, or it has none.
    pub fn read(path: &Path) -> Result<History, String> {
        let name = path.display();
        let text = read_text(path, MAXIMUM_TABLE).map_err(|reason| format!("{name}: {reason}"))?;
        let table = Table::open(&text).map_err(|problem| format!("{name}:{}: {}", problem.line, problem.message))?;
        let names = table.names().ok_or_else(|| format!("{name} has no names of columns"))?;
        let mut columns = vec![Vec::new(); names.len()];
        for (line, fields) in table.rows() {
            if fields.len() != names.len() {
                let (found, needed) = (fields.len(), names.len());
                return Err(format!("{name}:{line}: {found} columns instead of {needed}"));
            }
            for (column, field) in columns.iter_mut().zip(&fields) {
                column.push(field.parse().unwrap_or(f64::NAN));
            }
        }
        if columns.first().is_none_or(Vec::is_empty) {
            return Err(format!("{name} has no rows"));
        }
        Ok(History {
            columns: names.iter().cloned().zip(columns).collect(),
        })
    }

    /// Names of the columns.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.columns.keys().map(String::as_str)
    }

    /// A column of numbers alone; another program may write its name in other letters, or with a unit.
    pub fn column(&self, name: &str) -> Option<&[f64]> {
        let alike = |(other, _): &(&String, _)| plain_name(other) == plain_name(name);
        let written_otherwise = || self.columns.iter().find(alike).map(|(_, column)| column);
        let column = self.columns.get(name).or_else(written_otherwise)?;
        column.iter().all(|value| value.is_finite()).then_some(column)
    }

    /// Two columns as a curve from left to right, if it does not turn back; of equal places the last counts.
    fn curve(&self, x: &str, y: &str) -> Option<Curve> {
        let mut curve: Curve = self
            .column(x)?
            .iter()
            .copied()
            .zip(self.column(y)?.iter().copied())
            .collect();
        if curve.first()?.0 > curve.last()?.0 {
            curve.reverse();
        }
        curve.dedup_by(|later, kept| {
            let same = later.0 == kept.0;
            if same {
                *kept = *later;
            }
            same
        });
        (curve.len() > 1 && curve.is_sorted_by(|one, next| one.0 < next.0)).then_some(curve)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn history(columns: &[(&str, &[f64])]) -> History {
        let columns = columns
            .iter()
            .map(|(name, values)| ((*name).to_owned(), values.to_vec()));
        History {
            columns: columns.collect(),
        }
    }

    fn measure(kind: Kind) -> Measure {
        Measure {
            entry: 0,
            name: "m".to_owned(),
            kind,
        }
    }

    #[test]
    fn last_largest_smallest_and_crossing_values_are_read() {
        let history = history(&[("u", &[0.0, -1.0, -3.0]), ("f", &[0.0, 8.0, 4.0])]);
        let read = |kind| measure(kind).values(Some(&history), None);
        assert_eq!(read(Kind::Last(vec!["f".into(), "u".into()])), Some(vec![4.0, -3.0]));
        assert_eq!(read(Kind::Max("f".into())), Some(vec![8.0]));
        assert_eq!(read(Kind::Min("u".into())), Some(vec![-3.0]));
        let at = |equals| Kind::At {
            columns: vec!["f".into()],
            when: "u".into(),
            equals,
        };
        assert_eq!(read(at(-2.0)), Some(vec![6.0]), "half way between two rows");
        assert_eq!(read(at(-3.0)), Some(vec![4.0]));
        assert_eq!(read(at(0.0)), Some(vec![0.0]));
        assert_eq!(read(at(-3.5)), None, "never reached");
        assert_eq!(read(Kind::Max("absent".into())), None);
    }

    #[test]
    fn tables_of_other_programs_are_read() {
        let path = std::env::temp_dir().join(format!("mpm-petsc-table-{}.csv", std::process::id()));
        let read = |text: &str| {
            std::fs::write(&path, text).unwrap();
            History::read(&path)
        };
        let table = read("\u{feff}Settlement [m];stage;force\r\n0.5;push;1e3\r\n1.0;push;2e3\r\n").unwrap();
        assert_eq!(table.column("settlement"), Some([0.5, 1.0].as_slice()));
        assert_eq!(table.column("force"), Some([1e3, 2e3].as_slice()));
        assert_eq!((table.column("stage"), table.column("moment")), (None, None));
        for (text, message) in [
            ("a;b\n0,5;1\n", ".csv:2: the numbers have decimal commas"),
            ("a,b\n1,2\n3\n", ".csv:3: 1 columns instead of 2"),
            ("1,2\n", "has no names of columns"),
            ("a,b\n", "has no rows"),
        ] {
            let problem = read(text).unwrap_err();
            assert!(problem.contains(message), "{problem}");
        }
        std::fs::remove_file(&path).unwrap();
    }

    #[test]
    fn an_error_is_relative_to_the_norm_of_the_reference() {
        assert_eq!(relative(&[3.0, 4.0], &[0.0, 4.0]), Some(0.75));
        assert_eq!(relative(&[1.0], &[0.0]), None);
    }

    #[test]
    fn the_distance_of_two_curves_is_an_integral_over_what_they_share() {
        // x against 1.1 x is 10 % off; other places and a longer range change nothing.
        let exact = history(&[("x", &[0.0, 1.0, 4.0]), ("y", &[0.0, 1.0, 4.0])]);
        let own = history(&[("x", &[3.0, 2.0, 0.5, 0.0]), ("y", &[3.3, 2.2, 0.55, 0.0])]);
        let apart = distance(own.curve("x", "y").unwrap(), exact.curve("x", "y").unwrap()).unwrap();
        assert!((apart - 0.1).abs() < 1e-14, "{apart}");
        // A constant 1 against the straight x over 0 to 1: the integrals are 1/3 and 1/3.
        let one = vec![(0.0, 1.0), (1.0, 1.0)];
        let straight = vec![(0.0, 0.0), (1.0, 1.0)];
        assert!((distance(one, straight).unwrap() - 1.0).abs() < 1e-14);
        let back = history(&[("x", &[0.0, 2.0, 1.0, 3.0]), ("y", &[0.0; 4])]);
        assert_eq!(back.curve("x", "y"), None);
    }
}
