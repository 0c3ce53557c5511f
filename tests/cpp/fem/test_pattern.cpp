#include "facet_types.h"
#include "matrices.h"
#include "ranks.h"
#include "raymortar/fem/pattern.h"
#include "raymortar/fem/rows.h"
#include <set>

using namespace raymortar;
using namespace raymortar::test;

namespace
{
/// Both plates as one bowl, so that points between the chord of an edge and the
/// true one hit the next master
void bend(Surface& s)
{
  const auto d = static_cast<std::size_t>(s.gdim);
  for (std::size_t k = 0; k < s.X.size(); k += d)
    for (std::size_t i = 0; i + 1 < d; ++i)
      s.X[k + d - 1] += 0.3 * std::sin(1.0 + 2.0 * s.X[k + i] + 0.5 * s.X[k]);
  s.x = s.x_old = s.X;
}

std::int64_t id_of(const Zone& zone, Index master)
{
  return zone.state().master.facet_id[static_cast<std::size_t>(master)];
}

/// Slave and master facets that an integration point or a segment brings
/// together, from the points one by one
std::set<Pattern::Pair> pairs_of(const Zone& zone)
{
  const ContactState& s = zone.state();
  std::set<Pattern::Pair> pairs;
  for (std::size_t q = 0; q < s.points.size(); ++q)
    for (const Index master : {s.hits.master[q], s.points.seed[q]})
      if (master != no_index)
        pairs.emplace(s.points.slave[q], id_of(zone, master));
  return pairs;
}

/// Masters that have to do with each other at a point of a slave facet
std::set<Pattern::Coupling> couplings_of(const Zone& zone)
{
  const ContactState& s = zone.state();
  std::set<Pattern::Coupling> couplings;
  for (std::size_t q = 0; q < s.points.size(); ++q)
    if (s.hits.master[q] != no_index and s.points.seed[q] != no_index and
        s.hits.master[q] != s.points.seed[q])
    {
      const std::int64_t a = id_of(zone, s.hits.master[q]),
                         b = id_of(zone, s.points.seed[q]);
      couplings.emplace(s.points.slave[q], std::min(a, b), std::max(a, b));
    }
  return couplings;
}

template <class List>
auto set_of(const List& list)
{
  return std::set(list.begin(), list.end());
}

template <class Set>
bool includes(const Set& all, const Set& some)
{
  return std::includes(all.begin(), all.end(), some.begin(), some.end());
}

void mark(Eigen::MatrixXi& places, const std::vector<PetscInt>& block)
{
  for (const PetscInt row : block)
    for (const PetscInt column : block)
      places(row, column) = 1;
}

/// Every row of the zone with every column that its points couple it with
void mark_zone(const Zone& zone, Eigen::MatrixXi& places)
{
  const ContactState& s = zone.state();
  std::vector<PetscInt> block, other;
  for (Index f = 0; f < s.slave.num_facets(); ++f)
  {
    element_rows(zone, f, no_index, Constrained::kept, block);
    mark(places, block);
  }
  for (std::size_t q = 0; q < s.points.size(); ++q)
  {
    const Index hit = s.hits.master[q], seed = s.points.seed[q];
    for (const Index master : {hit, seed})
    {
      element_rows(zone, s.points.slave[q], master, Constrained::kept, block);
      mark(places, block);
    }
    if (hit == no_index or seed == no_index)
      continue;
    master_rows(zone, hit, Constrained::kept, block);
    master_rows(zone, seed, Constrained::kept, other);
    block.insert(block.end(), other.begin(), other.end());
    mark(places, block);
  }
}

/// Some displacement of the master along x
std::vector<double> shifted(const Zone& zone, double by)
{
  const Surface& master = zone.input().master;
  std::vector<double> u(master.rows.size(), 0.0);
  for (std::size_t k = 0; k < u.size();
       k += static_cast<std::size_t>(master.gdim))
    u[k] = by;
  return u;
}

template <class F>
class PatternTest : public testing::Test
{
};
} // namespace

TYPED_TEST_SUITE(PatternTest, AllFacets, );

TYPED_TEST(PatternTest, HoldsWhatPointsAndSegmentsBringTogether)
{
  for (const Place& place : {Place(), Place(bend)})
  {
    const auto plates = paired_plates<TypeParam>(false, place);
    const Zone& zone = *plates;
    Pattern pattern;
    EXPECT_FALSE(pattern.covers(zone));
    pattern.extend(zone);
    EXPECT_TRUE(pattern.covers(zone));
    EXPECT_EQ(set_of(pattern.pairs()), pairs_of(zone));
    EXPECT_TRUE(includes(set_of(pattern.couplings()), couplings_of(zone)));
    EXPECT_GT(pattern.pairs().size(), 2u);
  }
}

