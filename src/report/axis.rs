//! Axes: what is written along them, and where their marks stand.

use std::ops::Range;

use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};

use super::canvas::superscript;

/// Largest size of a value that is drawn: sums and quotients of such values are finite.
const LARGEST: f64 = 1e150;

/// Most digits after the point that a number has.
const MOST_DECIMALS: f64 = 17.0;

/// How values become places along an axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scale {
    #[default]
    Linear,
    /// Whole numbers, such as those of steps: no marks in between.
    Whole,
    /// Powers of ten, with 2 and 5 times them where the data span less than two. Values that are not positive are left out.
    Log,
    /// Powers of two, as of numbers of ranks. Values that are not positive are left out.
    Doubling,
}

/// One axis of a chart.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Axis {
    /// What is shown, without its unit.
    pub label: String,
    /// Unit of the values; empty without. Large and small ones get a prefix or a power of ten.
    pub unit: String,
    pub scale: Scale,
    /// Ends of the axis; what the data need unless set.
    pub range: Option<(f64, f64)>,
}

impl Axis {
    /// A linear axis that fits its data.
    pub fn new(label: &str, unit: &str) -> Self {
        Axis {
            label: label.into(),
            unit: unit.into(),
            ..Default::default()
        }
    }

    /// The same with powers of ten.
    pub fn log(self) -> Self {
        Axis {
            scale: Scale::Log,
            ..self
        }
    }

    /// The same with powers of two.
    pub fn doubling(self) -> Self {
        Axis {
            scale: Scale::Doubling,
            ..self
        }
    }

    /// The same for whole numbers.
    pub fn whole(self) -> Self {
        Axis {
            scale: Scale::Whole,
            ..self
        }
    }

    /// Fits the axis to data; what is not finite or beyond all measure, and on a logarithmic axis not positive, does not
    /// count.
    pub fn fit(&self, data: impl Iterator<Item = f64>) -> Fitted {
        let log = matches!(self.scale, Scale::Log | Scale::Doubling);
        let known = data.filter(|value| is_drawn(*value) && (!log || *value > 0.0));
        let limits = |(low, high): (f64, f64), value: f64| (low.min(value), high.max(value));
        let found = known.fold((f64::INFINITY, f64::NEG_INFINITY), limits);
        let default = if log { (1.0, 10.0) } else { (0.0, 1.0) };
        let found = if found.0 <= found.1 { found } else { default };
        match self.scale {
            Scale::Log => self.fit_log(self.range.unwrap_or(found)),
            Scale::Doubling => self.fit_doubling(self.range.unwrap_or(found)),
            Scale::Linear | Scale::Whole => self.fit_linear(found),
        }
    }

    fn fit_linear(&self, found: (f64, f64)) -> Fitted {
        let wide = |(low, high): &(f64, f64)| is_drawn(*low) && is_drawn(*high) && high - low > least_span(*low, *high);
        let (low, high) = self.range.filter(wide).unwrap_or_else(|| with_margin(found));
        let (factor, unit) = match self.scale {
            Scale::Whole => (1.0, self.unit.clone()),
            _ => scaled_unit(low.abs().max(high.abs()), &self.unit),
        };
        let (low, high) = (low / factor, high / factor);
        let mut step = nice_step((high - low) / 6.0);
        if self.scale == Scale::Whole {
            step = step.max(1.0);
        }
        let first = (low / step).ceil() as i64;
        let last = (high / step).floor() as i64;
        let decimals = (-step.log10().floor()).clamp(0.0, MOST_DECIMALS) as usize;
        let ticks = (first..=last).map(|k| k as f64 * step);
        let ticks = ticks.map(|value| (value, decimal(value, decimals))).collect();
        Fitted {
            factor,
            log: false,
            range: (low, high),
            ticks,
            minor: Vec::new(),
            title: titled(&self.label, &unit),
        }
    }

    fn fit_log(&self, found: (f64, f64)) -> Fitted {
        if found.1 < 100.0 * found.0 {
            return self.fit_short_log(found);
        }
        let (low, high) = (found.0.log10().floor(), found.1.log10().ceil());
        let (low_power, high_power) = (low as i32, high as i32);
        let stride = ((high_power - low_power + 7) / 8).max(1);
        let ticks = (low_power..=high_power)
            .filter(|power| power.rem_euclid(stride) == 0)
            .map(|power| (f64::from(power), format!("10{}", superscript(power))))
            .collect();
        let minor = if stride == 1 {
            let between = |power: i32| (2..10).map(move |digit| f64::from(power) + f64::from(digit).log10());
            (low_power..high_power).flat_map(between).collect()
        } else {
            (low_power..=high_power).map(f64::from).collect()
        };
        self.logarithmic((low, high), ticks, minor)
    }

