//! `checkpoint.h5`: everything that a run needs to go on, in one HDF5 file.
//!
//! Layout, version 2: attributes `format` and `version` at the root; `document`, a text in JSON with the state of the
//! analysis and a list of blocks; `rows/NAME`, one table per quantity with a row per point; `common/NAME`, arrays that
//! exist once. Each rank writes one contiguous block of rows, in the order of ranks, so that the blocks tell who held
//! which point.
//!
//! A checkpoint is written under a temporary name by all ranks together, brought to the disk and renamed: under its own
//! name there is always the newest complete one. Each block has a CRC-32 over all its tables in the document, which has
//! one in the attribute `checksum`: HDF5's own Fletcher checksum is a filter, and needs chunks and collective writes.

use std::fs;
use std::ops::Range;
use std::path::Path;

use crc32fast::Hasher;
use hdf5::types::FixedAscii;
use hdf5::{Dataset, File, Group, H5Type};
use mpi::traits::AsRaw;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::agree;
use super::folder::{aside, claim_space, create_anew, sync_folder};
use crate::error::Error;
use crate::parallel::World;

/// Version of the layout.
const VERSION: u32 = 2;

/// What the attribute `format` says.
const FORMAT: &str = "mpm-petsc checkpoint";

/// Room for the bookkeeping of the file, on top of its tables [byte].
const BOOKKEEPING: u64 = 1 << 16;

/// A table: numbers, so many to a row.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// Name in the file; `/` makes groups.
    pub name: String,
    /// Numbers of a row, 1 or more.
    pub width: usize,
    pub numbers: Numbers,
}

/// The numbers of a table, row by row.
#[derive(Clone, Debug, PartialEq)]
pub enum Numbers {
    Whole(Vec<u64>),
    Real(Vec<f64>),
}

/// What a checkpoint holds, as far as it concerns one rank.
#[derive(Clone, Debug, PartialEq)]
pub struct Content<S> {
    /// What is known as a text: the same on every rank, where the root's counts.
    pub state: S,
    /// Rows of this rank; the same tables on every rank.
    pub rows: Vec<Table>,
    /// What exists once; the same on every rank, where the root's counts.
    pub common: Vec<Table>,
    /// Number of ranks that wrote it.
    pub ranks: usize,
}

/// The text of a checkpoint.
#[derive(Debug, Serialize, Deserialize)]
struct Document<S> {
    blocks: Vec<Block>,
    rows: Vec<Kind>,
    common: Vec<Kind>,
    common_checksum: u32,
    state: S,
}

/// The rows of one rank.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Block {
    rows: u64,
    checksum: u32,
}

/// A table without its numbers.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Kind {
    name: String,
    width: usize,
    whole: bool,
}

impl Kind {
    fn of(table: &Table) -> Self {
        Self {
            name: table.name.clone(),
            width: table.width,
            whole: matches!(table.numbers, Numbers::Whole(_)),
        }
    }

    fn empty(&self) -> Table {
        Table {
            name: self.name.clone(),
            width: self.width,
            numbers: if self.whole {
                Numbers::Whole(Vec::new())
            } else {
                Numbers::Real(Vec::new())
            },
        }
    }
}

impl Table {
    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.numbers.len() / self.width
    }
}

impl Numbers {
    fn len(&self) -> usize {
        match self {
            Numbers::Whole(values) => values.len(),
            Numbers::Real(values) => values.len(),
        }
    }

    /// Adds numbers of the same kind.
    fn extend(&mut self, more: Numbers) {
        match (self, more) {
            (Numbers::Whole(values), Numbers::Whole(more)) => values.extend(more),
            (Numbers::Real(values), Numbers::Real(more)) => values.extend(more),
            (own, more) => panic!("a table holds numbers of one kind: {own:?}, {more:?}"),
        }
    }

