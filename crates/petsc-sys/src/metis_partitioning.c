/*
  A MatPartitioning type named "metis": METIS_PartGraphKway on rank 0, the answer sent to the owners.

  PETSc has only the parallel ParMETIS as a partitioner, and distributions often build PETSc without it. The types are
  kept in a list that anybody may extend (MatPartitioningRegister), but a type must fill the table of operations of the
  object, which only the private header describes. It is read here, by the C compiler and from the installed package,
  so a changed layout is a compile error or a correct program, never a wrong offset.
*/
#include <petsc/private/matimpl.h>
#include <metis.h>

PETSC_EXTERN PetscErrorCode PetscSysRegisterMetisPartitioning(void);

/* Counts and displacements of a distributed array of one entry per row, on every rank. */
static PetscErrorCode RowCounts(MPI_Comm comm, const PetscInt *ranges, PetscMPIInt **counts, PetscMPIInt **starts)
{
  PetscMPIInt size;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(comm, &size));
  PetscCall(PetscMalloc2(size, counts, size, starts));
  for (PetscMPIInt i = 0; i < size; i++) {
    PetscCall(PetscMPIIntCast(ranges[i], *starts + i));
    PetscCall(PetscMPIIntCast(ranges[i + 1] - ranges[i], *counts + i));
  }
  PetscFunctionReturn(0);
}

/* Wanted share of each part, in METIS's precision; NULL for equal shares. */
static PetscErrorCode PartShares(MatPartitioning part, real_t **shares)
{
  PetscInt length;

  PetscFunctionBegin;
  *shares = NULL;
  if (part->part_weights) {
    length = part->n * part->ncon;
    PetscCall(PetscMalloc1(length, shares));
    for (PetscInt i = 0; i < length; i++) (*shares)[i] = (real_t)part->part_weights[i];
  }
  PetscFunctionReturn(0);
}

/* Partition the gathered graph; `status` is METIS's. The graph has at least two vertices and two parts. */
static PetscErrorCode PartitionGathered(MatPartitioning part, Mat graph, const PetscInt *weights, PetscInt *colour,
                                        int *status)
{
  PetscInt        vertices, edges;
  const PetscInt *ia, *ja;
  PetscBool       done;
  idx_t           n, ncon, parts, cut, options[METIS_NOPTIONS], *xadj, *adjncy, *vwgt = NULL, *answer;
  real_t         *shares;

  PetscFunctionBegin;
  PetscCall(MatGetRowIJ(graph, 0, PETSC_FALSE, PETSC_FALSE, &vertices, &ia, &ja, &done));
  PetscCheck(done, PETSC_COMM_SELF, PETSC_ERR_SUP, "The gathered graph gives no access to its rows");
  n     = (idx_t)vertices;
  ncon  = (idx_t)part->ncon;
  parts = (idx_t)part->n;
  edges = ia[vertices];
  PetscCall(PetscMalloc3(vertices + 1, &xadj, edges + 1, &adjncy, vertices, &answer));
  for (PetscInt i = 0; i <= vertices; i++) xadj[i] = (idx_t)ia[i];
  for (PetscInt i = 0; i < edges; i++) adjncy[i] = (idx_t)ja[i];
  if (weights) {
    PetscCall(PetscMalloc1(vertices * part->ncon, &vwgt));
    for (PetscInt i = 0; i < vertices * part->ncon; i++) vwgt[i] = (idx_t)weights[i];
  }
  PetscCall(PartShares(part, &shares));
  METIS_SetDefaultOptions(options);
  options[METIS_OPTION_NUMBERING] = 0;
  options[METIS_OPTION_SEED]      = 1; /* the same cut every time */
  *status = METIS_PartGraphKway(&n, &ncon, xadj, adjncy, vwgt, NULL, NULL, &parts, shares, NULL, options, &cut, answer);
  for (PetscInt i = 0; i < vertices; i++) colour[i] = (PetscInt)answer[i];
  PetscCall(PetscFree(shares));
  PetscCall(PetscFree(vwgt));
  PetscCall(PetscFree3(xadj, adjncy, answer));
  PetscCall(MatRestoreRowIJ(graph, 0, PETSC_FALSE, PETSC_FALSE, &vertices, &ia, &ja, &done));
  PetscFunctionReturn(0);
}

