#include "facet_types.h"
#include "petsc_session.h"
#include "raymortar/fem/halo.h"
#include "surfaces.h"
#include <limits>
#include <numeric>

using namespace raymortar;
using namespace raymortar::test;

namespace
{
constexpr double infinity = std::numeric_limits<double>::infinity();

/// Halo of one rank; global numbers are local ones times 7 plus 100
Halo fetched(const Surface& own, const std::vector<double>& box)
{
  std::vector<std::int64_t> nodes(own.X.size() /
                                  static_cast<std::size_t>(own.gdim));
  std::vector<std::int64_t> dofs(static_cast<std::size_t>(own.num_dofs()));
  for (auto* ids : {&nodes, &dofs})
    for (std::size_t k = 0; k < ids->size(); ++k)
      (*ids)[k] = 100 + 7 * static_cast<std::int64_t>(k);
  return {MPI_COMM_WORLD, own, nodes, dofs, box};
}

std::vector<double> box_of(int gdim, double lower, double upper)
{
  std::vector<double> box(static_cast<std::size_t>(gdim), lower);
  box.resize(2 * box.size(), upper);
  return box;
}

template <class F>
class HaloTest : public testing::Test
{
protected:
  static void SetUpTestSuite() { start_petsc(); }

  static Surface own()
  {
    Surface s = make_surface(
        {F::shape, F::degree, F::node_degree, 4, true},
        graph(1, [](double x, double y) { return 0.1 * x * y + 0.05 * x; }));
    // Components one after the other, as no first row would tell
    const Index n = s.num_dofs();
    for (std::size_t k = 0; k < s.rows.size(); ++k)
      s.rows[k] = n * static_cast<GlobalIndex>(k % F::gdim) +
                  static_cast<GlobalIndex>(k / F::gdim);
    for (std::size_t i = 0; i < s.x.size(); ++i)
    {
      s.x[i] += 0.01 * static_cast<double>(i % 3);
      s.x_old[i] -= 0.01 * static_cast<double>(i % 5);
    }
    for (Index f = 0; f < s.num_facets(); ++f)
      s.thickness.push_back(0.1 + f);
    return s;
  }
};
using Types = testing::Types<Interval1, Triangle2, Quad1,
                             FacetType<Shape::quadrilateral, 1, 2>>;

/// Rows of the components of one dof
std::vector<GlobalIndex> rows_of(const Surface& s, Index dof)
{
  const auto first = s.rows.begin() + dof * s.gdim;
  return {first, first + s.gdim};
}

/// Facets of both with the same id have the same positions, rows, neighbours
template <class F>
void expect_same_facets(const Surface& halo, const Surface& own)
{
  for (Index f = 0; f < halo.num_facets(); ++f)
  {
    const auto id = halo.facet_id[static_cast<std::size_t>(f)];
    const auto g = static_cast<Index>(id);
    EXPECT_EQ(halo.thickness_behind(f), own.thickness_behind(g));
    EXPECT_EQ(halo.nodes<F>(halo.X, f), own.nodes<F>(own.X, g));
    EXPECT_EQ(halo.nodes<F>(halo.x, f), own.nodes<F>(own.x, g));
    EXPECT_EQ(halo.nodes<F>(halo.x_old, f), own.nodes<F>(own.x_old, g));
    for (std::size_t a = 0; a < F::dofs; ++a)
      EXPECT_EQ(rows_of(halo, halo.dofs_of<F>(f)[a]),
                rows_of(own, own.dofs_of<F>(g)[a]));
  }
  EXPECT_EQ(halo.neighbours, find_neighbours(halo));
}
} // namespace

TYPED_TEST_SUITE(HaloTest, Types, );

TYPED_TEST(HaloTest, WholeBoxFetchesTheSurfaceAsItIs)
{
  using F = TypeParam;
  const Surface own = this->own();
  const Halo halo = fetched(own, box_of(F::gdim, -infinity, infinity));
  EXPECT_EQ(halo.surface().facet_id, own.facet_id);
  EXPECT_EQ(halo.surface().neighbours, own.neighbours);
  EXPECT_EQ(halo.surface().X.size(), own.X.size());
  EXPECT_EQ(halo.surface().rows.size(), own.rows.size());
  expect_same_facets<F>(halo.surface(), own);
  // A rank on its own has told nobody
  EXPECT_EQ(halo.facet_traffic().messages, 0);
}

