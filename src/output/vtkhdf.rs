//! Snapshots of the material points as a time series in one VTKHDF file.
//!
//! Layout: the `UnstructuredGrid` of the VTKHDF specification 2.0 with a `Steps` group (VTK 9.3, ParaView 5.12 or newer),
//! one vertex cell per point. Rows follow the global number of the points, however they are spread over the ranks, so
//! the file does not depend on the number of ranks (but for the field `rank`). What never changes (connectivity, offsets
//! and types of the cells) is stored once and shared by all steps; everything else grows by one block of rows a step.
//!
//! All ranks write together through HDF5 over MPI. The file is opened and closed for each snapshot: between snapshots it
//! is complete, and a run that is killed there leaves a readable file. The step count is raised last, after the rows of
//! the step are in place.

use std::fs;
use std::io::ErrorKind;
use std::ops::Range;
use std::path::{Path, PathBuf};

use hdf5::plist::dataset_create::FillTime;
use hdf5::types::FixedAscii;
use hdf5::{Dataset, File, Group, H5Type};
use mpi::traits::{AsRaw, Equivalence};

use super::folder::{claim_space, put_aside};
use super::{PointFields, PointValues, agree};
use crate::error::Error;
use crate::parallel::World;

/// Most rows of a chunk: a chunk must stay below 4 GiB, and reading a few points should not touch much more.
const MAX_CHUNK_ROWS: u64 = 1 << 20;
/// Rows of a chunk in the tables of `Steps`.
const STEP_CHUNK: usize = 64;
/// Room for the bookkeeping of the file that a snapshot may add, on top of its rows [byte].
const BOOKKEEPING: u64 = 1 << 18;
/// `VTK_VERTEX`.
const VERTEX: u8 = 1;

/// Writer of `points.vtkhdf`; one per run, on every rank.
#[derive(Debug)]
pub struct Snapshots {
    path: PathBuf,
    written: usize,
}

impl Snapshots {
    /// A series that starts with the next snapshot; a file of this name is replaced then.
    pub fn new(path: impl Into<PathBuf>) -> Self {
        Snapshots {
            path: path.into(),
            written: 0,
        }
    }

    /// Goes on with the series of an earlier run: its first `written` snapshots stay, later ones are dropped. Collective.
    ///
    /// Where that cannot be done, because the file is gone or a write was cut short, a new series begins with the next
    /// snapshot; the second answer says why, and what became of the file. It is the same on every rank.
    ///
    /// # Errors
    /// The same on every rank: a file that cannot be used cannot be put aside either.
    pub fn resume(world: &World, path: PathBuf, written: usize, total: u64) -> Result<(Self, Option<String>), Error> {
        let gap = if world.is_root() {
            begin_or_cut(&path, written, total)
        } else {
            Ok(None)
        };
        let gap = agree(world, gap)?.unwrap_or_default();
        match world.broadcast_text(&gap) {
            gap if gap.is_empty() => Ok((Snapshots { path, written }, None)),
            gap => Ok((Snapshots::new(path), Some(gap))),
        }
    }

    /// Returns when all snapshots are on disk, so that they outlive a crash of the machine. Not collective.
    pub fn secure(&self) -> Result<(), Error> {
        let synchronise = || fs::File::open(&self.path)?.sync_data();
        match synchronise() {
            Err(error) if self.written > 0 => {
                Err(Error::System(format!("cannot write {}: {error}", self.path.display())))
            }
            _ => Ok(()),
        }
    }

    /// Tells that the file has another name now.
    pub fn renamed(&mut self, path: PathBuf) {
        self.path = path;
    }

    /// Number of snapshots in the file.
    pub fn written(&self) -> usize {
        self.written
    }

