#include "facet_types.h"
#include "raymortar/pairing/surface.h"
#include "surfaces.h"

using namespace raymortar;
using namespace raymortar::test;

namespace
{
const std::vector<Grid> grids = {{Shape::interval, 1, 1, 4, true},
                                 {Shape::interval, 1, 2, 4, false},
                                 {Shape::interval, 2, 2, 4, true},
                                 {Shape::triangle, 1, 1, 4, true},
                                 {Shape::triangle, 1, 2, 4, false},
                                 {Shape::triangle, 2, 2, 4, true},
                                 {Shape::quadrilateral, 1, 1, 4, true},
                                 {Shape::quadrilateral, 1, 2, 4, false},
                                 {Shape::quadrilateral, 2, 2, 4, true}};

/// Both facets at an edge know each other, and the edge's nodes are shared
template <class F>
void expect_neighbours(const Surface& s)
{
  int rim = 0;
  for (Index f = 0; f < s.num_facets(); ++f)
    for (int e = 0; e < F::Ref::edges; ++e)
    {
      const auto end = [&](Index facet, int k)
      {
        const auto c = static_cast<std::size_t>(k % F::Ref::corners);
        return s.facet_nodes[facet * F::nodes + F::Ref::cycle[c]];
      };
      const Index next = s.neighbours[f * F::Ref::edges + e];
      rim += next == no_index ? 1 : 0;
      int back = 0;
      for (int k = 0; next != no_index and k < F::Ref::edges; ++k)
        if (s.neighbours[next * F::Ref::edges + k] == f)
        {
          ++back;
          EXPECT_EQ(end(next, F::tdim == 1 ? k : k + 1), end(f, e));
        }
      EXPECT_EQ(back, next == no_index ? 0 : 1);
    }
  EXPECT_EQ(rim, F::tdim == 1 ? 2 : 16);
}

template <class F>
void expect_up(const Surface& s, bool up)
{
  for (Index f = 0; f < s.num_facets(); ++f)
  {
    const auto frame =
        frame_at<F>(s.nodes<F>(s.x, f), F::RefPoint::Constant(0.3));
    EXPECT_NEAR(frame.n[F::gdim - 1], up ? 1 : -1, 1e-14);
  }
}

/// Quadratic facets of a graph, displaced by a quadratic or linear field
Vec<3> field(double s, double t, int degree)
{
  const double x = 2 * s - 1, y = 2 * t - 1;
  return degree == 1 ? Vec<3>(0.1 * x - 0.2 * y, 0.3 * x, 0.2 + x + y)
                     : Vec<3>(0.1 * x * x, x * y, y * y - x);
}
} // namespace

TEST(Surface, FacetsFaceTheSideThatIsAskedFor)
{
  for (const Grid& grid : grids)
    with_facet_type(grid,
                    [&]<class F>(F) {
                      expect_up<F>(make_surface(grid, plate(1, 0)), grid.up);
                    });
}

TEST(Surface, NeighboursKnowEachOtherAcrossTheSharedEdge)
{
  for (const Grid& grid : grids)
    with_facet_type(grid, [&]<class F>(F)
                    { expect_neighbours<F>(make_surface(grid, plate(1, 0))); });
}

TEST(Surface, EdgeOfThreeFacetsHasNoNeighbour)
{
  Surface s = make_surface({Shape::triangle, 1, 1, 1, true}, plate(1, 0));
  ASSERT_EQ(s.num_facets(), 2);
  EXPECT_EQ(std::count(s.neighbours.begin(), s.neighbours.end(), no_index), 4);
  // A fin on the diagonal
  s.X.insert(s.X.end(), {0, 0, 1});
  s.facet_nodes.insert(s.facet_nodes.end(), {1, 2, 4});
  s.facet_id.push_back(2);
  s.neighbours = find_neighbours(s);
  ASSERT_EQ(s.neighbours.size(), 9u);
  EXPECT_EQ(std::count(s.neighbours.begin(), s.neighbours.end(), no_index), 9);
}

TEST(Surface, EmptySurfaceHasNeitherNeighboursNorSize)
{
  Surface s;
  EXPECT_TRUE(find_neighbours(s).empty());
  EXPECT_EQ(largest_diameter(s, s.X), 0);
  EXPECT_TRUE(displaced(s, {}).empty());
}

TEST(Surface, DisplacementOfLowerDegreeMovesTheMidNodesToo)
{
  // A linear field is in every displacement space, a quadratic one in P2
  for (const Grid& grid : grids)
  {
    const Map map = graph(1, [](double x, double y) { return x * x - y; });
    const bool line = grid.shape == Shape::interval;
    const auto u =
        make_surface({grid.shape, grid.degree, grid.degree, grid.n, grid.up},
                     [&](double s, double t)
                     { return field(s, line ? 0 : t, grid.degree); });
    const auto expected =
        make_surface(grid,
                     [&](double s, double t) -> Vec<3> {
                       return map(s, t) + field(s, line ? 0 : t, grid.degree);
                     });
    const auto x = displaced(make_surface(grid, map), u.X);
    ASSERT_EQ(x.size(), expected.X.size());
    for (std::size_t i = 0; i < x.size(); ++i)
      EXPECT_NEAR(x[i], expected.X[i], 4e-16 * 4);
  }
}

TEST(Surface, LargestDiameterIsThatOfTheLargestFacet)
{
  Surface s = make_surface({Shape::quadrilateral, 2, 2, 4, true}, plate(1, 0));
  EXPECT_NEAR(largest_diameter(s, s.X), std::sqrt(0.5), 1e-15);
  s.x[0] -= 1;
  EXPECT_NEAR(largest_diameter(s, s.x), std::hypot(1.5, 0.5), 1e-15);
}

TEST(Surface, UnknownDegreesAreRefused)
{
  for (const auto& [degree, nodes] : {std::pair{3, 3}, {2, 1}, {0, 1}})
    EXPECT_THROW(
        make_surface({Shape::triangle, degree, nodes, 1, true}, plate(1, 0)),
        Error);
}
