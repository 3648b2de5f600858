//! What a scene gets wrong although each of its keys is right: looked at once points and grid have met, before anything
//! is solved.
//!
//! What could only go wrong is an error; what may be meant is a warning.

mod contradictions;
mod idle;
pub mod locking;
mod motions;
mod overlaps;
mod pressed;
mod resultants;
mod row_space;
mod space;
mod supports;

use crate::assembly::model::{Model, Survey};
use crate::config::Source;
use crate::continuum::Fields;
use crate::parallel::World;
use crate::problem::Problem;
use crate::scene::Scene;

/// A scene with its points on the grid.
pub struct Inspection<'a, C: Fields<D, N>, const D: usize, const N: usize> {
    pub world: &'a World,
    pub scene: &'a Scene,
    pub source: &'a Source,
    pub model: &'a Model<C, D, N>,
    pub survey: &'a Survey<D>,
}

/// What was found; the same on every rank.
#[derive(Debug, Default)]
pub struct Findings {
    pub problems: Vec<Problem>,
    pub warnings: Vec<String>,
}

impl Findings {
    fn add(&mut self, other: Findings) {
        self.problems.extend(other.problems);
        self.warnings.extend(other.warnings);
    }
}

/// Collective. Inspects a scene. Where it is known to be wrong, what holds the bodies is not asked: supports may be what
/// is wrong.
pub fn inspect<C: Fields<D, N>, const D: usize, const N: usize>(
    inspection: &Inspection<'_, C, D, N>,
    known_to_be_wrong: bool,
) -> Findings {
    let mut findings = Findings::default();
    findings.add(contradictions::contradictions(inspection));
    findings.add(overlaps::overlaps(inspection));
    if !known_to_be_wrong {
        findings.add(supports::unsupported(inspection));
    }
    findings.warnings.extend(pressed::hidden_faces(inspection));
    findings.warnings.extend(idle::idle_entries(inspection));
    findings.warnings.extend(locking::locking(inspection));
    findings
}
