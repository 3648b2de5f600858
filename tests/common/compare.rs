//! Comparisons that show a table where they fail.

use super::results::Table;

/// Numbers beside what they should be.
pub struct Comparison {
    title: String,
    lines: Vec<String>,
    compared: usize,
    failed: usize,
}

impl Comparison {
    pub fn new(title: &str) -> Self {
        Comparison {
            title: title.to_owned(),
            lines: Vec::new(),
            compared: 0,
            failed: 0,
        }
    }

    /// Compares a number: within an absolute tolerance.
    pub fn within(&mut self, name: &str, obtained: f64, expected: f64, tolerance: f64) {
        let difference = (obtained - expected).abs();
        // Not a number is a failure too.
        let holds = difference <= tolerance;
        self.compared += 1;
        self.failed += usize::from(!holds);
        let mark = if holds { "" } else { "  <--" };
        self.lines.push(format!(
            "{name:<32} {obtained:>18.10e} {expected:>18.10e} {difference:>10.2e} {tolerance:>10.2e}{mark}"
        ));
    }

    /// Compares a number: within a share of what it should be.
    pub fn relative(&mut self, name: &str, obtained: f64, expected: f64, share: f64) {
        self.within(name, obtained, expected, share * expected.abs());
    }

    /// A number that must not be larger than a bound.
    pub fn at_most(&mut self, name: &str, obtained: f64, bound: f64) {
        let holds = obtained <= bound;
        self.compared += 1;
        self.failed += usize::from(!holds);
        let mark = if holds { "" } else { "  <--" };
        self.lines
            .push(format!("{name:<32} {obtained:>18.10e}    at most {bound:>10.2e}{mark}"));
    }

    /// # Panics
    /// With the table if a number is not as it should be, or if nothing was compared.
    pub fn finish(self) {
        let head = format!(
            "{}\n{:<32} {:>18} {:>18} {:>10} {:>10}",
            self.title, "", "obtained", "expected", "difference", "allowed"
        );
        let table = format!("{head}\n{}\n", self.lines.join("\n"));
        assert!(self.compared > 0, "{table}nothing was compared");
        assert!(self.failed == 0, "\n{table}{} of {} differ", self.failed, self.compared);
        println!("{table}");
    }
}

/// The same history: every quantity within a share of the largest magnitude of its column, the same steps.
pub fn same_history(title: &str, obtained: &Table, expected: &Table, share: f64) {
    same_columns(
        title,
        obtained,
        expected,
        &["step", "stage", "load_factor", "step_size"],
    );
    same_quantities(title, obtained, expected, &expected.quantities(), share);
}

/// As [`same_history`], for a path: its load factors are results.
pub fn same_path(title: &str, obtained: &Table, expected: &Table, share: f64) {
    same_columns(title, obtained, expected, &["step", "stage"]);
    let mut quantities = expected.quantities();
    quantities.extend(["load_factor", "step_size"]);
    same_quantities(title, obtained, expected, &quantities, share);
}

fn same_columns(title: &str, obtained: &Table, expected: &Table, names: &[&str]) {
    assert_eq!(obtained.columns, expected.columns, "{title}");
    assert_eq!(obtained.rows.len(), expected.rows.len(), "{title}: number of rows");
    for column in names {
        assert_eq!(obtained.text(column), expected.text(column), "{title}: {column}");
    }
}

fn same_quantities(title: &str, obtained: &Table, expected: &Table, names: &[&str], share: f64) {
    let mut comparison = Comparison::new(title);
    for &name in names {
        let (own, other) = (obtained.column(name), expected.column(name));
        let largest = other.iter().fold(0.0f64, |largest, value| largest.max(value.abs()));
        assert!(
            other.iter().all(|value| value.is_finite()),
            "{title}: {name}: {other:?}"
        );
        let differences = own.iter().zip(&other).map(|(own, other)| (own - other).abs());
        // Where they differ most; a number that is not finite wins.
        let (row, _) = differences
            .enumerate()
            .max_by(|left, right| left.1.total_cmp(&right.1))
            .expect("a history has rows");
        comparison.within(&format!("{name}, row {row}"), own[row], other[row], share * largest);
    }
    comparison.finish();
}