static PetscErrorCode MatPartitioningApply_Metis(MatPartitioning part, IS *partitioning)
{
  MPI_Comm        comm = PetscObjectComm((PetscObject)part);
  Mat             adjacency = part->adj, gathered = NULL;
  PetscBool       is_adjacency;
  PetscInt        local, total, *colour, *everywhere = NULL, *weights = NULL;
  const PetscInt *ranges;
  PetscMPIInt     rank, *counts, *starts, weight_count;
  MPI_Datatype    tuple;
  int             status = METIS_OK;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  PetscCall(PetscObjectTypeCompare((PetscObject)adjacency, MATMPIADJ, &is_adjacency));
  if (is_adjacency) PetscCall(PetscObjectReference((PetscObject)adjacency));
  else PetscCall(MatConvert(part->adj, MATMPIADJ, MAT_INITIAL_MATRIX, &adjacency));
  PetscCall(MatGetSize(adjacency, &total, NULL));
  PetscCall(MatGetLocalSize(adjacency, &local, NULL));
  PetscCall(MatGetOwnershipRanges(adjacency, &ranges));
  PetscCall(RowCounts(comm, ranges, &counts, &starts));
  PetscCall(MatMPIAdjToSeqRankZero(adjacency, &gathered));
  if (rank == 0) PetscCall(PetscMalloc1(total, &everywhere));
  if (part->vertex_weights) {
    PetscCall(PetscMPIIntCast(part->ncon, &weight_count));
    PetscCallMPI(MPI_Type_contiguous(weight_count, MPIU_INT, &tuple));
    PetscCallMPI(MPI_Type_commit(&tuple));
    if (rank == 0) PetscCall(PetscMalloc1(total * part->ncon, &weights));
    PetscCallMPI(MPI_Gatherv(part->vertex_weights, (PetscMPIInt)local, tuple, weights, counts, starts, tuple, 0, comm));
    PetscCallMPI(MPI_Type_free(&tuple));
  }
  if (rank == 0) {
    if (part->n < 2 || total < 2) PetscCall(PetscArrayzero(everywhere, total));
    else PetscCall(PartitionGathered(part, gathered, weights, everywhere, &status));
  }
  PetscCallMPI(MPI_Bcast(&status, 1, MPI_INT, 0, comm)); /* so that a failure is an error on every rank */
  PetscCheck(status == METIS_OK, comm, PETSC_ERR_LIB, "METIS_PartGraphKway returned %d", status);
  PetscCall(PetscMalloc1(local, &colour));
  PetscCallMPI(MPI_Scatterv(everywhere, counts, starts, MPIU_INT, colour, (PetscMPIInt)local, MPIU_INT, 0, comm));
  PetscCall(ISCreateGeneral(comm, local, colour, PETSC_OWN_POINTER, partitioning));
  PetscCall(PetscFree(weights));
  PetscCall(PetscFree(everywhere));
  PetscCall(PetscFree2(counts, starts));
  PetscCall(MatDestroy(&gathered));
  PetscCall(MatDestroy(&adjacency));
  PetscFunctionReturn(0);
}

static PetscErrorCode MatPartitioningCreate_Metis(MatPartitioning part)
{
  PetscFunctionBegin;
  part->ops->apply = MatPartitioningApply_Metis;
  PetscFunctionReturn(0);
}

PetscErrorCode PetscSysRegisterMetisPartitioning(void)
{
  PetscFunctionBegin;
  PetscCall(MatPartitioningRegister("metis", MatPartitioningCreate_Metis));
  PetscFunctionReturn(0);
}
