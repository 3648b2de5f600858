//! Rigid motions of a piece of the body, what prevents them, and what is left of them in words.
//!
//! Columns are the translations, then the rotations about the axes through a centre, small ones. A rigid rotation turns
//! points and their micro-rotations alike, unless nothing couples the two: then micro-rotations turn on their own.

use super::row_space::RowSpace;
use crate::continuum::UnknownKind;

/// The rigid motions of one piece.
#[derive(Clone, Debug, PartialEq)]
pub struct Motions {
    dimension: usize,
    centre: [f64; 3],
    /// A length of the piece, so that translations and rotations are of one size [m].
    size: f64,
    /// Whether micro-rotations turn on their own.
    uncoupled: bool,
}

impl Motions {
    /// Of points between two corners; `edge` is that of a cell [m]. `uncoupled` where the continuum has rotations that no
    /// modulus couples to the displacement.
    pub fn new(dimension: usize, low: &[f64], high: &[f64], edge: f64, uncoupled: bool) -> Self {
        let mut centre = [0.0; 3];
        let mut size = edge;
        for axis in 0..dimension {
            centre[axis] = 0.5 * (low[axis] + high[axis]);
            size += high[axis] - low[axis];
        }
        Self {
            dimension,
            centre,
            size,
            uncoupled,
        }
    }

    fn rotations(&self) -> usize {
        if self.dimension == 2 { 1 } else { 3 }
    }

    /// Number of columns.
    pub fn count(&self) -> usize {
        let turning = if self.uncoupled { 2 } else { 1 };
        self.dimension + turning * self.rotations()
    }

    /// What each motion does to an unknown at a position, by the number of the unknown and the kinds of all; `None` where
    /// rigid motions do nothing to it.
    pub fn row(&self, kinds: &[UnknownKind], component: usize, position: &[f64; 3]) -> Option<Vec<f64>> {
        let mut row = vec![0.0; self.count()];
        match kinds[component] {
            UnknownKind::Translation => {
                row[component] = 1.0;
                let arm: [f64; 3] = std::array::from_fn(|k| (position[k] - self.centre[k]) / self.size);
                for (column, axis) in self.axes().enumerate() {
                    row[self.dimension + column] = turned(axis, &arm)[component];
                }
            }
            UnknownKind::Rotation => {
                let before = &kinds[..component];
                let number = before.iter().filter(|&&kind| kind == UnknownKind::Rotation).count();
                let first = self.dimension + if self.uncoupled { self.rotations() } else { 0 };
                row[first + number] = 1.0;
            }
            UnknownKind::Damage => return None,
        }
        Some(row)
    }

    /// Axes of rotation.
    fn axes(&self) -> std::ops::Range<usize> {
        if self.dimension == 2 { 2..3 } else { 0..3 }
    }

    /// Free motions of a piece, without the columns of others that follow in them: an orthonormal basis.
    pub fn own(&self, free: &[Vec<f64>]) -> RowSpace {
        part(free, 0..self.count())
    }

    /// Translations along the axes that are among the free motions.
    pub fn translations(&self, free: &RowSpace) -> Vec<Vec<f64>> {
        let axes = (0..self.dimension).filter(|&axis| free.holds_unit(axis));
        axes.map(|axis| unit(self.count(), axis)).collect()
    }

    /// Free motions in words; empty where there are none.
    pub fn words(&self, free: &RowSpace) -> Vec<String> {
        let rotations = self.dimension..self.dimension + self.rotations();
        let moving = (0..self.dimension).filter(|&axis| free.holds_unit(axis));
        let moving = moving.map(|axis| NAMES[axis].to_owned()).collect();
        let free = free.basis();
        let mut words = Vec::new();
        let mut tell = |what: &str, along: Vec<String>| {
            if !along.is_empty() {
                words.push(format!("{what} {}", along.join(" and ")));
            }
        };
        tell("moving along", moving);
        tell("turning about", self.directions(&part(free, rotations.clone())));
        if self.uncoupled {
            let micro_rotations = rotations.end..self.count();
            tell(
                "turning its micro-rotations about",
                self.directions(&part(free, micro_rotations)),
            );
        }
        words
    }

    /// Axes that span a space of rotations: those of the coordinates as far as they lie in it.
    fn directions(&self, space: &RowSpace) -> Vec<String> {
        let mut known = RowSpace::new(self.rotations());
        let mut names = Vec::new();
        for (column, axis) in self.axes().enumerate().filter(|&(column, _)| space.holds_unit(column)) {
            known.add(&unit(self.rotations(), column));
            names.push(NAMES[axis].to_owned());
        }
        for row in space.basis() {
            if known.add(row) {
                let rest = known.basis().last().expect("a row was added");
                names.push(direction(rest));
            }
        }
        names
    }
}

/// A direction of unit length in two digits, its largest component positive.
fn direction(vector: &[f64]) -> String {
    let largest = vector.iter().copied().max_by(|a, b| a.abs().total_cmp(&b.abs()));
    let sign = largest.map_or(1.0, f64::signum);
    // Adding zero makes a negative zero positive.
    let digits = |entry: &f64| format!("{:.2}", (100.0 * sign * entry).round() / 100.0 + 0.0);
    let numbers: Vec<_> = vector.iter().map(digits).collect();
    format!("({})", numbers.join(", "))
}

/// The space of a part of the columns of some vectors of unit length; round-off is no part.
pub fn part(vectors: &[Vec<f64>], columns: std::ops::Range<usize>) -> RowSpace {
    let mut space = RowSpace::new(columns.len());
    for vector in vectors {
        let part = &vector[columns.clone()];
        if part.iter().any(|entry| entry.abs() > ROUND_OFF) {
            space.add(part);
        }
    }
    space
}

fn unit(width: usize, column: usize) -> Vec<f64> {
    let mut unit = vec![0.0; width];
    unit[column] = 1.0;
    unit
}

/// Entries of unit vectors below this are round-off.
const ROUND_OFF: f64 = 1.0e-9;

const NAMES: [&str; 3] = ["x", "y", "z"];

/// `e_axis x arm`.
fn turned(axis: usize, arm: &[f64; 3]) -> [f64; 3] {
    let (next, last) = ((axis + 1) % 3, (axis + 2) % 3);
    let mut result = [0.0; 3];
    result[next] = -arm[last];
    result[last] = arm[next];
    result
}