TEST(Pattern, MastersAreCoupledWherePointsOfOneHitTheOther)
{
  std::size_t found = 0;
  const auto count = [&]<class F>(F)
  {
    const auto plates = paired_plates<F>(false, bend);
    Pattern pattern;
    pattern.extend(*plates);
    found += couplings_of(*plates).size();
    EXPECT_EQ(couplings_of(*plates).empty(), pattern.couplings().empty());
    for (const auto& [slave, first, second] : pattern.couplings())
    {
      EXPECT_LT(first, second);
      const auto pairs = set_of(pattern.pairs());
      EXPECT_EQ(pairs.count({slave, first}), 1u);
      EXPECT_EQ(pairs.count({slave, second}), 1u);
    }
  };
  count(Triangle2{});
  count(Quad1{});
  count(Quad2{});
  EXPECT_GT(found, 0u);
}

TYPED_TEST(PatternTest, CoversWhatItHasRoomForAndNoMore)
{
  const auto plates = paired_plates<TypeParam>(false);
  Zone& zone = *plates;
  Pattern pattern;
  pattern.extend(zone);
  const auto room = set_of(pattern.pairs());
  int without_room = 0;
  for (const double by : {0.01, 0.3, 0.6, -0.6, 0.0})
  {
    move_master(zone, shifted(zone, by));
    const bool known = includes(room, pairs_of(zone));
    EXPECT_EQ(pattern.covers(zone), known) << by;
    without_room += known ? 0 : 1;
  }
  EXPECT_GT(without_room, 0);
  EXPECT_TRUE(pattern.covers(zone));
}

TYPED_TEST(PatternTest, FacetsThatSlideGetTheNeighboursAndKeepCandidates)
{
  const auto plates = paired_plates<TypeParam>(false);
  Zone& zone = *plates;
  Pattern pattern;
  pattern.extend(zone);
  const auto before = set_of(pattern.pairs());
  move_master(zone, shifted(zone, 0.6));
  ASSERT_FALSE(pattern.covers(zone));
  pattern.extend(zone);
  EXPECT_TRUE(pattern.covers(zone));
  const Surface& master = zone.state().master;
  const auto now = pairs_of(zone);
  std::set<Pattern::Pair> expected = now;
  const auto edges = master.neighbours.size() / master.facet_id.size();
  const auto slides = [&](Index slave)
  {
    return std::any_of(now.begin(), now.end(),
                       [&](const Pattern::Pair& p)
                       { return p.first == slave and before.count(p) == 0; });
  };
  for (std::size_t m = 0; m < master.facet_id.size(); ++m)
    for (Index slave = 0; slave < zone.state().slave.num_facets(); ++slave)
    {
      if (now.count({slave, master.facet_id[m]}) and slides(slave))
        for (std::size_t e = 0; e < edges; ++e)
          if (const Index next = master.neighbours[m * edges + e];
              next != no_index)
            expected.emplace(slave, id_of(zone, next));
      const auto near = zone.candidates().masters_of(slave);
      if (std::count(near.begin(), near.end(), static_cast<Index>(m)) > 0 and
          before.count({slave, master.facet_id[m]}))
        expected.emplace(slave, master.facet_id[m]);
    }
  EXPECT_EQ(set_of(pattern.pairs()), expected);
  EXPECT_GT(expected.size(), now.size());
}

TYPED_TEST(PatternTest, MatrixHasRoomForVolumeDiagonalAndContactAlone)
{
  const auto plates = paired_plates<TypeParam>(false, bend);
  const Zone& zone = *plates;
  Pattern pattern;
  pattern.extend(zone);
  const PetscInt n = num_rows(zone);
  // The volume's first rows, each with two columns anywhere
  std::vector<std::int32_t> offsets{0}, columns;
  Eigen::MatrixXi expected = Eigen::MatrixXi::Identity(n, n);
  for (PetscInt row = 0; row < n / 2; ++row)
  {
    for (const PetscInt column : {(7 * row) % n, (3 * row + 5) % n})
    {
      columns.push_back(column);
      expected(row, column) = 1;
    }
    offsets.push_back(static_cast<std::int32_t>(columns.size()));
  }
  mark_zone(zone, expected);
  const OwnedMatrix A(MPI_COMM_SELF, n);
  const Zone* zones[] = {&zone};
  const Pattern* patterns[] = {&pattern};
  preallocate(A.get(), offsets, columns, zones, patterns);
  const Eigen::MatrixXi found = pattern_of(A.get());
  EXPECT_EQ((found.array() < expected.array()).count(), 0);
  // Couplings are of all neighbours that a slave facet meets
  if (pattern.couplings().empty())
  {
    EXPECT_EQ(found, expected);
  }
  EXPECT_EQ(values_of(A.get()).norm(), 0.0);
  // What has no room is refused
  const Eigen::MatrixXi full = Eigen::MatrixXi::Ones(n, n);
  EXPECT_LT(found.sum(), full.sum());
}

