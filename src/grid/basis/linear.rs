//! Linear hat functions seen by a point without extent: the standard material point method (T 2.20-2.22).

use super::{Basis, Shape1, Span};

/// Standard material point method.
#[derive(Clone, Copy, Debug)]
pub struct Linear;

impl Basis for Linear {
    fn order(&self) -> usize {
        1
    }

    fn span(&self, x: f64, _half: f64, cells: usize) -> Span {
        Span {
            lowest: (x.max(0.0) as u32).min(cells as u32 - 1),
            count: 2,
        }
    }

    fn evaluate(&self, span: Span, x: f64, _half: f64, _cells: usize, out: &mut [Shape1]) {
        let local = x - f64::from(span.lowest);
        out[0] = Shape1 {
            value: 1.0 - local,
            derivative: -1.0,
        };
        out[1] = Shape1 {
            value: local,
            derivative: 1.0,
        };
    }

    fn has_domains(&self) -> bool {
        false
    }
}
