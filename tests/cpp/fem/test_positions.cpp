#include "facet_types.h"
#include "matrices.h"
#include "ranks.h"
#include "raymortar/fem/positions.h"
#include "raymortar/fem/rows.h"

using namespace raymortar;
using namespace raymortar::test;

namespace
{
template <class F>
class PositionsTest : public testing::Test
{
};

/// Adds blocks of random numbers by place; the same in a dense matrix, (rows of
/// this rank, all columns)
Eigen::MatrixXd add_blocks(const Zone& zone, PetscMatrix A,
                           BlockPositions& positions, bool by_node,
                           MPI_Comm comm = MPI_COMM_SELF)
{
  const AijArrays arrays(A);
  positions.follow(A, zone);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> number(-1, 1);
  const PetscInt n_rows = num_rows(zone), begin = n_rows * rank_of(comm);
  Eigen::MatrixXd expected =
      Eigen::MatrixXd::Zero(n_rows, n_rows * size_of(comm));
  const ContactElements& elements = zone.state().elements;
  std::vector<PetscInt> rows;
  for (std::size_t e = 0; e < elements.size(); ++e)
  {
    const Index slave = elements.slave[e], master = elements.master[e];
    element_rows(zone, slave, master, Constrained::left_out, rows);
    const std::size_t n = rows.size();
    std::vector<double> block(n * n);
    bool foreign = false;
    for (std::size_t k = 0; k < n * n; ++k)
    {
      const PetscInt row = rows[k / n], column = rows[k % n];
      const bool own = row >= begin and row < begin + n_rows;
      foreign = foreign or (row >= 0 and not own);
      if (column < 0)
        continue;
      block[k] = number(random);
      if (own)
        expected(row - begin, column) += block[k];
    }
    const auto at = positions.of(arrays, zone, slave, master);
    EXPECT_TRUE(at.known);
    EXPECT_EQ(at.has_foreign, foreign);
    const auto d = static_cast<std::size_t>(zone.input().slave.gdim);
    EXPECT_EQ(at.groups->size(), by_node ? n / d : n);
    if (at.known)
      add_block(arrays, at, rows, block.data());
  }
  return expected;
}
} // namespace

TYPED_TEST_SUITE(PositionsTest, AllFacets, );

TYPED_TEST(PositionsTest, BlocksAddUpWhereTheirRowsAre)
{
  for (const bool by_node : {true, false})
  {
    const auto plates = paired_plates<TypeParam>(by_node);
    const Zone& zone = *plates;
    const Room room(zone);
    BlockPositions positions;
    const auto expected = add_blocks(zone, room.get(), positions, by_node);
    EXPECT_EQ((values_of(room.get()) - expected).cwiseAbs().maxCoeff(), 0.0);
  }
}

TYPED_TEST(PositionsTest, PrescribedComponentsAreLeftOut)
{
  for (const bool by_node : {true, false})
  {
    const auto plates = paired_plates<TypeParam>(by_node);
    Zone& zone = *plates;
    std::vector<double> slave(zone.input().slave.rows.size(), 0.0);
    std::vector<double> master(zone.input().master.rows.size(), 0.0);
    slave[1] = slave[4] = master[2] = 1.0;
    zone.set_fixed(slave, master);
    const Room room(zone);
    BlockPositions positions;
    const auto expected = add_blocks(zone, room.get(), positions, by_node);
    EXPECT_EQ((values_of(room.get()) - expected).cwiseAbs().maxCoeff(), 0.0);
  }
}

TYPED_TEST(PositionsTest, AreLookedUpOnce)
{
  const auto plates = paired_plates<TypeParam>(false);
  const Zone& zone = *plates;
  const Room room(zone), other(zone);
  BlockPositions positions;
  const auto elements = static_cast<std::int64_t>(zone.state().elements.size());
  for (int i = 0; i < 2; ++i)
    add_blocks(zone, room.get(), positions, false);
  EXPECT_EQ(positions.lookups(), elements);
  add_blocks(zone, other.get(), positions, false);
  EXPECT_EQ(positions.lookups(), 2 * elements);
}

TYPED_TEST(PositionsTest, WithoutRoomAreUnknown)
{
  const auto plates = paired_plates<TypeParam>(false);
  const Zone& zone = *plates;
  const OwnedMatrix A(MPI_COMM_SELF, num_rows(zone));
  MatSetUp(A.get());
  assemble(A.get());
  const AijArrays arrays(A.get());
  BlockPositions positions;
  positions.follow(A.get(), zone);
  EXPECT_FALSE(positions.of(arrays, zone, 0, no_index).known);
}

TYPED_TEST(PositionsTest, AreForgottenWhenThePatternIsAnother)
{
  const auto plates = paired_plates<TypeParam>(true);
  const Zone& zone = *plates;
  const Room room(zone);
  BlockPositions positions;
  add_blocks(zone, room.get(), positions, true);
  const std::int64_t before = positions.lookups();
  // Entries everywhere: all places are others
  const PetscInt n = num_rows(zone);
  MatSetOption(room.get(), MAT_NEW_NONZERO_LOCATION_ERR, PETSC_FALSE);
  MatSetOption(room.get(), MAT_NEW_NONZERO_ALLOCATION_ERR, PETSC_FALSE);
  for (PetscInt i = 0; i < n; ++i)
    for (PetscInt j = 0; j < n; ++j)
      MatSetValue(room.get(), i, j, 0.0, ADD_VALUES);
  assemble(room.get());
  MatZeroEntries(room.get());
  const auto expected = add_blocks(zone, room.get(), positions, true);
  EXPECT_EQ((values_of(room.get()) - expected).cwiseAbs().maxCoeff(), 0.0);
  EXPECT_EQ(positions.lookups(), 2 * before);
}

TYPED_TEST(PositionsTest, AreForgottenOnDemand)
{
  const auto plates = paired_plates<TypeParam>(true);
  const Room room(*plates);
  BlockPositions positions;
  add_blocks(*plates, room.get(), positions, true);
  const std::int64_t before = positions.lookups();
  positions.forget();
  add_blocks(*plates, room.get(), positions, true);
  EXPECT_EQ(positions.lookups(), 2 * before);
}

template <class F>
class PositionsOnRanks : public testing::Test
{
};
TYPED_TEST_SUITE(PositionsOnRanks, AllFacets, );

TYPED_TEST(PositionsOnRanks, BlocksAddUpInTheRowsOfThisRank)
{
  const MPI_Comm comm = MPI_COMM_WORLD;
  for (const bool by_node : {true, false})
  {
    const auto plates = paired_plates<TypeParam>(by_node);
    spread(*plates, rank_of(comm), size_of(comm), by_node);
    const Room room(*plates, comm);
    BlockPositions positions;
    const auto expected =
        add_blocks(*plates, room.get(), positions, by_node, comm);
    EXPECT_EQ((values_of(room.get()) - expected).cwiseAbs().maxCoeff(), 0.0);
  }
}
