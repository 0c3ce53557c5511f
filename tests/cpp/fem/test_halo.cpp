#include "facet_types.h"
#include "ranks.h"
#include "raymortar/fem/halo.h"
#include <limits>
#include <map>
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
  return {MPI_COMM_SELF, own, nodes, dofs, box};
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

namespace
{
/// The facets of a surface that one rank owns, with nodes and dofs of its own
struct Share
{
  Surface surface;
  std::vector<std::int64_t> node_ids, dof_ids;

  Share(const Surface& all, int rank, int size)
  {
    surface.shape = all.shape;
    surface.degree = all.degree;
    surface.node_degree = all.node_degree;
    surface.gdim = all.gdim;
    for (Index f = 0; f < all.num_facets(); ++f)
      if (f / 3 % size == rank)
        add(all, f);
  }

private:
  static Index number(std::vector<std::int64_t>& ids, Index global)
  {
    const auto at = std::find(ids.begin(), ids.end(), global);
    const auto local = at - ids.begin();
    if (at == ids.end())
      ids.push_back(global);
    return static_cast<Index>(local);
  }

  void add(const Surface& all, Index f)
  {
    const int d = all.gdim;
    for (int a = 0; a < all.nodes_per_facet(); ++a)
    {
      const Index node = all.facet_nodes[f * all.nodes_per_facet() + a];
      const std::size_t before = node_ids.size();
      surface.facet_nodes.push_back(number(node_ids, node));
      if (node_ids.size() == before)
        continue;
      for (auto [from, to] : {std::pair{&all.X, &surface.X},
                              {&all.x, &surface.x},
                              {&all.x_old, &surface.x_old}})
        to->insert(to->end(), from->begin() + d * node,
                   from->begin() + d * (node + 1));
    }
    for (int a = 0; a < all.dofs_per_facet(); ++a)
    {
      const Index dof = all.facet_dofs[f * all.dofs_per_facet() + a];
      const std::size_t before = dof_ids.size();
      surface.facet_dofs.push_back(number(dof_ids, dof));
      if (dof_ids.size() > before)
        surface.rows.insert(surface.rows.end(), all.rows.begin() + d * dof,
                            all.rows.begin() + d * (dof + 1));
    }
    surface.facet_id.push_back(all.facet_id[f]);
    surface.thickness.push_back(all.thickness[f]);
    surface.body.push_back(f % 2);
  }
};

/// Local numbers of facets by their global ones
std::map<GlobalIndex, Index> numbers_of(const Surface& s)
{
  std::map<GlobalIndex, Index> local;
  for (Index f = 0; f < s.num_facets(); ++f)
    local[s.facet_id[f]] = f;
  return local;
}

/// Global numbers of the neighbours of a facet
std::vector<GlobalIndex> neighbours_of(const Surface& s, Index facet)
{
  const auto edges = static_cast<Index>(s.neighbours.size()) / s.num_facets();
  std::vector<GlobalIndex> ids;
  for (Index e = 0; e < edges; ++e)
  {
    const Index next = s.neighbours[facet * edges + e];
    ids.push_back(next == no_index ? no_index : s.facet_id[next]);
  }
  return ids;
}

template <class F>
class HaloOnRanks : public HaloTest<F>
{
protected:
  HaloOnRanks() : _rank(rank_of(MPI_COMM_WORLD)), _size(size_of(MPI_COMM_WORLD))
  {
  }

  /// A strip across the plate for each rank, the last of which want none
  [[nodiscard]] std::vector<double> wanted() const
  {
    auto box = box_of(F::gdim, -infinity, infinity);
    box[0] = -0.8 + 0.3 * _rank;
    box[F::gdim] = box[0] + (_rank < 3 ? 0.5 : -1.0);
    return box;
  }

  int _rank, _size;
};
} // namespace

TYPED_TEST_SUITE(HaloOnRanks, Types, );

TYPED_TEST(HaloOnRanks, FacetsOfAllRanksAreThoseThatOneRankWouldFetch)
{
  using F = TypeParam;
  const Surface all = this->own();
  const Share share(all, this->_rank, this->_size);
  const auto box = this->wanted();
  const Halo halo(MPI_COMM_WORLD, share.surface, share.node_ids, share.dof_ids,
                  box);
  const Share whole(all, 0, 1);
  const Halo alone(MPI_COMM_SELF, whole.surface, whole.node_ids, whole.dof_ids,
                   box);
  const Surface &found = halo.surface(), &expected = alone.surface();
  const auto numbers = numbers_of(found);
  ASSERT_EQ(found.num_facets(), expected.num_facets());
  EXPECT_EQ(found.X.size(), expected.X.size());
  EXPECT_EQ(found.rows.size(), expected.rows.size());
  for (Index f = 0; f < expected.num_facets(); ++f)
  {
    ASSERT_EQ(numbers.count(expected.facet_id[f]), 1u);
    const Index g = numbers.at(expected.facet_id[f]);
    EXPECT_EQ(found.nodes<F>(found.X, g), expected.nodes<F>(expected.X, f));
    EXPECT_EQ(found.nodes<F>(found.x, g), expected.nodes<F>(expected.x, f));
    EXPECT_EQ(found.nodes<F>(found.x_old, g),
              expected.nodes<F>(expected.x_old, f));
    EXPECT_EQ(found.thickness[g], expected.thickness[f]);
    EXPECT_EQ(found.body_of(g), expected.body_of(f));
    EXPECT_EQ(neighbours_of(found, g), neighbours_of(expected, f));
    for (std::size_t a = 0; a < F::dofs; ++a)
      EXPECT_EQ(rows_of(found, found.dofs_of<F>(g)[a]),
                rows_of(expected, expected.dofs_of<F>(f)[a]));
  }
}

TYPED_TEST(HaloOnRanks, ValuesOfAllRanksArriveAtTheirDofs)
{
  using F = TypeParam;
  const Surface all = this->own();
  const Share share(all, this->_rank, this->_size);
  const Halo halo(MPI_COMM_WORLD, share.surface, share.node_ids, share.dof_ids,
                  this->wanted());
  constexpr int width = 2;
  std::vector<double> own;
  for (const std::int64_t id : share.dof_ids)
    for (int i = 0; i < width; ++i)
      own.push_back(10.0 * static_cast<double>(id) + i);
  const auto found = halo.fetch(own, width);
  const Surface& s = halo.surface();
  ASSERT_EQ(found.size(), static_cast<std::size_t>(width * s.num_dofs()));
  for (Index dof = 0; dof < s.num_dofs(); ++dof)
    for (int i = 0; i < width; ++i)
      // The first component's row tells the global dof
      EXPECT_EQ(found[width * dof + i],
                10.0 * static_cast<double>(s.rows[F::gdim * dof]) + i);
}
