//! Hat functions averaged over the domain of a point: generalised interpolation (GIMPM), T 2.23-2.28.
//!
//! The hat is integrated exactly for a domain of any size, so that points may outgrow half a cell; T 2.26-2.27 are the
//! case `2 l <= h`. Of a domain that sticks out of the grid the hats are integrated whole; only the functions of the
//! nodes that the grid does not have are missing, so that values no longer sum to one (docs/decisions/grid_faces.md).

use super::{Basis, MAX_NODES_PER_AXIS, SNAP, Shape1, Span};

/// Generalised interpolation material point method.
#[derive(Clone, Copy, Debug)]
pub struct Gimp;

/// Ends of a domain; one within [`SNAP`] of a node lies on it.
fn ends(x: f64, half: f64) -> (f64, f64) {
    let snap = |end: f64| {
        if (end - end.round()).abs() < SNAP {
            end.round()
        } else {
            end
        }
    };
    (snap(x - half), snap(x + half))
}

/// Integral of the hat around zero from minus infinity.
fn integrated_hat(t: f64) -> f64 {
    let t = t.clamp(-1.0, 1.0);
    if t < 0.0 {
        0.5 * (1.0 + t) * (1.0 + t)
    } else {
        1.0 - 0.5 * (1.0 - t) * (1.0 - t)
    }
}

fn hat(t: f64) -> f64 {
    (1.0 - t.abs()).max(0.0)
}

impl Basis for Gimp {
    fn order(&self) -> usize {
        1
    }

    fn span(&self, x: f64, half: f64, cells: usize) -> Span {
        let (low, high) = ends(x, half);
        let lowest = (low.max(0.0) as u32).min(cells as u32 - 1);
        let highest = (high.ceil() as u32).clamp(lowest + 1, cells as u32);
        Span {
            lowest,
            count: highest + 1 - lowest,
        }
    }

    fn evaluate(&self, span: Span, x: f64, half: f64, _cells: usize, out: &mut [Shape1]) {
        debug_assert!(span.count as usize <= MAX_NODES_PER_AXIS);
        let (low, high) = ends(x, half);
        let lowest = f64::from(span.lowest);
        if low >= lowest && high <= lowest + 1.0 {
            // Inside one cell the average of the hat is its value at the middle: no cancellation for small domains.
            let local = 0.5 * (low + high) - lowest;
            out[0] = Shape1 {
                value: 1.0 - local,
                derivative: -1.0,
            };
            out[1] = Shape1 {
                value: local,
                derivative: 1.0,
            };
            return;
        }
        let length = high - low;
        for (offset, shape) in out.iter_mut().enumerate() {
            let node = lowest + offset as f64;
            shape.value = (integrated_hat(high - node) - integrated_hat(low - node)) / length;
            shape.derivative = (hat(high - node) - hat(low - node)) / length;
        }
    }

    fn has_domains(&self) -> bool {
        true
    }

    fn evaluate_at_point(&self, span: Span, x: f64, _cells: usize, out: &mut [Shape1]) {
        for (offset, shape) in out.iter_mut().enumerate() {
            let local = x - (f64::from(span.lowest) + offset as f64);
            *shape = Shape1 {
                value: hat(local),
                derivative: if local.abs() < 1.0 { -local.signum() } else { 0.0 },
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The average by a fine midpoint rule.
    fn average(node: f64, x: f64, half: f64) -> f64 {
        let samples = 20_000;
        let sum: f64 = (0..samples)
            .map(|i| hat(x - half + 2.0 * half * (i as f64 + 0.5) / samples as f64 - node))
            .sum();
        sum / samples as f64
    }

    #[test]
    fn averages_the_hat_for_small_and_large_domains() {
        for (x, half) in [(2.3, 0.1), (2.05, 0.2), (2.5, 0.7), (2.1, 0.95), (1.9, 0.5)] {
            let span = Gimp.span(x, half, 6);
            let mut out = [Shape1::default(); MAX_NODES_PER_AXIS];
            Gimp.evaluate(span, x, half, 6, &mut out[..span.count as usize]);
            for offset in 0..span.count {
                let expected = average(f64::from(span.lowest + offset), x, half);
                assert!(
                    (out[offset as usize].value - expected).abs() < 1e-8,
                    "x {x}, half {half}"
                );
            }
        }
    }

    #[test]
    fn a_domain_that_ends_on_a_node_does_not_touch_the_next_cell() {
        assert_eq!(Gimp.span(0.125, 0.125, 4), Span { lowest: 0, count: 2 });
        assert_eq!(Gimp.span(0.875 + 1e-13, 0.125, 4), Span { lowest: 0, count: 2 });
        assert_eq!(Gimp.span(1.125 - 1e-13, 0.125, 4), Span { lowest: 1, count: 2 });
        assert_eq!(Gimp.span(1.0, 0.125, 4), Span { lowest: 0, count: 3 });
        assert_eq!(Gimp.span(3.875, 0.13, 4), Span { lowest: 3, count: 2 });
    }
}