template <class F>
class PatternOnRanks : public testing::Test
{
};
TYPED_TEST_SUITE(PatternOnRanks, AllFacets, );

TYPED_TEST(PatternOnRanks, RowsHaveTheColumnsOfAllRanks)
{
  const MPI_Comm comm = MPI_COMM_WORLD;
  const int rank = rank_of(comm), size = size_of(comm);
  const auto plates = paired_plates<TypeParam>(false);
  Zone& zone = *plates;
  const PetscInt n = num_rows(zone);
  // All ranks have the same zone, in other rows
  Eigen::MatrixXi all = Eigen::MatrixXi::Identity(n * size, n * size);
  for (int other = 0; other < size; ++other)
  {
    spread(zone, other, size, false);
    mark_zone(zone, all);
  }
  spread(zone, rank, size, false);
  const Room room(zone, comm);
  EXPECT_EQ(pattern_of(room.get()), all.middleRows(n * rank, n));
}

/// Rows of this rank whose columns are those of their group
void fill_groups(PetscMatrix A, PetscInt n, PetscInt group)
{
  const PetscInt first = n * rank_of(MPI_COMM_WORLD);
  std::vector<std::int32_t> offsets{0}, columns;
  for (PetscInt row = 0; row < n; ++row)
  {
    for (PetscInt k = 0; k < group; ++k)
      columns.push_back(
          static_cast<std::int32_t>(first + row / group * group + k));
    offsets.push_back(static_cast<std::int32_t>(columns.size()));
  }
  preallocate(A, offsets, columns, {}, {});
  for (PetscInt row = 0; row < n; ++row)
    for (PetscInt k = 0; k < group; ++k)
    {
      const PetscInt column = row / group * group + k;
      MatSetValue(A, first + row, first + column,
                  row == column ? 3.0 + row : 1.0 / (1.0 + column),
                  INSERT_VALUES);
    }
  assemble(A);
}

/// A sweep of SOR, here and back, of a right side of ones
Eigen::VectorXd relaxed(PetscMatrix A, PetscInt n)
{
  PetscVector b = nullptr, x = nullptr;
  MatCreateVecs(A, &x, &b);
  VecSet(b, 1.0);
  check(MatSOR(A, b, 1.0,
               static_cast<MatSORType>(SOR_LOCAL_SYMMETRIC_SWEEP |
                                       SOR_ZERO_INITIAL_GUESS),
               0.0, 1, 1, x),
        "MatSOR");
  const PetscScalar* values = nullptr;
  VecGetArrayRead(x, &values);
  Eigen::VectorXd found = Eigen::Map<const Eigen::VectorXd>(values, n);
  VecRestoreArrayRead(x, &values);
  VecDestroy(&x);
  VecDestroy(&b);
  return found;
}

// By the nonzero state alone a solver finds out that its factors are of another
// pattern. It has to grow with each pattern, and by no assembly between
TEST(PreallocateOnRanks, EachPatternHasALaterState)
{
  const PetscInt n = 12;
  const OwnedMatrix A(MPI_COMM_WORLD, n);
  PetscObjectState before = 0;
  for (const PetscInt group : {1, 2, 3, 2, 4, 1})
  {
    fill_groups(A.get(), n, group);
    PetscObjectState now = 0, assembled = 0;
    check(MatGetNonzeroState(A.get(), &now), "MatGetNonzeroState");
    EXPECT_GT(now, before) << group;
    check(MatZeroEntries(A.get()), "MatZeroEntries");
    assemble(A.get());
    check(MatGetNonzeroState(A.get(), &assembled), "MatGetNonzeroState");
    EXPECT_EQ(assembled, now) << group;
    before = now;
  }
}

// PETSc keeps inverses of diagonal blocks, which grow here
TEST(PreallocateOnRanks, SmoothersForgetTheFormerPattern)
{
  const PetscInt n = 60;
  const OwnedMatrix A(MPI_COMM_WORLD, n);
  for (const PetscInt group : {2, 3, 5})
  {
    fill_groups(A.get(), n, group);
    PetscMatrix copy = nullptr;
    MatDuplicate(A.get(), MAT_COPY_VALUES, &copy);
    const Eigen::VectorXd fresh = relaxed(copy, n);
    EXPECT_LE((relaxed(A.get(), n) - fresh).norm(), 1e-14 * fresh.norm())
        << "rows that share their columns: " << group;
    MatDestroy(&copy);
  }
}