    /// Less than two powers of ten: from one of 1, 2, 5 times a power to another.
    fn fit_short_log(&self, found: (f64, f64)) -> Fitted {
        const LABELLED: [i32; 3] = [1, 2, 5];
        let (first, last) = (found.0.log10().floor() as i32 - 1, found.1.log10().ceil() as i32 + 1);
        let place = |power: i32, digit: i32| f64::from(power) + f64::from(digit).log10();
        let all = (first..=last).flat_map(|power| (1..10).map(move |digit| (power, digit)));
        let (marks, others): (Vec<_>, Vec<_>) = all.partition(|(_, digit)| LABELLED.contains(digit));
        let places = marks.iter().map(|&(power, digit)| place(power, digit));
        let (from, to) = (found.0.log10(), found.1.log10());
        let mut low = places
            .clone()
            .filter(|place| *place <= from + 1e-9)
            .fold(f64::NEG_INFINITY, f64::max);
        let mut high = places
            .clone()
            .filter(|place| *place >= to - 1e-9)
            .fold(f64::INFINITY, f64::min);
        if low == high {
            low = places
                .clone()
                .filter(|place| *place < low)
                .fold(f64::NEG_INFINITY, f64::max);
            high = places.filter(|place| *place > high).fold(f64::INFINITY, f64::min);
        }
        let inside = |place: f64| (low..=high).contains(&place);
        let ticks = marks
            .iter()
            .map(|&(power, digit)| (place(power, digit), power_label(power, digit)));
        let minor = others.iter().map(|&(power, digit)| place(power, digit));
        let ticks = ticks.filter(|(place, _)| inside(*place)).collect();
        self.logarithmic((low, high), ticks, minor.filter(|place| inside(*place)).collect())
    }

    fn fit_doubling(&self, found: (f64, f64)) -> Fitted {
        let (first, last) = (found.0.log2().floor() as i32, found.1.log2().ceil() as i32);
        let last = last.max(first + 1);
        let stride = ((last - first + 7) / 8).max(1);
        let place = |power: i32| f64::from(power) * 2f64.log10();
        let ticks = (first..=last)
            .filter(|power| (power - first) % stride == 0)
            .map(|power| (place(power), format!("{}", 2f64.powi(power))))
            .collect();
        self.logarithmic((place(first), place(last)), ticks, Vec::new())
    }

    /// An axis of logarithms to base ten.
    fn logarithmic(&self, range: (f64, f64), ticks: Vec<(f64, String)>, minor: Vec<f64>) -> Fitted {
        Fitted {
            factor: 1.0,
            log: true,
            range,
            ticks,
            minor,
            title: titled(&self.label, &self.unit),
        }
    }
}

/// An axis with its marks, in the numbers that are drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct Fitted {
    factor: f64,
    log: bool,
    /// Ends as drawn.
    pub range: (f64, f64),
    /// Places of the marks with their labels.
    pub ticks: Vec<(f64, String)>,
    /// Places of marks without labels.
    pub minor: Vec<f64>,
    /// Label with unit.
    pub title: String,
}

impl Fitted {
    /// Place of a value along the axis; `None` where it has none.
    pub fn place(&self, value: f64) -> Option<f64> {
        let place = if self.log { value.log10() } else { value / self.factor };
        (is_drawn(value) && place.is_finite()).then_some(place)
    }
}

/// What the drawing library asks of an axis.
impl Ranged for Fitted {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, place: &f64, pixels: (i32, i32)) -> i32 {
        // Far outside is far enough: pixels are counted in 32 bits.
        let share = ((place - self.range.0) / (self.range.1 - self.range.0)).clamp(-100.0, 100.0);
        pixels.0 + (f64::from(pixels.1 - pixels.0) * share).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        if hint.weight().allow_light_points() {
            self.minor.clone()
        } else {
            self.ticks.iter().map(|(place, _)| *place).collect()
        }
    }

    fn range(&self) -> Range<f64> {
        self.range.0..self.range.1
    }
}

impl ValueFormatter<f64> for Fitted {
    fn format_ext(&self, place: &f64) -> String {
        let found = self.ticks.iter().find(|(tick, _)| tick == place);
        found.map_or_else(String::new, |(_, label)| label.clone())
    }
}

