#include "facet_types.h"
#include "raymortar/fem/pattern.h"
#include "raymortar/fem/positions.h"
#include "raymortar/fem/rows.h"
#include "zones.h"
#include <Eigen/Dense>

using namespace raymortar;
using namespace raymortar::test;

namespace
{
/// A matrix with room for a zone
class Room
{
public:
  explicit Room(const Zone& zone)
  {
    const PetscInt n = num_rows(zone);
    Pattern pattern;
    pattern.extend(zone);
    const std::vector<std::int32_t> offsets{0};
    const Zone* zones[] = {&zone};
    const Pattern* patterns[] = {&pattern};
    MatCreate(MPI_COMM_SELF, &_matrix);
    MatSetSizes(_matrix, n, n, n, n);
    MatSetType(_matrix, MATAIJ);
    preallocate(_matrix, offsets, {}, zones, patterns);
  }
  Room(const Room&) = delete;
  Room& operator=(const Room&) = delete;
  ~Room() { MatDestroy(&_matrix); }

  [[nodiscard]] ::Mat matrix() const { return _matrix; }

  [[nodiscard]] Eigen::MatrixXd values() const
  {
    PetscInt n = 0;
    MatGetSize(_matrix, &n, nullptr);
    Eigen::MatrixXd all(n, n);
    for (PetscInt i = 0; i < n; ++i)
      for (PetscInt j = 0; j < n; ++j)
        MatGetValues(_matrix, 1, &i, 1, &j, &all(i, j));
    return all;
  }

private:
  ::Mat _matrix = nullptr;
};

template <class F>
class PositionsTest : public testing::Test
{
};

/// Adds blocks of random numbers by place; the same in a dense matrix
Eigen::MatrixXd add_blocks(const Zone& zone, ::Mat A, BlockPositions& positions,
                           bool by_node)
{
  const AijArrays arrays(A);
  positions.follow(A, zone);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> number(-1, 1);
  Eigen::MatrixXd expected =
      Eigen::MatrixXd::Zero(num_rows(zone), num_rows(zone));
  const ContactElements& elements = zone.state().elements;
  std::vector<PetscInt> rows;
  for (std::size_t e = 0; e < elements.size(); ++e)
  {
    const Index slave = elements.slave[e], master = elements.master[e];
    element_rows(zone, slave, master, Constrained::left_out, rows);
    const std::size_t n = rows.size();
    std::vector<double> block(n * n);
    for (std::size_t k = 0; k < n * n; ++k)
      if (rows[k % n] >= 0)
      {
        block[k] = number(random);
        if (rows[k / n] >= 0)
          expected(rows[k / n], rows[k % n]) += block[k];
      }
    const auto at = positions.of(arrays, zone, slave, master);
    EXPECT_TRUE(at.known);
    EXPECT_FALSE(at.has_foreign);
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
    const auto expected = add_blocks(zone, room.matrix(), positions, by_node);
    EXPECT_EQ((room.values() - expected).cwiseAbs().maxCoeff(), 0.0);
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
    const auto expected = add_blocks(zone, room.matrix(), positions, by_node);
    EXPECT_EQ((room.values() - expected).cwiseAbs().maxCoeff(), 0.0);
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
    add_blocks(zone, room.matrix(), positions, false);
  EXPECT_EQ(positions.lookups(), elements);
  add_blocks(zone, other.matrix(), positions, false);
  EXPECT_EQ(positions.lookups(), 2 * elements);
}

TYPED_TEST(PositionsTest, WithoutRoomAreUnknown)
{
  const auto plates = paired_plates<TypeParam>(false);
  const Zone& zone = *plates;
  const PetscInt n = num_rows(zone);
  ::Mat A = nullptr;
  MatCreateSeqAIJ(MPI_COMM_SELF, n, n, 0, nullptr, &A);
  MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY);
  MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY);
  {
    const AijArrays arrays(A);
    BlockPositions positions;
    positions.follow(A, zone);
    EXPECT_FALSE(positions.of(arrays, zone, 0, no_index).known);
  }
  MatDestroy(&A);
}