    /// Adds a snapshot at `time` (any measure that grows, such as stage number plus load factor). The field `rank` is
    /// added to those given. Collective.
    ///
    /// # Errors
    /// The same on every rank: the file cannot be written or the disk is full, or the numbers of the points are not
    /// `0..total`. Earlier snapshots stay as they are, and the failed one may be tried again.
    pub fn append(&mut self, world: &World, time: f64, points: &PointFields<'_>) -> Result<(), Error> {
        let slab = agree(world, check_lengths(points)).and_then(|()| Slab::new(world, points.ids, points.total))?;
        let reserved = if world.is_root() { self.reserve(points) } else { Ok(()) };
        agree(world, reserved)?;
        let outcome = self.write(world, time, points, &slab);
        match outcome {
            Ok(()) => self.written += 1,
            // Half a first snapshot is of no use, and the next try starts afresh anyway.
            Err(_) if self.written == 0 && world.is_root() => drop(fs::remove_file(&self.path)),
            Err(_) => {}
        }
        outcome
    }

    /// Claims the space on disk for one more snapshot, so that a full disk is found before the file is touched.
    fn reserve(&self, points: &PointFields<'_>) -> Result<(), String> {
        let fields: u64 = points.fields.iter().map(|field| field.values.entry_size()).sum();
        let cells = if self.written == 0 { 17 } else { 0 };
        let bytes = points.total * (24 + 4 + fields + cells) + BOOKKEEPING;
        let claim = || -> std::io::Result<()> {
            let file = fs::OpenOptions::new()
                .write(true)
                .create(self.written == 0)
                .truncate(false)
                .open(&self.path)?;
            let end = file.metadata()?.len();
            claim_space(&file, end, bytes)
        };
        claim().map_err(|error| format!("cannot write {}: {error}", self.path.display()))
    }

    fn write(&self, world: &World, time: f64, points: &PointFields<'_>, slab: &Slab) -> Result<(), Error> {
        let file = self.collective(world, open(world, &self.path, self.written))?;
        if self.written == 0 {
            self.collective(world, create_layout(&file, points))?;
        }
        let mut outcome = self.add_rows(world, &file, time, points, slab);
        if outcome.is_err() {
            // The rows of this snapshot go, and with them the space they may not have had.
            let restored = resize_all(&file, points, self.written);
            outcome = outcome.and(self.collective(world, restored));
        }
        self.collective(world, file.close())?;
        outcome
    }

    fn add_rows(
        &self,
        world: &World,
        file: &File,
        time: f64,
        points: &PointFields<'_>,
        slab: &Slab,
    ) -> Result<(), Error> {
        self.collective(world, resize_all(file, points, self.written + 1))?;
        // From here each rank writes on its own, and one that fails still takes part in the exchanges.
        let mut outcome = Ok(());
        let begin = self.written * points.total as usize + slab.rows.start;
        let mut put = |name: &str, values: PointValues| {
            let rows = begin..begin + slab.rows.len();
            outcome = std::mem::replace(&mut outcome, Ok(())).and_then(|()| write_values(file, name, &values, rows));
        };
        put(
            "VTKHDF/Points",
            PointValues::Vector(slab.collect_rows(world, points.position)),
        );
        for field in points.fields {
            put(&data_path(field.name), slab.collect_values(world, &field.values));
        }
        let rank = vec![world.rank() as i32; points.ids.len()];
        put(&data_path("rank"), PointValues::Integer(slab.collect(world, &rank, 1)));
        if self.written == 0 {
            outcome = outcome.and_then(|()| write_cells(file, slab.rows.clone(), points.total));
        }
        if world.is_root() {
            outcome = outcome.and_then(|()| write_step(file, self.written, time, points));
        }
        self.collective(world, outcome)?;
        let count = self.written as i64 + 1;
        self.collective(world, set_step_count(file, count))
    }

    /// The common outcome of a call of HDF5, with the name of the file.
    fn collective<T>(&self, world: &World, outcome: hdf5::Result<T>) -> Result<T, Error> {
        agree(
            world,
            outcome.map_err(|error| format!("cannot write {}: {error}", self.path.display())),
        )
    }
}

