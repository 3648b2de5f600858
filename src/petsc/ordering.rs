//! METIS's nested dissection as a fill-reducing ordering for factorisations on one rank.
//!
//! Distributions build MUMPS without METIS; its own best ordering is then PORD, which costs clearly more operations on
//! large meshes. PETSc hands an ordering to MUMPS only when all runs on one rank.

use std::ffi::{CStr, c_char};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::ptr::{null, null_mut};

use petsc_sys as sys;
use sys::{PetscInt, idx_t};

use super::error::{PetscError, check, text};
use super::pattern::{self, Pattern};
use super::session::Session;
use super::vector::index;

/// The name in `-pc_factor_mat_ordering_type`.
pub(super) const NAME: &CStr = c"metis_nd";

/// Graphs with fewer nodes keep their order: nothing is gained, and METIS is not made for them.
const SMALLEST: usize = 32;

/// Adds the ordering to PETSc's list.
pub(super) fn register() -> Result<(), PetscError> {
    // SAFETY: PETSc runs; the name ends with a zero byte and the callback has PETSc's signature.
    check(unsafe { sys::MatOrderingRegister(NAME.as_ptr(), Some(nested_dissection)) })
}

/// PETSc's ordering function: the same index set for rows and columns.
///
/// # Safety
/// To be called by PETSc only, with a matrix on one rank.
unsafe extern "C" fn nested_dissection(
    matrix: sys::Mat,
    _name: sys::MatOrderingType,
    rows: *mut sys::IS,
    columns: *mut sys::IS,
) -> sys::PetscErrorCode {
    // SAFETY: PETSc passes a valid matrix and valid out-pointers. Nothing is left half-done by a panic.
    let ordered = catch_unwind(AssertUnwindSafe(|| unsafe {
        let positions = positions(matrix)?;
        let mut communicator = null_mut();
        check(sys::PetscObjectGetComm(matrix.cast(), &mut communicator))?;
        *rows = permutation(communicator, &positions)?;
        *columns = permutation(communicator, &positions)?;
        Ok::<(), PetscError>(())
    }));
    match ordered {
        Ok(Ok(())) => 0,
        Ok(Err(error)) => error.code as sys::PetscErrorCode,
        Err(_) => sys::PETSC_ERR_PLIB as sys::PetscErrorCode,
    }
}

/// The position of each row in the order of elimination. For a matrix that is stored in blocks, PETSc wants blocks.
///
/// # Safety
/// `matrix` is a valid matrix on one rank.
unsafe fn positions(matrix: sys::Mat) -> Result<Vec<PetscInt>, PetscError> {
    let (mut block, mut kind) = (1, null());
    // SAFETY: the handle and the out-pointers are valid; the name lives in the matrix.
    let blocked = unsafe {
        check(sys::MatGetBlockSize(matrix, &mut block))?;
        check(sys::MatGetType(matrix, &mut kind))?;
        text(kind).contains("baij")
    };
    let block = block as usize;
    // SAFETY: by contract.
    let graph = unsafe {
        pattern::with_rows(matrix, Pattern::Symmetric, |starts, columns| {
            compress(starts, columns, block)
        })?
    };
    let nodes = graph.starts.len() - 1;
    let positions = if nodes < SMALLEST {
        (0..nodes).collect()
    } else {
        graph.dissect()?
    };
    let rows = if blocked { 1 } else { block };
    positions
        .into_iter()
        .flat_map(|position| (0..rows).map(move |row| index(position * rows + row)))
        .collect()
}

/// Symmetric graph of nodes without loops, as METIS wants it.
struct NodeGraph {
    starts: Vec<idx_t>,
    neighbours: Vec<idx_t>,
}

impl NodeGraph {
    /// The position of each node in METIS's order of elimination. (PETSc hands positions to MUMPS: METIS's `iperm`.)
    fn dissect(mut self) -> Result<Vec<usize>, PetscError> {
        let mut nodes = (self.starts.len() - 1) as idx_t;
        let mut options: [idx_t; sys::METIS_NOPTIONS as usize] = [0; sys::METIS_NOPTIONS as usize];
        let (mut order, mut position) = (vec![0; nodes as usize], vec![0; nodes as usize]);
        // SAFETY: the lists have the lengths that METIS documents: a compressed graph, and two results per node.
        let status = unsafe {
            sys::METIS_SetDefaultOptions(options.as_mut_ptr());
            sys::METIS_NodeND(
                &mut nodes,
                self.starts.as_mut_ptr(),
                self.neighbours.as_mut_ptr(),
                null_mut(),
                options.as_mut_ptr(),
                order.as_mut_ptr(),
                position.as_mut_ptr(),
            )
        };
        if status != sys::METIS_OK {
            return Err(PetscError::refused(
                sys::PETSC_ERR_LIB,
                format!("METIS_NodeND returned {status}"),
            ));
        }
        Ok(position.into_iter().map(|p| p as usize).collect())
    }
}

