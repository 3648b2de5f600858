//! The continua by name, for everything that comes before the types of a run are fixed.

use super::Fields;
use super::classical::Classical;
use super::gradient_micropolar::GradientMicropolar;
use super::micropolar::Micropolar;

/// Which continuum a body is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ContinuumKind {
    /// Displacement only.
    Classical,
    /// Displacement and independent rotation.
    Micropolar,
    /// Displacement, independent rotation and a nonlocal damage field.
    GradientMicropolar,
}

impl ContinuumKind {
    /// Names of the unknowns of a node in their order, in two or three dimensions.
    pub fn unknowns(self, dimension: usize) -> &'static [&'static str] {
        match (self, dimension) {
            (ContinuumKind::Classical, 2) => &<Classical as Fields<2, 2>>::UNKNOWNS,
            (ContinuumKind::Classical, _) => &<Classical as Fields<3, 3>>::UNKNOWNS,
            (ContinuumKind::Micropolar, 2) => &<Micropolar as Fields<2, 3>>::UNKNOWNS,
            (ContinuumKind::Micropolar, _) => &<Micropolar as Fields<3, 6>>::UNKNOWNS,
            (ContinuumKind::GradientMicropolar, 2) => &<GradientMicropolar as Fields<2, 4>>::UNKNOWNS,
            (ContinuumKind::GradientMicropolar, _) => &<GradientMicropolar as Fields<3, 7>>::UNKNOWNS,
        }
    }

    /// Whether points rotate on their own: then there are couples, curvatures and lengths.
    pub fn has_rotations(self) -> bool {
        match self {
            ContinuumKind::Classical => false,
            ContinuumKind::Micropolar | ContinuumKind::GradientMicropolar => true,
        }
    }

    /// Whether a nonlocal damage field is among the unknowns.
    pub fn has_damage(self) -> bool {
        self == ContinuumKind::GradientMicropolar
    }
}