/// Drops all but the first snapshots of a file; where that cannot be done the file is put aside, and the answer says why.
fn begin_or_cut(path: &Path, written: usize, total: u64) -> Result<Option<String>, String> {
    if written == 0 {
        return Ok(None);
    }
    let shown = path.display();
    if fs::symlink_metadata(path).is_err_and(|error| error.kind() == ErrorKind::NotFound) {
        return Ok(Some(format!("{shown} is gone; a new series of snapshots begins here")));
    }
    let Err(reason) = cut_back(path, written, total) else {
        return Ok(None);
    };
    let aside = put_aside(path).map_err(|error| format!("cannot rename {shown}, which is damaged: {error}"))?;
    let left = aside.map_or("gone".to_owned(), |aside| aside.display().to_string());
    Ok(Some(format!(
        "{shown} cannot be gone on with: {reason}; a new series of snapshots begins here, and what is left of the old one is \
         {left}"
    )))
}

/// Drops all but the first snapshots of a file. It is opened by this process alone, and to be written once it is known
/// to be whole.
fn cut_back(path: &Path, written: usize, total: u64) -> hdf5::Result<()> {
    tables_of_whole(&File::open(path)?, written, total)?;
    let file = File::open_rw(path)?;
    let tables = tables_of_whole(&file, written, total)?;
    set_step_count(&file, written as i64)?;
    let rows = written * total as usize;
    tables.iter().try_for_each(|table| resize(table, rows))?;
    let steps = file.group("VTKHDF/Steps")?;
    let steps = [steps.datasets()?, steps.group("PointDataOffsets")?.datasets()?].concat();
    steps.iter().try_for_each(|table| resize(table, written))?;
    file.close()
}

/// Tables with a row for each point of each snapshot, if the file holds as many as are expected.
fn tables_of_whole(file: &File, written: usize, total: u64) -> hdf5::Result<Vec<Dataset>> {
    let root = file.group("VTKHDF")?;
    let count: i64 = root.group("Steps")?.attr("NSteps")?.read_scalar()?;
    let points = root.dataset("NumberOfPoints")?.read_raw::<i64>()?;
    let rows = written * total as usize;
    let data = root.group("PointData")?;
    let tables = [vec![root.dataset("Points")?], data.datasets()?].concat();
    let whole = tables
        .iter()
        .all(|table| table.shape().first().is_some_and(|&length| length >= rows));
    if count < written as i64 || points != [total as i64] || !whole {
        let what = format!("it holds {count} snapshots, and {written} of {total} points were expected");
        return Err(hdf5::Error::Internal(what));
    }
    Ok(tables)
}

fn check_lengths(points: &PointFields<'_>) -> Result<(), String> {
    let count = points.ids.len();
    if points.position.len() != count {
        return Err(format!("{} positions for {count} points", points.position.len()));
    }
    match points.fields.iter().find(|field| field.values.len() != count) {
        Some(field) => Err(format!(
            "{} values of {} for {count} points",
            field.values.len(),
            field.name
        )),
        None => Ok(()),
    }
}

/// The rows that this rank writes, and where their values come from.
struct Slab {
    rows: Range<usize>,
    /// Indices of own points, by the rank that writes them.
    outgoing: Vec<Vec<usize>>,
    /// Rank and place in its message, for each row of the slab.
    source: Vec<(usize, usize)>,
}

impl Slab {
    /// Cuts the rows into equal contiguous ranges, one per rank. Collective.
    fn new(world: &World, ids: &[u64], total: u64) -> Result<Self, Error> {
        let in_range = ids.iter().find(|&&id| id >= total);
        agree(
            world,
            in_range.map_or(Ok(()), |id| Err(format!("point number {id} of {total} points"))),
        )?;
        let size = world.size() as u64;
        let mut outgoing = vec![Vec::new(); world.size()];
        for (index, &id) in ids.iter().enumerate() {
            outgoing[slab_of(id, total, size)].push(index);
        }
        let rank = world.rank() as u64;
        let rows = slab_start(rank, total, size)..slab_start(rank + 1, total, size);
        let numbers: Vec<Vec<u64>> = outgoing
            .iter()
            .map(|list| list.iter().map(|&i| ids[i]).collect())
            .collect();
        let source = agree(world, sources(&world.exchange(&numbers), rows.clone()))?;
        Ok(Slab { rows, outgoing, source })
    }