    fn add_to(&self, hasher: &mut Hasher) {
        // In pieces: the checksum is several times faster over many bytes than over eight.
        const PIECE: usize = 1024;
        let mut bytes = Vec::with_capacity(8 * PIECE);
        let mut add = |piece: &mut dyn Iterator<Item = u64>| {
            bytes.clear();
            piece.for_each(|bits| bytes.extend_from_slice(&bits.to_le_bytes()));
            hasher.update(&bytes);
        };
        match self {
            Numbers::Whole(values) => values.chunks(PIECE).for_each(|piece| add(&mut piece.iter().copied())),
            Numbers::Real(values) => values
                .chunks(PIECE)
                .for_each(|piece| add(&mut piece.iter().map(|value| value.to_bits()))),
        }
    }
}

/// Checksum of tables with their names.
fn checksum(tables: &[Table]) -> u32 {
    let mut hasher = Hasher::new();
    for table in tables {
        hasher.update(table.name.as_bytes());
        table.numbers.add_to(&mut hasher);
    }
    hasher.finalize()
}

/// Collective. Puts a checkpoint in the place of the one before.
///
/// # Errors
/// The same on every rank: the file cannot be written or the disk is full. The checkpoint before stays as it was.
pub fn write<S: Serialize>(world: &World, path: &Path, content: &Content<S>) -> Result<(), Error> {
    let part = aside(path);
    let outcome = write_part(world, &part, content).and_then(|()| {
        let renamed = if world.is_root() {
            put_in_place(&part, path)
        } else {
            Ok(())
        };
        agree(world, renamed)
    });
    if outcome.is_err() && world.is_root() {
        // The failure itself is what matters; that the remains cannot be removed adds nothing.
        let _ = fs::remove_file(&part);
    }
    outcome.map_err(|error| Error::System(format!("cannot write {}: {error}", path.display())))
}

fn put_in_place(part: &Path, path: &Path) -> Result<(), String> {
    let put = || {
        fs::File::open(part)?.sync_all()?;
        fs::rename(part, path)?;
        sync_folder(path)
    };
    put().map_err(|error: std::io::Error| error.to_string())
}

fn write_part<S: Serialize>(world: &World, part: &Path, content: &Content<S>) -> Result<(), Error> {
    let own_rows = content.rows.first().map_or(0, Table::rows) as u64;
    let checksums = world.all_gather(checksum(&content.rows));
    let blocks: Vec<Block> = std::iter::zip(world.all_gather(own_rows), checksums)
        .map(|(rows, checksum)| Block { rows, checksum })
        .collect();
    let document = serde_json::to_string(&Document {
        blocks: blocks.clone(),
        rows: content.rows.iter().map(Kind::of).collect(),
        common: content.common.iter().map(Kind::of).collect(),
        common_checksum: checksum(&content.common),
        state: &content.state,
    });
    let document = agree(world, document.map_err(|error| error.to_string()))?;
    let document = world.broadcast_text(&document);
    let reserved = if world.is_root() {
        reserve(part, content, &blocks, &document)
    } else {
        Ok(())
    };
    agree(world, reserved)?;
    let plain = |outcome: hdf5::Result<()>| agree(world, outcome.map_err(|error| error.to_string()));
    let mut options = File::with_options();
    options.with_fapl(|access| access.mpio(world.communicator().as_raw(), None).libver_v18());
    let file = agree(world, options.create(part).map_err(|error| error.to_string()))?;
    plain(create_layout(&file, content, &blocks, &document))?;
    let first: u64 = blocks[..world.rank()].iter().map(|block| block.rows).sum();
    let written = write_tables(&file, content, first as usize);
    let written = if world.is_root() {
        written.and_then(|()| write_common(&file, content, &document))
    } else {
        written
    };
    let written = plain(written);
    plain(file.close())?;
    written
}

/// Finds out whether the disk has room, before any rank writes to it.
fn reserve<S>(part: &Path, content: &Content<S>, blocks: &[Block], document: &str) -> Result<(), String> {
    let rows: u64 = blocks.iter().map(|block| block.rows).sum();
    let width: usize = content.rows.iter().map(|table| table.width).sum();
    let common: usize = content.common.iter().map(|table| table.numbers.len()).sum();
    let bytes = 8 * (rows * width as u64 + common as u64) + document.len() as u64 + BOOKKEEPING;
    let claim = || claim_space(&create_anew(part)?, 0, bytes);
    claim().map_err(|error: std::io::Error| error.to_string())
}

