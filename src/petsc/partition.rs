//! Dividing a graph between ranks.

use std::ffi::{CStr, c_int};
use std::fmt;
use std::ptr::{null, null_mut};
use std::rc::Rc;

use petsc_sys as sys;
use sys::PetscInt;

use super::error::{PetscError, check, forget_message, report_in_drop};
use super::session::Session;
use super::vector::index;

/// Which partitioner divides the graph.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Partitioner {
    /// METIS: always there, and the same parts from the same graph every time (`docs/decisions/metis.md`).
    #[default]
    Auto,
    /// METIS' multilevel k-way partitioning on rank 0, which holds the whole graph meanwhile.
    Metis,
    /// PT-Scotch, in parallel; its answer differs from call to call.
    PtScotch,
    /// ParMETIS, in parallel; Debian's PETSc has none.
    ParMetis,
}

impl Partitioner {
    /// The name in configuration files and in PETSc.
    fn name(self) -> &'static CStr {
        match self {
            Partitioner::Auto => c"auto",
            Partitioner::Metis => c"metis",
            Partitioner::PtScotch => c"ptscotch",
            Partitioner::ParMetis => c"parmetis",
        }
    }

    /// What `Auto` stands for in this PETSc; the others are themselves.
    ///
    /// # Errors
    /// A partitioner that this PETSc does not have, with those that it has.
    pub fn resolve(self, session: &Rc<Session>) -> Result<Partitioner, PetscError> {
        if self == Partitioner::Auto {
            return Ok(Partitioner::Metis);
        }
        if self == Partitioner::PtScotch && !session.world().is_thread_safe() {
            // Found with PT-Scotch 7.0.3 on three ranks: it waits for ever, or reports communication errors.
            return Err(PetscError::refused(
                sys::PETSC_ERR_SUP,
                "ptscotch calls MPI from several threads, which this MPI does not allow; use metis",
            ));
        }
        let mut available = Vec::new();
        for choice in [Partitioner::Metis, Partitioner::PtScotch, Partitioner::ParMetis] {
            if MatPartitioning::new(session)?.knows(choice)? {
                available.push(choice);
            }
        }
        if available.contains(&self) {
            return Ok(self);
        }
        let names: Vec<String> = available.iter().map(Partitioner::to_string).collect();
        Err(PetscError::refused(
            sys::PETSC_ERR_ARG_UNKNOWN_TYPE,
            format!(
                "this PETSc was built without the partitioner `{self}`; available: auto, {}",
                names.join(", ")
            ),
        ))
    }
}

impl fmt::Display for Partitioner {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.name().to_string_lossy())
    }
}

/// This rank's part of a symmetric graph without loops. Vertices are numbered without gaps by rank.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Graph {
    /// Global number of the first own vertex.
    pub first: usize,
    /// Where the neighbours of each own vertex start, and where the last ones end: one entry more than own vertices.
    pub offsets: Vec<PetscInt>,
    /// Global numbers of the neighbours.
    pub neighbours: Vec<PetscInt>,
    /// Weight of each own vertex, positive.
    pub vertex_weights: Vec<PetscInt>,
}

impl Graph {
    /// Number of own vertices.
    pub fn vertices(&self) -> usize {
        self.offsets.len().saturating_sub(1)
    }
}

/// The part, from zero, of each own vertex; parts have about equal weight and few edges between them.
///
/// Ranks may have no vertices, and there may be fewer vertices than parts (then each vertex is its own part). PETSc's
/// `-mat_partitioning_...` options apply.
///
/// # Errors
/// A partitioner that this PETSc does not have, lists that do not fit each other, or what PETSc reports.
pub fn partition(
    session: &Rc<Session>,
    graph: &Graph,
    parts: usize,
    partitioner: Partitioner,
) -> Result<Vec<usize>, PetscError> {
    let partitioner = partitioner.resolve(session)?;
    let fits = graph.vertex_weights.len() == graph.vertices()
        && graph
            .offsets
            .last()
            .is_none_or(|&end| end as usize == graph.neighbours.len());
    session.world().agree(check_lists(fits), |rank| {
        PetscError::refused(
            sys::PETSC_ERR_ARG_SIZ,
            format!("the graph of rank {rank} does not fit together"),
        )
    })?;
    let total = session.world().sum(graph.vertices());
    if total <= parts || parts < 2 {
        // Nothing to divide, and graph libraries are not made for it.
        return Ok((graph.first..graph.first + graph.vertices())
            .map(|vertex| vertex.min(parts - 1))
            .collect());
    }
    let partitioning = MatPartitioning::new(session)?;
    let adjacency = adjacency(session, graph, total)?;
    let weights = petsc_copy(&graph.vertex_weights)?;
    // SAFETY: the handles are valid; the weights were allocated by PETSc, which frees them; the name ends with a zero
    // byte.
    unsafe {
        let handle = partitioning.handle;
        check(sys::MatPartitioningSetAdjacency(handle, adjacency.handle))?;
        check(sys::MatPartitioningSetVertexWeights(handle, weights))?;
        check(sys::MatPartitioningSetNParts(handle, index(parts)?))?;
        check(sys::MatPartitioningSetType(handle, partitioner.name().as_ptr()))?;
        check(sys::MatPartitioningSetFromOptions(handle))?;
    }
    partitioning.apply(graph.vertices())
}

