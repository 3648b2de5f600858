//! The space that rows of a matrix span, row by row: its rank and its null space, for matrices with few columns.

/// A row whose part outside the space is smaller than this share of it lies in it.
const DEPENDENT: f64 = 1.0e-7;

/// An orthonormal basis of the rows that were added so far.
#[derive(Clone, Debug, PartialEq)]
pub struct RowSpace {
    width: usize,
    basis: Vec<Vec<f64>>,
}

impl RowSpace {
    pub fn new(width: usize) -> Self {
        Self {
            width,
            basis: Vec::new(),
        }
    }

    /// Whether it is all of the space, so that no row can add to it.
    pub fn is_full(&self) -> bool {
        self.basis.len() == self.width
    }

    /// Number of columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Forgets all rows.
    pub fn clear(&mut self) {
        self.basis.clear();
    }

    pub fn basis(&self) -> &[Vec<f64>] {
        &self.basis
    }

    /// Takes in a row, zero in the columns that it lacks; returns whether it was independent of those before.
    pub fn add(&mut self, row: &[f64]) -> bool {
        let length = norm(row);
        if self.is_full() || length == 0.0 {
            return false;
        }
        let mut rest: Vec<f64> = row.iter().map(|entry| entry / length).collect();
        rest.resize(self.width, 0.0);
        self.project_out(&mut rest);
        if norm(&rest) <= DEPENDENT {
            return false;
        }
        // Once more, for what round-off left of the basis in a short rest.
        self.project_out(&mut rest);
        let length = norm(&rest);
        rest.iter_mut().for_each(|entry| *entry /= length);
        self.basis.push(rest);
        true
    }

    /// An orthonormal basis of all vectors that are normal to every row.
    pub fn null_space(&self) -> Vec<Vec<f64>> {
        let mut all = self.clone();
        for column in 0..self.width {
            let mut unit = vec![0.0; self.width];
            unit[column] = 1.0;
            all.add(&unit);
        }
        all.basis.split_off(self.basis.len())
    }

    /// Whether the unit vector of a column lies in the space.
    pub fn holds_unit(&self, column: usize) -> bool {
        let inside: f64 = self.basis.iter().map(|row| row[column] * row[column]).sum();
        inside.sqrt() > 1.0 - DEPENDENT
    }

    fn project_out(&self, vector: &mut [f64]) {
        for row in &self.basis {
            let along: f64 = row.iter().zip(vector.iter()).map(|(a, b)| a * b).sum();
            vector
                .iter_mut()
                .zip(row)
                .for_each(|(entry, row)| *entry -= along * row);
        }
    }
}

fn norm(vector: &[f64]) -> f64 {
    vector.iter().map(|entry| entry * entry).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dependent_rows_add_nothing() {
        let mut space = RowSpace::new(3);
        assert!(space.add(&[2.0, 0.0, 1.0]));
        assert!(space.add(&[2.0, 0.0, 1.001]));
        assert!(!space.add(&[-7.0, 0.0, 3.0]));
        assert!(!space.add(&[0.0; 3]));
        assert!(space.holds_unit(0) && space.holds_unit(2) && !space.holds_unit(1));
        let free = space.null_space();
        assert_eq!(free.len(), 1);
        assert!((free[0][1].abs() - 1.0).abs() < 1e-12);
        assert!(space.add(&[0.0, 1.0e-9, 0.0]) && space.is_full());
    }
}
