//! What acts on the body: conditions on nodes and points, loads on points and surfaces, and how they grow with time.

pub mod dirichlet;
pub mod load;
pub mod pressure;
pub mod weak;

/// A moment of the analysis: how far a stage has come.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Time {
    pub stage: usize,
    /// Share of the stage that is done, 0 to 1.
    pub fraction: f64,
}

impl Time {
    /// Factor of something that ramps linearly over a stage and then holds.
    pub fn ramp(&self, stage: usize) -> f64 {
        match self.stage.cmp(&stage) {
            std::cmp::Ordering::Less => 0.0,
            std::cmp::Ordering::Equal => self.fraction,
            std::cmp::Ordering::Greater => 1.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ramp_grows_over_its_stage_and_holds() {
        let at = |stage, fraction| Time { stage, fraction };
        assert_eq!(at(0, 0.5).ramp(1), 0.0);
        assert_eq!(at(1, 0.5).ramp(1), 0.5);
        assert_eq!(at(2, 0.1).ramp(1), 1.0);
    }
}