fn titled(label: &str, unit: &str) -> String {
    match unit {
        "" => label.to_owned(),
        unit => format!("{label} [{unit}]"),
    }
}

/// Whether a value has a place in a drawing.
pub fn is_drawn(value: f64) -> bool {
    value.abs() <= LARGEST
}

/// What two values differ by in round-off.
fn least_span(low: f64, high: f64) -> f64 {
    1e-9 * low.abs().max(high.abs())
}

/// A little room at both ends; some around a single value.
fn with_margin((low, high): (f64, f64)) -> (f64, f64) {
    let size = low.abs().max(high.abs());
    // What differs in round-off only is drawn as the constant that it is.
    let span = if high - low > least_span(low, high) {
        high - low
    } else {
        0.0
    };
    let margin = match (span, size) {
        (0.0, 0.0) => 1.0,
        (0.0, size) => 0.2 * size,
        (span, _) => 0.03 * span,
    };
    (low - margin, high + margin)
}

/// 1, 2 or 5 times a power of ten, at least the given length.
fn nice_step(least: f64) -> f64 {
    let power = 10f64.powf(least.log10().floor());
    let factors = [1.0, 2.0, 5.0, 10.0];
    let fits = |factor: &&f64| **factor * power >= least * (1.0 - 1e-9);
    factors.iter().find(fits).unwrap_or(&10.0) * power
}

/// A digit times a power of ten, written out where that is short.
fn power_label(power: i32, digit: i32) -> String {
    match (power, digit) {
        (-2..=3, _) => decimal(f64::from(digit) * 10f64.powi(power), (-power).max(0) as usize),
        (_, 1) => format!("10{}", superscript(power)),
        _ => format!("{digit}·10{}", superscript(power)),
    }
}

/// A number with a fixed number of decimals and a proper minus sign.
fn decimal(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(digits) if digits.chars().any(|c| c.is_ascii_digit() && c != '0') => format!("−{digits}"),
        Some(digits) => digits.to_owned(),
        None => text,
    }
}