/// Attributes and empty tables. Collective.
fn create_layout<S>(file: &File, content: &Content<S>, blocks: &[Block], document: &str) -> hdf5::Result<()> {
    let format = FixedAscii::<32>::from_ascii(FORMAT).expect("the name of the format is short");
    file.new_attr::<FixedAscii<32>>()
        .create("format")?
        .write_scalar(&format)?;
    file.new_attr::<u32>().create("version")?.write_scalar(&VERSION)?;
    let checksum = crc32fast::hash(document.as_bytes());
    file.new_attr::<u32>().create("checksum")?.write_scalar(&checksum)?;
    file.new_dataset::<u8>().shape(document.len()).create("document")?;
    let total: u64 = blocks.iter().map(|block| block.rows).sum();
    let rows = file.create_group("rows")?;
    for table in &content.rows {
        create_table(&rows, table, total as usize)?;
    }
    let common = file.create_group("common")?;
    for table in &content.common {
        create_table(&common, table, table.rows())?;
    }
    Ok(())
}

fn create_table(group: &Group, table: &Table, rows: usize) -> hdf5::Result<()> {
    let shape = (rows, table.width);
    // Groups of a name such as `motion/twist` are made with it.
    match table.numbers {
        Numbers::Whole(_) => group.new_dataset::<u64>().shape(shape).create(&*table.name)?,
        Numbers::Real(_) => group.new_dataset::<f64>().shape(shape).create(&*table.name)?,
    };
    Ok(())
}

/// The rows of this rank. Not collective.
fn write_tables<S>(file: &File, content: &Content<S>, first: usize) -> hdf5::Result<()> {
    let group = file.group("rows")?;
    content
        .rows
        .iter()
        .try_for_each(|table| write_table(&group.dataset(&table.name)?, table, first))
}

/// What exists once. Not collective.
fn write_common<S>(file: &File, content: &Content<S>, document: &str) -> hdf5::Result<()> {
    let group = file.group("common")?;
    for table in &content.common {
        write_table(&group.dataset(&table.name)?, table, 0)?;
    }
    file.dataset("document")?.write_raw(document.as_bytes())
}

fn write_table(dataset: &Dataset, table: &Table, first: usize) -> hdf5::Result<()> {
    fn put<T: H5Type>(dataset: &Dataset, values: &[T], first: usize, width: usize) -> hdf5::Result<()> {
        let rows = values.len() / width;
        let view = ndarray::ArrayView2::from_shape((rows, width), values)
            .map_err(|error| hdf5::Error::Internal(error.to_string()))?;
        dataset.write_slice(view, (first..first + rows, ..))
    }
    match &table.numbers {
        _ if table.rows() == 0 => Ok(()),
        Numbers::Whole(values) => put(dataset, values, first, table.width),
        Numbers::Real(values) => put(dataset, values, first, table.width),
    }
}

/// What to say where there is no checkpoint.
pub fn no_checkpoint(path: &Path) -> String {
    format!(
        "there is no checkpoint to go on from: {} does not exist",
        path.display()
    )
}

/// Collective. Reads a checkpoint: what each rank wrote where there are as many ranks as then; otherwise whole blocks,
/// so that some ranks may get several and others none.
///
/// # Errors
/// The same on every rank: there is no checkpoint, or it is none of this program, of another version, or damaged.
pub fn read<S: DeserializeOwned>(world: &World, path: &Path) -> Result<Content<S>, Error> {
    let content = read_part(path, world.rank(), world.size());
    agree(world, content)
}