    /// Numbers of the rows of this slab from the points of all ranks, `components` each. Collective.
    fn collect<T: Equivalence + Copy + Default>(&self, world: &World, values: &[T], components: usize) -> Vec<T> {
        let of = |index: usize| &values[index * components..(index + 1) * components];
        let messages: Vec<Vec<T>> = self
            .outgoing
            .iter()
            .map(|list| list.iter().flat_map(|&index| of(index)).copied().collect())
            .collect();
        let received = world.exchange(&messages);
        let row = |&(rank, place): &(usize, usize)| &received[rank][place * components..(place + 1) * components];
        self.source.iter().flat_map(row).copied().collect()
    }

    fn collect_rows<const C: usize>(&self, world: &World, values: &[[f64; C]]) -> Vec<[f64; C]> {
        let numbers = self.collect(world, values.as_flattened(), C);
        numbers
            .chunks_exact(C)
            .map(|row| std::array::from_fn(|component| row[component]))
            .collect()
    }

    fn collect_values(&self, world: &World, values: &PointValues) -> PointValues {
        match values {
            PointValues::Integer(values) => PointValues::Integer(self.collect(world, values, 1)),
            PointValues::Scalar(values) => PointValues::Scalar(self.collect(world, values, 1)),
            PointValues::Vector(values) => PointValues::Vector(self.collect_rows(world, values)),
            PointValues::Tensor(values) => PointValues::Tensor(self.collect_rows(world, values)),
        }
    }
}

/// First row of a rank's slab.
fn slab_start(rank: u64, total: u64, size: u64) -> usize {
    (rank * total / size) as usize
}

/// The rank whose slab holds a row: the last one that starts at it or before.
fn slab_of(row: u64, total: u64, size: u64) -> usize {
    (((row + 1) * size - 1) / total) as usize
}

/// Where the row of each number arrived, checking that each of `rows` came once.
fn sources(received: &[Vec<u64>], rows: Range<usize>) -> Result<Vec<(usize, usize)>, String> {
    let mut source = vec![None; rows.len()];
    for (rank, numbers) in received.iter().enumerate() {
        for (place, &number) in numbers.iter().enumerate() {
            if source[number as usize - rows.start].replace((rank, place)).is_some() {
                return Err(format!("point number {number} occurs twice"));
            }
        }
    }
    let missing = source.iter().position(Option::is_none);
    missing.map_or(Ok(()), |row| {
        Err(format!("point number {} is missing", rows.start + row))
    })?;
    Ok(source.into_iter().flatten().collect())
}

fn data_path(field: &str) -> String {
    format!("VTKHDF/PointData/{field}")
}

fn open(world: &World, path: &Path, written: usize) -> hdf5::Result<File> {
    let mut options = File::with_options();
    options.with_fapl(|access| access.mpio(world.communicator().as_raw(), None));
    if written == 0 {
        options.create(path)
    } else {
        options.open_rw(path)
    }
}