/// What to divide values of up to a given size by, and the unit of the quotients.
pub fn scaled_unit(largest: f64, unit: &str) -> (f64, String) {
    const PREFIXED: [&str; 7] = ["m", "Pa", "N", "N/m", "N m", "J", "rad"];
    const PREFIXES: [&str; 9] = ["p", "n", "µ", "m", "", "k", "M", "G", "T"];
    let readable = largest == 0.0 || (0.1..2000.0).contains(&largest);
    let power = if readable || !largest.is_finite() {
        0
    } else {
        (3 * (largest.log10() / 3.0).floor() as i32).max(-300)
    };
    let small = unit.is_empty() && (1e-3..1e4).contains(&largest);
    if power == 0 || small {
        return (1.0, unit.to_owned());
    }
    let prefix = PREFIXES
        .get((power / 3 + 4) as usize)
        .filter(|_| PREFIXED.contains(&unit));
    let named = match prefix {
        Some(prefix) => format!("{prefix}{unit}"),
        None => format!("10{} {unit}", superscript(power)).trim_end().to_owned(),
    };
    (10f64.powi(power), named)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(fitted: &Fitted) -> Vec<&str> {
        fitted.ticks.iter().map(|(_, label)| label.as_str()).collect()
    }

    #[test]
    fn marks_are_round_numbers_in_a_prefixed_unit() {
        let fitted = Axis::new("force", "N").fit([-4.0e5, 0.0].into_iter());
        assert_eq!(fitted.title, "force [kN]");
        assert_eq!(labels(&fitted), ["−400", "−300", "−200", "−100", "0"]);
        assert_eq!(fitted.place(-1.0e5), Some(-100.0));
        assert_eq!(fitted.format_ext(&-100.0), "−100");
    }

    #[test]
    fn units_without_a_prefix_get_a_power_of_ten() {
        assert_eq!(scaled_unit(3.0e-9, "m³"), (1e-9, "10⁻⁹ m³".to_owned()));
        assert_eq!(scaled_unit(3.0e-9, "m").1, "nm");
        assert_eq!(scaled_unit(25.0e4, "").1, "10³");
        assert_eq!(scaled_unit(0.02, ""), (1.0, String::new()));
        assert_eq!(scaled_unit(0.0, "Pa"), (1.0, "Pa".to_owned()));
    }

    #[test]
    fn a_logarithmic_axis_ends_at_powers_of_ten_and_leaves_out_zero() {
        let fitted = Axis::new("residual", "")
            .log()
            .fit([0.0, f64::NAN, 3e-4, 2.0].into_iter());
        assert_eq!(fitted.range, (-4.0, 1.0));
        assert_eq!(labels(&fitted), ["10⁻⁴", "10⁻³", "10⁻²", "10⁻¹", "10⁰", "10¹"]);
        assert_eq!(fitted.place(0.0), None);
        assert_eq!(fitted.place(-1.0), None);
        let wide = Axis::new("residual", "").log().fit([1e-16, 1e2].into_iter());
        assert!(wide.ticks.len() <= 9, "{:?}", wide.ticks);
    }

    #[test]
    fn a_short_logarithmic_axis_has_marks_between_powers_of_ten() {
        let times = Axis::new("wall time", "s").log().fit([2.7, 3.6, 14.0].into_iter());
        assert_eq!(labels(&times), ["2", "5", "10", "20"]);
        assert!((times.range.0 - 2f64.log10()).abs() < 1e-12, "{times:?}");
        assert_eq!(times.minor.len(), 6, "3, 4, 6, 7, 8 and 9: {times:?}");
        let errors = Axis::new("error", "").log().fit([1.8e-3, 0.013].into_iter());
        assert_eq!(labels(&errors), ["10⁻³", "2·10⁻³", "5·10⁻³", "0.01", "0.02"]);
    }

    #[test]
    fn ranks_double_from_mark_to_mark() {
        let ranks = Axis::new("ranks", "").doubling().fit([1.0, 2.0, 6.0].into_iter());
        assert_eq!(labels(&ranks), ["1", "2", "4", "8"]);
        assert_eq!(ranks.place(2.0), Some(ranks.ticks[1].0));
    }

    #[test]
    fn whole_numbers_have_no_marks_between_them() {
        let fitted = Axis::new("step", "").whole().fit([0.0, 2.0].into_iter());
        assert_eq!(labels(&fitted), ["0", "1", "2"]);
    }

    #[test]
    fn values_beyond_all_measure_have_no_place_and_spoil_nothing() {
        let odd = [0.5, 1.0, f64::MAX, -f64::MAX, f64::NAN, f64::INFINITY, 5e-324, -1e-310];
        for axis in [
            Axis::new("odd", "Pa"),
            Axis::new("odd", "").whole(),
            Axis::new("odd", "").log(),
            Axis::new("odd", "").doubling(),
        ] {
            for values in (0..odd.len()).flat_map(|k| [&odd[..=k], &odd[k..]]) {
                let fitted = axis.fit(values.iter().copied());
                assert!(fitted.range.0 < fitted.range.1, "{values:?}: {fitted:?}");
                assert!(
                    fitted.ticks.iter().all(|(_, label)| label.len() < 400),
                    "{values:?}: {fitted:?}"
                );
                for place in values.iter().filter_map(|&value| fitted.place(value)) {
                    fitted.map(&place, (i32::MAX / 4, 0));
                }
                assert_eq!(fitted.place(f64::MAX), None);
            }
        }
        for range in [
            (0.0, f64::MAX),
            (f64::NAN, 1.0),
            (1.0, 1.0),
            (1e10, 1e10 + 1e-6),
            (0.0, 5e-324),
        ] {
            let axis = Axis {
                range: Some(range),
                ..Axis::new("given", "m")
            };
            let fitted = axis.fit(std::iter::empty());
            assert!(
                fitted.range.0 < fitted.range.1 && fitted.ticks.len() <= 12,
                "{range:?}: {fitted:?}"
            );
        }
    }

    #[test]
    fn constants_and_no_data_at_all_have_an_axis() {
        for values in [
            vec![],
            vec![0.0],
            vec![5.0, 5.0],
            vec![f64::NAN],
            vec![-1e-300],
            vec![1.0, 1.0 + 1e-16],
        ] {
            let fitted = Axis::new("constant", "Pa").fit(values.iter().copied());
            assert!(fitted.range.0 < fitted.range.1, "{values:?}: {fitted:?}");
            assert!((2..=12).contains(&fitted.ticks.len()), "{values:?}: {fitted:?}");
            let log = Axis::new("constant", "Pa").log().fit(values.iter().copied());
            assert!(log.range.0 < log.range.1, "{values:?}: {log:?}");
        }
    }
}