TYPED_TEST(HaloTest, BoxFetchesTheFacetsThatOverlapIt)
{
  using F = TypeParam;
  const Surface own = this->own();
  auto box = box_of(F::gdim, -infinity, infinity);
  box[0] = 0.6;
  box[F::gdim] = 0.7;
  const Halo halo = fetched(own, box);
  expect_same_facets<F>(halo.surface(), own);
  const auto& got = halo.surface().facet_id;
  std::vector<GlobalIndex> expected;
  for (Index f = 0; f < own.num_facets(); ++f)
  {
    const auto nodes = own.nodes<F>(own.x, f);
    const auto x = nodes.row(0).eval();
    if (x.minCoeff() <= 0.7 and x.maxCoeff() >= 0.6)
      expected.push_back(f);
    // Curved facets leave the box of their nodes, by a part of their size
    const double room = F::node_degree == 2 ? 0.5 * diameter<F>(nodes) : 1e-6;
    if (x.minCoeff() > 0.7 + room or x.maxCoeff() < 0.6 - room)
    {
      EXPECT_EQ(std::count(got.begin(), got.end(), f), 0);
    }
  }
  EXPECT_TRUE(
      std::includes(got.begin(), got.end(), expected.begin(), expected.end()));
  EXPECT_LT(expected.size(), own.facet_id.size());
  EXPECT_GT(expected.size(), 0u);
}

TYPED_TEST(HaloTest, ValuesArriveAtTheirDofs)
{
  using F = TypeParam;
  const Surface own = this->own();
  auto box = box_of(F::gdim, -infinity, infinity);
  box[F::gdim] = -0.3;
  const Halo halo = fetched(own, box);
  for (const int width : {1, 3})
  {
    std::vector<double> values(static_cast<std::size_t>(own.num_dofs()) *
                               static_cast<std::size_t>(width));
    std::iota(values.begin(), values.end(), 0.5);
    const auto there = halo.fetch(values, width);
    const auto w = static_cast<std::size_t>(width);
    const auto dofs = static_cast<std::size_t>(halo.surface().num_dofs());
    ASSERT_EQ(there.size(), dofs * w);
    for (std::size_t k = 0; k < dofs; ++k)
    {
      // The first component's row tells the owned dof
      const auto dof =
          static_cast<std::size_t>(halo.surface().rows[k * F::gdim]);
      for (std::size_t i = 0; i < w; ++i)
        EXPECT_EQ(there[k * w + i], values[dof * w + i]);
    }
  }
}

TYPED_TEST(HaloTest, EmptyBoxFetchesNothing)
{
  using F = TypeParam;
  const Surface own = this->own();
  for (const auto& box : {box_of(F::gdim, infinity, -infinity),
                          box_of(F::gdim, 5, 6), box_of(F::gdim, 1, -1)})
  {
    const Halo halo = fetched(own, box);
    EXPECT_EQ(halo.surface().num_facets(), 0);
    EXPECT_TRUE(halo.surface().X.empty());
    const std::vector<double> values(static_cast<std::size_t>(own.num_dofs()),
                                     1.0);
    EXPECT_TRUE(halo.fetch(values, 1).empty());
  }
}

TYPED_TEST(HaloTest, EmptySurfaceHasNothingToGive)
{
  using F = TypeParam;
  Surface none = this->own();
  for (auto* array : {&none.X, &none.x, &none.x_old})
    array->clear();
  none.facet_nodes.clear();
  none.facet_dofs.clear();
  none.facet_id.clear();
  none.rows.clear();
  const Halo halo = fetched(none, box_of(F::gdim, -infinity, infinity));
  EXPECT_EQ(halo.surface().num_facets(), 0);
  EXPECT_TRUE(halo.fetch({}, 2).empty());
}