/// Groups and empty tables of a new file. Collective.
fn create_layout(file: &File, points: &PointFields<'_>) -> hdf5::Result<()> {
    let total = points.total as usize;
    let chunk = chunk_rows(points.total);
    let root = file.create_group("VTKHDF")?;
    root.new_attr::<i64>()
        .shape(2)
        .create("Version")?
        .write_raw(&[2i64, 0])?;
    let kind = FixedAscii::<16>::from_ascii("UnstructuredGrid").expect("sixteen letters");
    root.new_attr::<FixedAscii<16>>().create("Type")?.write_scalar(&kind)?;
    for name in ["NumberOfPoints", "NumberOfCells", "NumberOfConnectivityIds"] {
        root.new_dataset::<i64>().shape(1).create(name)?;
    }
    root.new_dataset::<i64>().shape(total).create("Connectivity")?;
    root.new_dataset::<i64>().shape(total + 1).create("Offsets")?;
    root.new_dataset::<u8>().shape(total).create("Types")?;
    root.create_group("CellData")?;
    root.create_group("FieldData")?;
    create_table::<f64>(&root, "Points", 3, chunk)?;
    let data = root.create_group("PointData")?;
    for field in points.fields {
        match field.values {
            PointValues::Integer(_) => create_table::<i32>(&data, field.name, 1, chunk)?,
            PointValues::Scalar(_) => create_table::<f64>(&data, field.name, 1, chunk)?,
            PointValues::Vector(_) => create_table::<f64>(&data, field.name, 3, chunk)?,
            PointValues::Tensor(_) => create_table::<f64>(&data, field.name, 9, chunk)?,
        }
    }
    create_table::<i32>(&data, "rank", 1, chunk)?;
    create_steps(&root, points)
}

fn create_steps(root: &Group, points: &PointFields<'_>) -> hdf5::Result<()> {
    let steps = root.create_group("Steps")?;
    steps.new_attr::<i64>().create("NSteps")?.write_scalar(&0i64)?;
    create_table::<f64>(&steps, "Values", 1, STEP_CHUNK)?;
    for name in ["PartOffsets", "NumberOfParts", "PointOffsets"] {
        create_table::<i64>(&steps, name, 1, STEP_CHUNK)?;
    }
    for name in ["CellOffsets", "ConnectivityIdOffsets"] {
        let builder = steps
            .new_dataset::<i64>()
            .chunk((STEP_CHUNK, 1))
            .fill_time(FillTime::Never);
        builder.shape((0.., 1)).create(name)?;
    }
    let offsets = steps.create_group("PointDataOffsets")?;
    for name in field_names(points) {
        create_table::<i64>(&offsets, name, 1, STEP_CHUNK)?;
    }
    Ok(())
}

/// A table without rows that can grow. Nothing is filled in: every row is written before it counts.
fn create_table<T: H5Type>(group: &Group, name: &str, components: usize, chunk: usize) -> hdf5::Result<()> {
    let builder = group.new_dataset::<T>().fill_time(FillTime::Never);
    if components == 1 {
        builder.chunk(chunk).shape(0..).create(name)?;
    } else {
        builder
            .chunk((chunk, components))
            .shape((0.., components))
            .create(name)?;
    }
    Ok(())
}

/// Rows of a chunk: all points of a snapshot, or an equal part of them.
fn chunk_rows(total: u64) -> usize {
    let parts = total.div_ceil(MAX_CHUNK_ROWS).max(1);
    total.div_ceil(parts).max(1) as usize
}

/// Names under `PointData`.
fn field_names<'a>(points: &PointFields<'a>) -> impl Iterator<Item = &'a str> {
    points.fields.iter().map(|field| field.name).chain(["rank"])
}

/// Gives the growing tables the length of `steps` snapshots. Collective.
fn resize_all(file: &File, points: &PointFields<'_>, steps: usize) -> hdf5::Result<()> {
    let rows = steps * points.total as usize;
    resize(&file.dataset("VTKHDF/Points")?, rows)?;
    for name in field_names(points) {
        resize(&file.dataset(&data_path(name))?, rows)?;
    }
    for name in STEP_TABLES {
        resize(&file.dataset(&format!("VTKHDF/Steps/{name}"))?, steps)?;
    }
    for name in field_names(points) {
        resize(&file.dataset(&format!("VTKHDF/Steps/PointDataOffsets/{name}"))?, steps)?;
    }
    Ok(())
}