/// The graph of nodes of `per_node` rows each.
fn compress(starts: &[PetscInt], columns: &[PetscInt], per_node: usize) -> Result<NodeGraph, PetscError> {
    let nodes = (starts.len() - 1) / per_node;
    let mut graph = NodeGraph {
        starts: vec![0],
        neighbours: Vec::new(),
    };
    let mut seen: Vec<usize> = Vec::new();
    for node in 0..nodes {
        seen.clear();
        let entries = starts[node * per_node] as usize..starts[(node + 1) * per_node] as usize;
        seen.extend(
            columns[entries]
                .iter()
                .map(|&column| column as usize / per_node)
                .filter(|&other| other != node),
        );
        seen.sort_unstable();
        seen.dedup();
        graph.neighbours.extend(seen.iter().map(|&other| other as idx_t));
        let end = idx_t::try_from(graph.neighbours.len()).map_err(|_| {
            PetscError::refused(
                sys::PETSC_ERR_ARG_OUTOFRANGE,
                "the matrix has more entries than METIS can count",
            )
        })?;
        graph.starts.push(end);
    }
    Ok(graph)
}

/// An index set that PETSc knows to be a permutation.
///
/// # Safety
/// `communicator` is a valid communicator of one rank.
unsafe fn permutation(communicator: sys::MPI_Comm, positions: &[PetscInt]) -> Result<sys::IS, PetscError> {
    let mut set = null_mut();
    // SAFETY: by contract; the list is copied, and the out-pointer is valid.
    unsafe {
        let length = index(positions.len())?;
        check(sys::ISCreateGeneral(
            communicator,
            length,
            positions.as_ptr(),
            sys::PETSC_COPY_VALUES,
            &mut set,
        ))?;
        check(sys::ISSetPermutation(set))?;
    }
    Ok(set)
}

/// Type of a preconditioner, and the package that factorises for it if it is a factorisation.
///
/// # Safety
/// `pc` is a valid preconditioner with its type set.
unsafe fn factorisation(pc: sys::PC) -> Result<(String, Option<String>), PetscError> {
    let (mut kind, mut package) = (null::<c_char>(), null::<c_char>());
    // SAFETY: the handle and the out-pointers are valid; the names live in the preconditioner.
    unsafe {
        check(sys::PCGetType(pc, &mut kind))?;
        let kind = text(kind);
        if kind != "lu" && kind != "cholesky" {
            return Ok((kind, None));
        }
        check(sys::PCFactorGetMatSolverType(pc, &mut package))?;
        Ok((kind, Some(text(package))))
    }
}

/// Whether this preconditioner is a factorisation by MUMPS.
///
/// # Safety
/// `pc` is a valid preconditioner with its type set.
pub(super) unsafe fn factors_with_mumps(pc: sys::PC) -> Result<bool, PetscError> {
    // SAFETY: by contract.
    Ok(unsafe { factorisation(pc)? }
        .1
        .is_some_and(|package| package == "mumps"))
}

/// The factorisation package of this preconditioner and the ordering that it used last, in words.
///
/// # Safety
/// `pc` is a valid preconditioner with its type set.
pub(super) unsafe fn used(pc: sys::PC, session: &Session) -> Result<String, PetscError> {
    // SAFETY: by contract.
    let (kind, package) = match unsafe { factorisation(pc)? } {
        (kind, Some(package)) => (kind, package),
        (kind, None) => return Ok(format!("{kind}, no factorisation")),
    };
    let ordering = session.option(c"-pc_factor_mat_ordering_type")?;
    if package != "mumps" {
        return Ok(format!(
            "{package} {kind}, {} ordering",
            ordering.as_deref().unwrap_or("default")
        ));
    }
    let (mut factor, mut choice) = (null_mut(), 0);
    // SAFETY: the handle and the out-pointers are valid; the factor belongs to the preconditioner.
    unsafe {
        if check(sys::PCFactorGetMatrix(pc, &mut factor)).is_err() {
            return Ok(format!("MUMPS {kind}, nothing factorised"));
        }
        check(sys::MatMumpsGetInfog(factor, 7, &mut choice))?;
    }
    let choice = match choice {
        0 => "AMD".to_string(),
        1 => ordering
            .filter(|name| name.as_bytes() != NAME.to_bytes())
            .unwrap_or_else(|| "METIS nested dissection".to_string()),
        2 => "AMF".to_string(),
        3 => "SCOTCH".to_string(),
        4 => "PORD".to_string(),
        5 => "METIS".to_string(),
        6 => "QAMD".to_string(),
        other => format!("INFOG(7) = {other}"),
    };
    Ok(format!("MUMPS {kind}, {choice}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows of a tridiagonal block matrix: `nodes` nodes of `block` rows.
    fn chain(nodes: usize, block: usize) -> (Vec<PetscInt>, Vec<PetscInt>) {
        let (mut starts, mut columns) = (vec![0], Vec::new());
        for row in 0..nodes * block {
            let node = row / block;
            let range = node.saturating_sub(1) * block..(node + 2).min(nodes) * block;
            columns.extend(range.map(|column| column as PetscInt));
            starts.push(columns.len() as PetscInt);
        }
        (starts, columns)
    }

    #[test]
    fn rows_of_a_node_become_one_vertex_without_a_loop() {
        let (starts, columns) = chain(3, 2);
        let graph = compress(&starts, &columns, 2).unwrap();
        assert_eq!(graph.starts, [0, 1, 3, 4]);
        assert_eq!(graph.neighbours, [1, 0, 2, 1]);
    }

    #[test]
    fn dissection_gives_every_position_once() {
        let (starts, columns) = chain(100, 3);
        let mut positions = compress(&starts, &columns, 3).unwrap().dissect().unwrap();
        assert_ne!(positions, (0..100).collect::<Vec<_>>());
        positions.sort_unstable();
        assert_eq!(positions, (0..100).collect::<Vec<_>>());
    }
}