/// What rank `rank` of `size` gets of a checkpoint.
fn read_part<S: DeserializeOwned>(path: &Path, rank: usize, size: usize) -> Result<Content<S>, String> {
    if !path.exists() {
        return Err(no_checkpoint(path));
    }
    if !path.is_file() {
        return Err(format!("{} is no checkpoint: it is no file", path.display()));
    }
    let file = File::open(path).map_err(|error| {
        format!(
            "{} is no checkpoint, or one that is incomplete or damaged: {error}",
            path.display()
        )
    })?;
    check_format(&file).map_err(|what| format!("cannot go on from {}: {what}", path.display()))?;
    read_checked(&file, rank, size).map_err(|what| format!("{} is damaged: {what}", path.display()))
}

/// Whether a file is a checkpoint that this program reads.
fn check_format(file: &File) -> Result<(), String> {
    let foreign = |_| "it is an HDF5 file of another kind, no checkpoint of this program".to_owned();
    let format = file
        .attr("format")
        .and_then(|attribute| attribute.read_scalar::<FixedAscii<32>>());
    let version = file
        .attr("version")
        .and_then(|attribute| attribute.read_scalar::<u32>());
    if format.map_err(foreign)?.as_str() != FORMAT {
        return Err(foreign(hdf5::Error::Internal(String::new())));
    }
    match version.map_err(foreign)? {
        VERSION => Ok(()),
        version => Err(format!(
            "its layout is version {version}, and this program reads version {VERSION} alone"
        )),
    }
}

fn read_checked<S: DeserializeOwned>(file: &File, rank: usize, size: usize) -> Result<Content<S>, String> {
    let plain = |error: hdf5::Error| error.to_string();
    let bytes: Vec<u8> = file
        .dataset("document")
        .and_then(|data| data.read_raw())
        .map_err(plain)?;
    let expected: u32 = file
        .attr("checksum")
        .and_then(|data| data.read_scalar())
        .map_err(plain)?;
    if crc32fast::hash(&bytes) != expected {
        return Err("the checksum of its text is wrong".into());
    }
    let document: Document<S> = serde_json::from_slice(&bytes).map_err(|error| error.to_string())?;
    let group = file.group("common").map_err(plain)?;
    let mut common: Vec<Table> = document.common.iter().map(Kind::empty).collect();
    for table in &mut common {
        let rows = group.dataset(&table.name).map_err(plain)?.shape().first().copied();
        read_rows(&group, table, 0..rows.unwrap_or(0)).map_err(plain)?;
    }
    if checksum(&common) != document.common_checksum {
        return Err("the checksum of its common tables is wrong".into());
    }
    let group = file.group("rows").map_err(plain)?;
    let mut rows: Vec<Table> = document.rows.iter().map(Kind::empty).collect();
    let mut first = 0;
    for (number, block) in document.blocks.iter().enumerate() {
        let range = first..first + block.rows as usize;
        first = range.end;
        if number * size / document.blocks.len() != rank {
            continue;
        }
        let mut own: Vec<Table> = document.rows.iter().map(Kind::empty).collect();
        for table in &mut own {
            read_rows(&group, table, range.clone()).map_err(plain)?;
        }
        if checksum(&own) != block.checksum {
            return Err(format!("the checksum of the points of rank {number} is wrong"));
        }
        std::iter::zip(&mut rows, own).for_each(|(all, own)| all.numbers.extend(own.numbers));
    }
    Ok(Content {
        state: document.state,
        rows,
        common,
        ranks: document.blocks.len(),
    })
}

/// Adds rows of the file to a table.
fn read_rows(group: &Group, table: &mut Table, rows: Range<usize>) -> hdf5::Result<()> {
    fn get<T: H5Type>(dataset: &Dataset, rows: Range<usize>, values: &mut Vec<T>) -> hdf5::Result<()> {
        let read = dataset.read_slice_2d::<T, _>((rows, ..))?;
        values.extend(read);
        Ok(())
    }
    let dataset = group.dataset(&table.name)?;
    match &mut table.numbers {
        _ if rows.is_empty() => Ok(()),
        Numbers::Whole(values) => get(&dataset, rows, values),
        Numbers::Real(values) => get(&dataset, rows, values),
    }
}
