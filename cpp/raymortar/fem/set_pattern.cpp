#include "raymortar/fem/set_pattern.h"
#include <petsc/private/matimpl.h>

namespace raymortar
{
namespace
{
/// Give A the inside of a matrix that has never been preallocated, and keep
/// what the user sees of it.
///
/// A second preallocation leaves PETSc's inverses of diagonal blocks (of
/// MatSOR) as long as the first pattern's blocks were, and writes past their
/// end where blocks have grown.
void start_anew(PetscMatrix A)
{
  PetscMatrix fresh = nullptr;
  check(MatCreate(PetscObjectComm(reinterpret_cast<PetscObject>(A)), &fresh),
        "MatCreate");
  PetscInt rows = 0, columns = 0;
  check(MatGetLocalSize(A, &rows, &columns), "MatGetLocalSize");
  check(MatSetSizes(fresh, rows, columns, PETSC_DETERMINE, PETSC_DETERMINE),
        "MatSetSizes");
  check(MatSetBlockSizesFromMats(fresh, A, A), "MatSetBlockSizesFromMats");
  MatType type = nullptr;
  check(MatGetType(A, &type), "MatGetType");
  check(MatSetType(fresh, type), "MatSetType");
  ISLocalToGlobalMapping row_map = nullptr, column_map = nullptr;
  check(MatGetLocalToGlobalMapping(A, &row_map, &column_map),
        "MatGetLocalToGlobalMapping");
  if (row_map and column_map)
    check(MatSetLocalToGlobalMapping(fresh, row_map, column_map),
          "MatSetLocalToGlobalMapping");
  const char* prefix = nullptr;
  check(MatGetOptionsPrefix(A, &prefix), "MatGetOptionsPrefix");
  check(MatSetOptionsPrefix(fresh, prefix), "MatSetOptionsPrefix");
  MatNullSpace null = nullptr, near = nullptr;
  check(MatGetNullSpace(A, &null), "MatGetNullSpace");
  check(MatSetNullSpace(fresh, null), "MatSetNullSpace");
  check(MatGetNearNullSpace(A, &near), "MatGetNearNullSpace");
  check(MatSetNearNullSpace(fresh, near), "MatSetNearNullSpace");
  check(MatHeaderReplace(A, &fresh), "MatHeaderReplace");
}

/// Let the nonzero state of A be later than one that it had before.
///
/// That of a parallel matrix is the sum over ranks of its parts' states, which
/// PETSc 3.22 begins at the same number for each pattern. No public function
/// sets them.
void follow_state(PetscMatrix A, PetscObjectState before)
{
  A->nonzerostate += before;
  int rank = 0;
  MPI_Comm_rank(PetscObjectComm(reinterpret_cast<PetscObject>(A)), &rank);
  PetscBool parallel = PETSC_FALSE;
  check(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(A), MATMPIAIJ,
                               &parallel),
        "PetscObjectTypeCompare");
  if (parallel != PETSC_TRUE or rank > 0)
    return;
  PetscMatrix own = nullptr;
  check(MatMPIAIJGetSeqAIJ(A, &own, nullptr, nullptr), "MatMPIAIJGetSeqAIJ");
  own->nonzerostate += before;
}
} // namespace

void set_pattern(PetscMatrix A, std::span<const PetscInt> offsets,
                 std::span<const PetscInt> columns)
{
  PetscBool used = PETSC_FALSE;
  check(MatAssembled(A, &used), "MatAssembled");
  PetscObjectState before = 0;
  check(MatGetNonzeroState(A, &before), "MatGetNonzeroState");
  if (used == PETSC_TRUE)
    start_anew(A);
  // Only the call for A's own type has an effect
  check(
      MatSeqAIJSetPreallocationCSR(A, offsets.data(), columns.data(), nullptr),
      "MatSeqAIJSetPreallocationCSR");
  check(
      MatMPIAIJSetPreallocationCSR(A, offsets.data(), columns.data(), nullptr),
      "MatMPIAIJSetPreallocationCSR");
  follow_state(A, before);
}
} // namespace raymortar
