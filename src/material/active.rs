//! The components that a scene can excite, as lists of index pairs: one set of formulas serves them all.

/// Index pair of a tensor component, from 0.
pub type Pair = (usize, usize);

/// Lists of components. Local problems are built over them in this order.
pub trait ActiveSet {
    /// Components of the elastic stretch that can differ from the identity.
    const STRETCH: &'static [Pair];
    /// Components of the elastic wryness that can differ from zero.
    const WRYNESS: &'static [Pair];
    /// Independent components of a symmetric tensor.
    const SYMMETRIC: &'static [Pair];
    /// Components of the total stretch that a motion can change, and of the stress that does work on them.
    const DRIVEN_STRETCH: &'static [Pair];
    /// Components of the total wryness that a motion can change, and of the couple-stress that does work on them.
    const DRIVEN_WRYNESS: &'static [Pair];
}

/// Plane strain. The elastic stretch along axis 3 and the wryness `13`, `23` move by plastic flow alone.
pub struct PlaneSet;

impl ActiveSet for PlaneSet {
    const STRETCH: &'static [Pair] = &[(0, 0), (0, 1), (1, 0), (1, 1), (2, 2)];
    const WRYNESS: &'static [Pair] = &[(2, 0), (2, 1), (0, 2), (1, 2)];
    const SYMMETRIC: &'static [Pair] = &[(0, 0), (1, 1), (2, 2), (0, 1)];
    const DRIVEN_STRETCH: &'static [Pair] = &[(0, 0), (0, 1), (1, 0), (1, 1)];
    const DRIVEN_WRYNESS: &'static [Pair] = &[(2, 0), (2, 1)];
}

/// All components.
pub struct SpaceSet;

const ALL: &[Pair] = &[(0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2), (2, 0), (2, 1), (2, 2)];

impl ActiveSet for SpaceSet {
    const STRETCH: &'static [Pair] = ALL;
    const WRYNESS: &'static [Pair] = ALL;
    const SYMMETRIC: &'static [Pair] = &[(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];
    const DRIVEN_STRETCH: &'static [Pair] = ALL;
    const DRIVEN_WRYNESS: &'static [Pair] = ALL;
}