/// One row per step each.
const STEP_TABLES: [&str; 6] = [
    "Values",
    "PartOffsets",
    "NumberOfParts",
    "PointOffsets",
    "CellOffsets",
    "ConnectivityIdOffsets",
];

fn resize(dataset: &Dataset, rows: usize) -> hdf5::Result<()> {
    match dataset.shape()[..] {
        [_] => dataset.resize(rows),
        [_, components] => dataset.resize((rows, components)),
        _ => Err(hdf5::Error::Internal(format!(
            "{} is not a table of points",
            dataset.name()
        ))),
    }
}

/// Writes this rank's rows of a table. Not collective.
fn write_values(file: &File, path: &str, values: &PointValues, rows: Range<usize>) -> hdf5::Result<()> {
    let dataset = file.dataset(path)?;
    match values {
        PointValues::Integer(values) => dataset.write_slice::<_, i32, _, _>(&values[..], rows),
        PointValues::Scalar(values) => dataset.write_slice::<_, f64, _, _>(&values[..], rows),
        PointValues::Vector(values) => dataset.write_slice::<_, f64, _, _>(&values[..], (rows, ..)),
        PointValues::Tensor(values) => dataset.write_slice::<_, f64, _, _>(&values[..], (rows, ..)),
    }
}

/// The cells: point i is cell i. Each rank writes those of its rows, the first also the counts. Not collective.
fn write_cells(file: &File, rows: Range<usize>, total: u64) -> hdf5::Result<()> {
    let root = file.group("VTKHDF")?;
    let numbers: Vec<i64> = rows.clone().map(|row| row as i64).collect();
    root.dataset("Connectivity")?
        .write_slice::<_, i64, _, _>(&numbers[..], rows.clone())?;
    root.dataset("Types")?
        .write_slice::<_, u8, _, _>(&vec![VERTEX; rows.len()][..], rows.clone())?;
    let offsets: Vec<i64> = numbers.iter().map(|number| number + 1).collect();
    root.dataset("Offsets")?
        .write_slice::<_, i64, _, _>(&offsets[..], rows.start + 1..rows.end + 1)?;
    if rows.start == 0 {
        root.dataset("Offsets")?.write_slice::<_, i64, _, _>(&[0][..], 0..1)?;
        for name in ["NumberOfPoints", "NumberOfCells", "NumberOfConnectivityIds"] {
            root.dataset(name)?.write_raw(&[total as i64])?;
        }
    }
    Ok(())
}

/// The row of a step in the tables of `Steps`. Not collective.
fn write_step(file: &File, step: usize, time: f64, points: &PointFields<'_>) -> hdf5::Result<()> {
    let steps = file.group("VTKHDF/Steps")?;
    let row = step..step + 1;
    let begin = (step as u64 * points.total) as i64;
    steps
        .dataset("Values")?
        .write_slice::<_, f64, _, _>(&[time][..], row.clone())?;
    // One part, the first, for all steps: this is what shares the cells.
    for (name, value) in [("PartOffsets", 0), ("NumberOfParts", 1), ("PointOffsets", begin)] {
        steps
            .dataset(name)?
            .write_slice::<_, i64, _, _>(&[value][..], row.clone())?;
    }
    for name in ["CellOffsets", "ConnectivityIdOffsets"] {
        steps
            .dataset(name)?
            .write_slice::<_, i64, _, _>(&[[0]][..], (row.clone(), ..))?;
    }
    let offsets = steps.group("PointDataOffsets")?;
    for name in field_names(points) {
        offsets
            .dataset(name)?
            .write_slice::<_, i64, _, _>(&[begin][..], row.clone())?;
    }
    Ok(())
}

/// Makes the first `count` steps count. Collective.
fn set_step_count(file: &File, count: i64) -> hdf5::Result<()> {
    file.group("VTKHDF/Steps")?.attr("NSteps")?.write_scalar(&count)
}
