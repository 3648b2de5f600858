//! Snapshots of the material points, read from `points.vtkhdf`.

use std::fmt::Display;
use std::path::{Path, PathBuf};

use super::axis::is_drawn;
use super::error::ReportError;

/// The file of snapshots, open.
#[derive(Debug)]
pub struct Snapshots {
    file: hdf5::File,
    path: PathBuf,
    /// Material points.
    pub points: usize,
    /// Time of each snapshot: stages done plus the share of the current one.
    pub times: Vec<f64>,
    /// First row of each snapshot in the tables.
    offsets: Vec<usize>,
}

impl Snapshots {
    /// Opens the file and looks at the shapes of all its tables, so that every snapshot can be read.
    ///
    /// # Errors
    /// A file that is damaged; names it.
    pub fn open(path: &Path) -> Result<Self, ReportError> {
        let snapshots = Self::read(path).map_err(|error| damaged(path, &error))?;
        match snapshots.fault() {
            Ok(None) => Ok(snapshots),
            Ok(Some(fault)) => Err(damaged(path, &fault)),
            Err(error) => Err(damaged(path, &error)),
        }
    }

    fn read(path: &Path) -> hdf5::Result<Self> {
        let file = hdf5::File::open(path)?;
        let count = file.group("VTKHDF/Steps")?.attr("NSteps")?.read_scalar::<i64>()?.max(0) as usize;
        let mut times = file.dataset("VTKHDF/Steps/Values")?.read_raw::<f64>()?;
        let offsets = file.dataset("VTKHDF/Steps/PointOffsets")?.read_raw::<i64>()?;
        times.truncate(count.min(offsets.len()));
        let points = file.dataset("VTKHDF/NumberOfPoints")?.read_raw::<i64>()?;
        Ok(Snapshots {
            path: path.to_path_buf(),
            points: points.first().map_or(0, |&points| points.max(0) as usize),
            offsets: offsets
                .iter()
                .take(times.len())
                .map(|&offset| offset.max(0) as usize)
                .collect(),
            times,
            file,
        })
    }

    /// What keeps a snapshot from being read or drawn.
    fn fault(&self) -> hdf5::Result<Option<String>> {
        let Some(&last) = self.offsets.iter().max() else {
            return Ok(None);
        };
        if let Some(time) = self.times.iter().find(|time| !is_drawn(**time)) {
            return Ok(Some(format!("{time} is no time of a snapshot")));
        }
        let rows = last.saturating_add(self.points);
        let data = self.file.group("VTKHDF/PointData")?.datasets()?;
        let positions = self.file.dataset("VTKHDF/Points")?;
        let fields = data.iter().map(|table| (table, false));
        for (table, vectors) in std::iter::once((&positions, true)).chain(fields) {
            let shape = table.shape();
            let fits = match shape.as_slice() {
                [length] => !vectors && *length >= rows,
                [length, width] => *length >= rows && (*width == 3 || !vectors),
                _ => false,
            };
            if !fits {
                let name = table.name();
                return Ok(Some(format!(
                    "the table {name} is of shape {shape:?}, and has {rows} rows in a whole file"
                )));
            }
        }
        Ok(None)
    }

    /// The error of a place or a length that is no number, or far too large for one.
    pub fn odd(&self, snapshot: usize, number: f64) -> ReportError {
        damaged(
            &self.path,
            &format!("{number} m among the points of snapshot {snapshot} cannot be drawn"),
        )
    }

    /// Whether the points have a field.
    pub fn has(&self, field: &str) -> bool {
        self.file.link_exists(&format!("VTKHDF/PointData/{field}"))
    }

    /// Positions [m] of a snapshot.
    ///
    /// # Errors
    /// A file that is damaged.
    pub fn positions(&self, snapshot: usize) -> Result<Vec<[f64; 3]>, ReportError> {
        self.vectors("VTKHDF/Points", snapshot)
    }

    /// A field with three components.
    ///
    /// # Errors
    /// A file that is damaged, or has no such field.
    pub fn vector(&self, field: &str, snapshot: usize) -> Result<Vec<[f64; 3]>, ReportError> {
        self.vectors(&format!("VTKHDF/PointData/{field}"), snapshot)
    }

    /// A field with one component.
    ///
    /// # Errors
    /// A file that is damaged, or has no such field.
    pub fn scalar(&self, field: &str, snapshot: usize) -> Result<Vec<f64>, ReportError> {
        let begin = self.offsets[snapshot];
        let read = || -> hdf5::Result<Vec<f64>> {
            let dataset = self.file.dataset(&format!("VTKHDF/PointData/{field}"))?;
            if dataset.ndim() != 1 {
                return Err(hdf5::Error::Internal(format!(
                    "the field {field} has more than one column"
                )));
            }
            Ok(dataset.read_slice_1d::<f64, _>(begin..begin + self.points)?.to_vec())
        };
        read().map_err(|error| damaged(&self.path, &error))
    }

    fn vectors(&self, table: &str, snapshot: usize) -> Result<Vec<[f64; 3]>, ReportError> {
        let begin = self.offsets[snapshot];
        let read = || -> hdf5::Result<Vec<[f64; 3]>> {
            let dataset = self.file.dataset(table)?;
            if dataset.shape().get(1) != Some(&3) {
                return Err(hdf5::Error::Internal(format!("the table {table} has no three columns")));
            }
            let rows = dataset.read_slice_2d::<f64, _>((begin..begin + self.points, ..))?;
            Ok(rows.rows().into_iter().map(|row| [row[0], row[1], row[2]]).collect())
        };
        read().map_err(|error| damaged(&self.path, &error))
    }

    /// At most `most` snapshots, evenly chosen, the first and the last among them.
    pub fn chosen(&self, most: usize) -> Vec<usize> {
        let count = self.times.len();
        if count <= most {
            return (0..count).collect();
        }
        (0..most)
            .map(|k| (k * (count - 1) + (most - 1) / 2) / (most - 1))
            .collect()
    }
}

fn damaged(path: &Path, error: &dyn Display) -> ReportError {
    ReportError::File(format!("{}: cannot be read: {error}", path.display()))
}
