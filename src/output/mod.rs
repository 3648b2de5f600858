//! What a run leaves behind: the files of its result folder and the lines it prints.
//!
//! Nothing here knows grids, laws or solvers: a run hands over plain numbers. The files with tables ([`history`],
//! [`convergence`], [`summary`]) are written by one rank, whose caller makes the outcome common; [`vtkhdf`] is written
//! by all ranks together and returns the same outcome on each.

pub mod checkpoint;
pub mod convergence;
pub mod folder;
pub mod history;
pub mod lock;
pub mod process;
pub mod progress;
pub mod summary;
mod table;
mod terminal;
pub mod vtkhdf;

pub use table::Extent;

use crate::error::Error;
use crate::parallel::World;

/// Material points of one rank, in any order.
///
/// Over all ranks, `ids` holds each of `0..total` once. The lists have one entry per point of this rank.
#[derive(Clone, Copy, Debug)]
pub struct PointFields<'a> {
    /// Global numbers of the points.
    pub ids: &'a [u64],
    /// Number of points on all ranks.
    pub total: u64,
    /// Current positions [m]; the third component is zero in plane strain.
    pub position: &'a [[f64; 3]],
    /// What else is known at the points; the same names in the same order on every rank and in every snapshot.
    pub fields: &'a [PointField],
}

/// A named quantity at the points of one rank.
#[derive(Clone, Debug, PartialEq)]
pub struct PointField {
    /// Name in files, such as `couple_stress`.
    pub name: &'static str,
    /// One entry per point of the rank.
    pub values: PointValues,
}

/// Values at points.
#[derive(Clone, Debug, PartialEq)]
pub enum PointValues {
    /// Whole numbers, such as a rank.
    Integer(Vec<i32>),
    /// One number.
    Scalar(Vec<f64>),
    /// Components x, y, z.
    Vector(Vec<[f64; 3]>),
    /// Components xx, xy, xz, yx, yy, yz, zx, zy, zz; not symmetric in general.
    Tensor(Vec<[f64; 9]>),
}

impl PointValues {
    /// Number of points.
    pub fn len(&self) -> usize {
        match self {
            PointValues::Integer(values) => values.len(),
            PointValues::Scalar(values) => values.len(),
            PointValues::Vector(values) => values.len(),
            PointValues::Tensor(values) => values.len(),
        }
    }

    /// True without points.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Size of one entry [byte].
    pub fn entry_size(&self) -> u64 {
        match self {
            PointValues::Integer(_) => 4,
            PointValues::Scalar(_) => 8,
            PointValues::Vector(_) => 24,
            PointValues::Tensor(_) => 72,
        }
    }
}

/// Makes an outcome common: success if every rank succeeded, otherwise the message of the lowest rank that failed, on
/// every rank. Collective.
pub fn agree<T>(world: &World, outcome: Result<T, String>) -> Result<T, Error> {
    let Some(first) = world.first_where(outcome.is_err()) else {
        return outcome.map_err(Error::System);
    };
    let own = outcome.err().unwrap_or_default();
    Err(Error::System(world.text_from(first, &own)))
}
