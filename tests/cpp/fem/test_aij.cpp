#include "matrices.h"
#include "ranks.h"
#include "raymortar/fem/aij.h"
#include <gtest/gtest.h>

using namespace raymortar;
using namespace raymortar::test;

namespace
{
constexpr PetscInt rows_per_rank = 4;

/// About a third of the places, the diagonal among them
bool has_entry(PetscInt row, PetscInt column)
{
  return row == column or (7 * row + 5 * column) % 3 == 0;
}

double entry(PetscInt row, PetscInt column)
{
  return 1.0 + 100.0 * static_cast<double>(row) + static_cast<double>(column);
}

/// Rows of this rank filled
void fill(PetscMatrix A)
{
  MatSetUp(A);
  PetscInt begin = 0, end = 0, columns = 0;
  MatGetOwnershipRange(A, &begin, &end);
  MatGetSize(A, nullptr, &columns);
  for (PetscInt i = begin; i < end; ++i)
    for (PetscInt j = 0; j < columns; ++j)
      if (has_entry(i, j))
        MatSetValue(A, i, j, entry(i, j), INSERT_VALUES);
  assemble(A);
}

/// The value that a place stands for
double* at(const AijArrays& A, PetscInt row, std::int32_t place)
{
  return place >= 0 ? A.own_columns(row) + place
                    : A.other_columns(row) + (-place - 1);
}

/// Finds every entry, finds no other, and changes them in place
void expect_entries(PetscMatrix A, MPI_Comm comm)
{
  const PetscInt rank = rank_of(comm);
  const PetscInt begin = rows_per_rank * rank, end = begin + rows_per_rank;
  const PetscInt columns = rows_per_rank * size_of(comm);
  {
    const AijArrays arrays(A);
    ASSERT_TRUE(arrays.available());
    for (PetscInt j = 0; j < columns; ++j)
      EXPECT_EQ(arrays.owns(j), j >= begin and j < end);
    for (PetscInt i = begin; i < end; ++i)
      for (PetscInt j = 0; j < columns; ++j)
      {
        const std::int32_t place = arrays.find(i, j);
        ASSERT_EQ(place != AijArrays::no_entry, has_entry(i, j));
        if (not has_entry(i, j))
          continue;
        EXPECT_EQ(place >= 0, arrays.owns(j));
        EXPECT_EQ(*at(arrays, i, place), entry(i, j));
        *at(arrays, i, place) += 0.5;
      }
  }
  const Eigen::MatrixXd found = values_of(A);
  for (PetscInt i = begin; i < end; ++i)
    for (PetscInt j = 0; j < columns; ++j)
      EXPECT_EQ(found(i - begin, j), has_entry(i, j) ? entry(i, j) + 0.5 : 0.0);
}
} // namespace

TEST(Aij, EntriesAreFoundAndChangedInPlace)
{
  const OwnedMatrix A(MPI_COMM_SELF, rows_per_rank, MATSEQAIJ);
  fill(A.get());
  expect_entries(A.get(), MPI_COMM_SELF);
}

TEST(Aij, OtherTypesHaveNoArrays)
{
  for (const char* type : {MATSEQBAIJ, MATSEQDENSE, MATSEQSBAIJ})
  {
    const OwnedMatrix A(MPI_COMM_SELF, rows_per_rank, type);
    MatSetUp(A.get());
    assemble(A.get());
    EXPECT_FALSE(AijArrays(A.get()).available()) << type;
  }
}

TEST(Aij, MatrixMayBeAssembledWhileArraysAreHeld)
{
  const OwnedMatrix A(MPI_COMM_SELF, rows_per_rank, MATSEQAIJ);
  fill(A.get());
  {
    const AijArrays arrays(A.get());
    *at(arrays, 1, arrays.find(1, 1)) += 1.0;
    MatSetValue(A.get(), 1, 1, 2.0, ADD_VALUES);
    assemble(A.get());
    *at(arrays, 1, arrays.find(1, 1)) += 4.0;
  }
  EXPECT_EQ(values_of(A.get())(1, 1), entry(1, 1) + 7.0);
}

TEST(AijOnRanks, EntriesInColumnsOfAllRanksAreFoundAndChangedInPlace)
{
  start_petsc();
  const OwnedMatrix A(MPI_COMM_WORLD, rows_per_rank, MATMPIAIJ);
  fill(A.get());
  expect_entries(A.get(), MPI_COMM_WORLD);
}
