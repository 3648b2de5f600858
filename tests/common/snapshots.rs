//! `points.vtkhdf`, read back with HDF5.

use hdf5::File;
use std::path::Path;

/// All snapshots of a run.
pub struct Snapshots {
    file: File,
    pub times: Vec<f64>,
    pub points: usize,
}

impl Snapshots {
    /// # Panics
    /// When the file cannot be read or its tables do not fit each other.
    pub fn read(path: &Path) -> Self {
        let file = File::open(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let numbers = |name: &str| file.dataset(name).and_then(|data| data.read_raw()).expect(name);
        let times: Vec<f64> = numbers("VTKHDF/Steps/Values");
        let steps: i64 = file
            .group("VTKHDF/Steps")
            .and_then(|group| group.attr("NSteps"))
            .and_then(|attribute| attribute.read_scalar())
            .expect("NSteps");
        assert_eq!(steps as usize, times.len());
        let rows = file.dataset("VTKHDF/Points").expect("VTKHDF/Points").shape()[0];
        let points = rows / times.len();
        assert_eq!(points * times.len(), rows, "every snapshot shows all points");
        Snapshots { file, times, points }
    }

    fn rows<const M: usize>(&self, name: &str, snapshot: usize) -> Vec<[f64; M]> {
        let data: Vec<f64> = self
            .file
            .dataset(name)
            .and_then(|data| data.read_raw())
            .unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(data.len(), M * self.points * self.times.len(), "{name}");
        let rows = data.chunks_exact(M).skip(snapshot * self.points).take(self.points);
        rows.map(|row| std::array::from_fn(|k| row[k])).collect()
    }

    /// Positions of the points at a snapshot, in the order of their numbers.
    pub fn positions(&self, snapshot: usize) -> Vec<[f64; 3]> {
        self.rows("VTKHDF/Points", snapshot)
    }

    /// A vector, tensor (nine components) or other field at a snapshot.
    pub fn field<const M: usize>(&self, name: &str, snapshot: usize) -> Vec<[f64; M]> {
        self.rows(&format!("VTKHDF/PointData/{name}"), snapshot)
    }

    /// A scalar field at a snapshot.
    pub fn scalar(&self, name: &str, snapshot: usize) -> Vec<f64> {
        self.field::<1>(name, snapshot)
            .into_iter()
            .map(|[value]| value)
            .collect()
    }
}