fn check_lists(fit: bool) -> Result<(), PetscError> {
    let message = "the offsets, neighbours and weights of the graph do not fit each other";
    if fit {
        Ok(())
    } else {
        Err(PetscError::refused(sys::PETSC_ERR_ARG_SIZ, message))
    }
}

/// A partitioning that destroys itself.
struct MatPartitioning {
    handle: sys::MatPartitioning,
}

impl MatPartitioning {
    fn new(session: &Rc<Session>) -> Result<Self, PetscError> {
        let mut handle = null_mut();
        // SAFETY: PETSc runs and the out-pointer is valid.
        check(unsafe { sys::MatPartitioningCreate(session.communicator(), &mut handle) })?;
        Ok(MatPartitioning { handle })
    }

    /// Whether PETSc has this partitioner.
    fn knows(&self, choice: Partitioner) -> Result<bool, PetscError> {
        // SAFETY: the handle is valid and the name ends with a zero byte.
        let code = unsafe { sys::MatPartitioningSetType(self.handle, choice.name().as_ptr()) };
        if code == sys::PETSC_ERR_ARG_UNKNOWN_TYPE as sys::PetscErrorCode {
            forget_message();
            return Ok(false);
        }
        check(code).map(|()| true)
    }

    /// The part of each of `count` own vertices.
    fn apply(&self, count: usize) -> Result<Vec<usize>, PetscError> {
        let (mut answer, mut parts) = (null_mut(), null());
        // SAFETY: the handles and out-pointers are valid; the list has one entry per own vertex and is copied before it
        // is given back.
        unsafe {
            check(sys::MatPartitioningApply(self.handle, &mut answer))?;
            check(sys::ISGetIndices(answer, &mut parts))?;
            let list = if count == 0 {
                &[]
            } else {
                std::slice::from_raw_parts(parts, count)
            };
            let result = list.iter().map(|&part| part as usize).collect();
            check(sys::ISRestoreIndices(answer, &mut parts))?;
            check(sys::ISDestroy(&mut answer))?;
            Ok(result)
        }
    }
}

impl Drop for MatPartitioning {
    fn drop(&mut self) {
        if !std::thread::panicking() {
            // SAFETY: the handle is valid and not used again.
            report_in_drop("MatPartitioningDestroy", unsafe {
                sys::MatPartitioningDestroy(&mut self.handle)
            });
        }
    }
}

/// A graph as a matrix of PETSc that destroys itself.
struct Adjacency {
    handle: sys::Mat,
}

impl Drop for Adjacency {
    fn drop(&mut self) {
        if !std::thread::panicking() {
            // SAFETY: the handle is valid and not used again.
            report_in_drop("MatDestroy", unsafe { sys::MatDestroy(&mut self.handle) });
        }
    }
}

/// The graph in PETSc's form.
fn adjacency(session: &Rc<Session>, graph: &Graph, total: usize) -> Result<Adjacency, PetscError> {
    let offsets = if graph.offsets.is_empty() {
        &[0][..]
    } else {
        &graph.offsets
    };
    let (rows, columns) = (index(graph.vertices())?, index(total)?);
    let (offsets, neighbours) = (petsc_copy(offsets)?, petsc_copy(&graph.neighbours)?);
    let mut handle = null_mut();
    // SAFETY: the lists describe a compressed graph, and were allocated by PETSc, which frees them with the matrix.
    check(unsafe {
        sys::MatCreateMPIAdj(
            session.communicator(),
            rows,
            columns,
            offsets,
            neighbours,
            null_mut(),
            &mut handle,
        )
    })?;
    Ok(Adjacency { handle })
}

/// A copy in memory of PETSc, for functions that take a list over.
fn petsc_copy(values: &[PetscInt]) -> Result<*mut PetscInt, PetscError> {
    let mut copy: *mut PetscInt = null_mut();
    let (line, name) = (line!() as c_int, c"petsc_copy");
    // SAFETY: one allocation of the size of `values` (at least one entry) into a valid out-pointer; then a copy between
    // distinct memories of that size.
    unsafe {
        let bytes = size_of::<PetscInt>() * values.len().max(1);
        check(sys::PetscMallocA(
            1,
            sys::PETSC_FALSE,
            line,
            name.as_ptr(),
            name.as_ptr(),
            bytes,
            (&raw mut copy).cast(),
        ))?;
        std::ptr::copy_nonoverlapping(values.as_ptr(), copy, values.len());
    }
    Ok(copy)
}
