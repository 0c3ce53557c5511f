// PETSc matrices that are destroyed at the end of their scope, as Eigen's.
#pragma once

#include "raymortar/fem/pattern.h"
#include "zones.h"
#include <Eigen/Dense>

namespace raymortar::test
{
/// A square matrix without room for entries
class OwnedMatrix
{
public:
  /// @param[in] rows Of this rank
  OwnedMatrix(MPI_Comm comm, PetscInt rows, MatType type = MATAIJ)
  {
    start_petsc();
    MatCreate(comm, &_matrix);
    MatSetSizes(_matrix, rows, rows, PETSC_DETERMINE, PETSC_DETERMINE);
    MatSetType(_matrix, type);
  }
  OwnedMatrix(const OwnedMatrix&) = delete;
  OwnedMatrix& operator=(const OwnedMatrix&) = delete;
  ~OwnedMatrix() { MatDestroy(&_matrix); }

  [[nodiscard]] PetscMatrix get() const { return _matrix; }

private:
  PetscMatrix _matrix = nullptr;
};

inline void assemble(PetscMatrix A)
{
  MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY);
  MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY);
}

/// Calls fn(row, number of entries, columns, values) for each row of this rank
template <class Fn>
void for_each_row(PetscMatrix A, Fn&& fn)
{
  PetscInt begin = 0, end = 0;
  MatGetOwnershipRange(A, &begin, &end);
  for (PetscInt row = begin; row < end; ++row)
  {
    PetscInt n = 0;
    const PetscInt* columns = nullptr;
    const PetscScalar* values = nullptr;
    MatGetRow(A, row, &n, &columns, &values);
    fn(row - begin, n, columns, values);
    MatRestoreRow(A, row, &n, &columns, &values);
  }
}

/// The rows of this rank, (rows, all columns)
inline Eigen::MatrixXd values_of(PetscMatrix A)
{
  PetscInt rows = 0, columns = 0;
  MatGetLocalSize(A, &rows, nullptr);
  MatGetSize(A, nullptr, &columns);
  Eigen::MatrixXd all = Eigen::MatrixXd::Zero(rows, columns);
  for_each_row(A,
               [&](PetscInt row, PetscInt n, const PetscInt* at,
                   const PetscScalar* values)
               {
                 for (PetscInt k = 0; k < n; ++k)
                   all(row, at[k]) = values[k];
               });
  return all;
}

/// 1 where the rows of this rank have an entry, (rows, all columns)
inline Eigen::MatrixXi pattern_of(PetscMatrix A)
{
  PetscInt rows = 0, columns = 0;
  MatGetLocalSize(A, &rows, nullptr);
  MatGetSize(A, nullptr, &columns);
  Eigen::MatrixXi all = Eigen::MatrixXi::Zero(rows, columns);
  for_each_row(
      A,
      [&](PetscInt row, PetscInt n, const PetscInt* at, const PetscScalar*)
      {
        for (PetscInt k = 0; k < n; ++k)
          all(row, at[k]) = 1;
      });
  return all;
}

/// Room for a zone and no volume. Collective
inline void make_room(PetscMatrix A, const Zone& zone, const Pattern& pattern)
{
  const std::vector<std::int32_t> offsets{0};
  const Zone* zones[] = {&zone};
  const Pattern* patterns[] = {&pattern};
  preallocate(A, offsets, {}, zones, patterns);
}

/// A matrix with room for a zone
class Room : public OwnedMatrix
{
public:
  explicit Room(const Zone& zone, MPI_Comm comm = MPI_COMM_SELF)
      : OwnedMatrix(comm, num_rows(zone))
  {
    Pattern pattern;
    pattern.extend(zone);
    make_room(get(), zone, pattern);
  }
};
} // namespace raymortar::test
