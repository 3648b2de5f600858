//! What a checkpoint keeps of a run, and how a run goes on from it.

use super::build::Built;
use super::recorder::FilesState;
use crate::assembly::model::{Model, ModelState};
use crate::clock::PhaseSeconds;
use crate::config::{Source, changes};
use crate::continuum::{Continuum, Fields};
use crate::error::Error;
use crate::output::checkpoint::{Content, Numbers, Table, read, write};
use crate::parallel::World;
use crate::points::Points;
use crate::scene::Scene;
use crate::solve::state::AnalysisState;
use nalgebra::SVector;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// The table with the nodes of a mesh.
const NODES: &str = "nodes";

/// What a checkpoint says of a run, beside points and mesh.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct RunState {
    /// Version and commit of the program that wrote it.
    pub program: String,
    pub commit: String,
    /// The resolved configuration.
    pub configuration: serde_json::Value,
    /// Number of points on all ranks.
    pub points: u64,
    pub analysis: AnalysisState,
    pub model: ModelState,
    pub files: FilesState,
    pub spent: Spent,
}

/// What a run has used until a checkpoint, earlier parts included.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct Spent {
    /// Wall time of the root.
    pub phases: PhaseSeconds,
    /// Sum over ranks.
    pub cpu_seconds: f64,
}

/// The checkpoint of a result folder.
pub fn path_in(directory: &Path) -> PathBuf {
    directory.join("checkpoint.h5")
}

/// Collective. Puts the accepted state in the place of the checkpoint before.
pub fn save<C: Fields<D, N>, const D: usize, const N: usize>(
    world: &World,
    directory: &Path,
    model: &Model<C, D, N>,
    state: RunState,
) -> Result<(), Error> {
    let nodes = model.elements.iter().map(|elements| Table {
        name: NODES.to_owned(),
        width: D,
        numbers: Numbers::Real(
            elements
                .mesh
                .nodes()
                .iter()
                .flat_map(|node| node.iter().copied())
                .collect(),
        ),
    });
    let content = Content {
        state,
        rows: tables(&model.points),
        common: nodes.collect(),
        ranks: world.size(),
    };
    write(world, &path_in(directory), &content)
}

/// Collective. Puts a model that was just built into the state of the checkpoint in the result folder.
///
/// # Errors
/// The same on every rank: there is no checkpoint that can be read, or the scene is not the one that it belongs to.
pub fn load<C: Fields<D, N>, const D: usize, const N: usize>(
    world: &World,
    scene: &Scene,
    source: &Source,
    built: &mut Built<C, D, N>,
) -> Result<RunState, Error> {
    let path = path_in(&scene.output.directory);
    let Content {
        mut state,
        rows,
        common,
        ranks,
    } = read::<RunState>(world, &path)?;
    same_scene(scene, source, &state)?;
    let misfit = |what: &str| Error::System(format!("cannot go on from {}: {what}", path.display()));
    if state.points != built.points {
        let what = format!("it holds {} points, and the scene has {}", state.points, built.points);
        return Err(misfit(&what));
    }
    let records = records(&built.model.points, &rows);
    let nodes = nodes::<D>(
        built.model.elements.as_ref().map_or(0, |mesh| mesh.mesh.nodes().len()),
        &common,
    );
    let (true, Some(records), Some(nodes)) = (state.model.grid_min.len() == D, &records, nodes) else {
        return Err(misfit("its tables are not those of this scene"));
    };
    let model = &mut built.model;
    model.restore(&state.model);
    let (state_length, gap_count) = (model.points.state_length, model.points.gap_count);
    let keeps_last_motion = model.points.keeps_last_motion;
    model.points = Points::empty(state_length);
    model.points.keep_gaps(gap_count);
    if keeps_last_motion {
        model.points.keep_last_motion();
    }
    model.points.unpack(records);
    if let Some(elements) = &mut model.elements {
        elements.mesh.place_nodes(nodes.into_iter());
    }
    if ranks != world.size() {
        state.analysis.achieved_balance = None;
    }
    Ok(state)
}

/// What must not change between the parts of a run.
fn same_scene(scene: &Scene, source: &Source, state: &RunState) -> Result<(), Error> {
    let changed = changes(&state.configuration, &scene.output.resolved_tree, state.analysis.stage);
    let problems: Vec<_> = changed
        .iter()
        .map(|change| {
            let message = format!("the run to go on with had {}, not {}", change.before, change.now);
            let expected = "what it had; only title, solver, output but its history, and stages to come may change";
            source.problem(&change.path, message, expected)
        })
        .collect();
    if problems.is_empty() {
        Ok(())
    } else {
        Err(Error::Configuration(problems))
    }
}

/// Points as one table for each quantity.
fn tables<C: Continuum, const D: usize>(points: &Points<C, D>) -> Vec<Table> {
    let parts = points.record_parts();
    let length: usize = parts.iter().map(|part| part.length).sum();
    let mut records = Vec::with_capacity(length * points.len());
    (0..points.len()).for_each(|point| points.pack(point, &mut records));
    let mut start = 0;
    let mut tables = Vec::new();
    for part in parts.into_iter().filter(|part| part.length > 0) {
        let own = start..start + part.length;
        start = own.end;
        let values = records
            .chunks_exact(length)
            .flat_map(|record| record[own.clone()].iter());
        let numbers = if part.whole {
            Numbers::Whole(values.map(|value| value.to_bits()).collect())
        } else {
            Numbers::Real(values.copied().collect())
        };
        tables.push(Table {
            name: part.name,
            width: part.length,
            numbers,
        });
    }
    tables
}

/// Records of points from the tables of a checkpoint; `None` where these are not those of such points.
fn records<C: Continuum, const D: usize>(points: &Points<C, D>, tables: &[Table]) -> Option<Vec<f64>> {
    let parts = points.record_parts();
    let parts: Vec<_> = parts.iter().filter(|part| part.length > 0).collect();
    let fits = parts.len() == tables.len()
        && std::iter::zip(&parts, tables).all(|(part, table)| {
            let whole = matches!(table.numbers, Numbers::Whole(_));
            (&part.name, part.length, part.whole) == (&table.name, table.width, whole)
        });
    if !fits {
        return None;
    }
    let rows = tables.first().map_or(0, Table::rows);
    let mut records = Vec::new();
    for row in 0..rows {
        for table in tables {
            let own = row * table.width..(row + 1) * table.width;
            match &table.numbers {
                Numbers::Whole(values) => records.extend(values[own].iter().map(|&bits| f64::from_bits(bits))),
                Numbers::Real(values) => records.extend_from_slice(&values[own]),
            }
        }
    }
    Some(records)
}

/// Nodes of a mesh from the common tables; `None` where there are not so many.
fn nodes<const D: usize>(count: usize, common: &[Table]) -> Option<Vec<SVector<f64, D>>> {
    let positions: Vec<_> = match common {
        [] => Vec::new(),
        [
            Table {
                width,
                numbers: Numbers::Real(values),
                ..
            },
        ] if *width == D => values.chunks_exact(D).map(SVector::from_column_slice).collect(),
        _ => return None,
    };
    (positions.len() == count).then_some(positions)
}
