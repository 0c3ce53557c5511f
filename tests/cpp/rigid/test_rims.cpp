// Which edges of a surface of facets are its rim.
#include "cube.h"
#include "raymortar/rigid/rims.h"
#include <gtest/gtest.h>
#include <numbers>

namespace raymortar
{
namespace
{
/// Intervals around the origin, the solid inside or around them
ToolFacets ring(int n, bool hollow)
{
  ToolFacets f{Shape::interval, 1, {}, {}};
  for (int k = 0; k < n; ++k)
  {
    const double angle = 2.0 * std::numbers::pi * k / n;
    f.x.push_back(std::cos(angle));
    f.x.push_back(std::sin(angle));
    const int next = (k + 1) % n;
    f.nodes.push_back(hollow ? next : k);
    f.nodes.push_back(hollow ? k : next);
  }
  return f;
}

TEST(Rims, AreSharpConvexCorners)
{
  EXPECT_EQ(rim_boxes<2>(ring(24, false)).size(), 0u); // 15 degrees
  EXPECT_EQ(rim_boxes<2>(ring(8, false)).size(), 8u);  // 45 degrees
  EXPECT_EQ(rim_boxes<2>(ring(8, true)).size(), 0u);   // seen from inside
  EXPECT_EQ(rim_boxes<3>(cube()).size(), 12u);         // no diagonals
}

TEST(Rims, AreEdgesOfOneFacet)
{
  ToolFacets arc = ring(24, false);
  arc.nodes.resize(2 * 5);
  const auto ends = rim_boxes<2>(arc);
  ASSERT_EQ(ends.size(), 2u);
  EXPECT_EQ((ends[0].upper - ends[0].lower).norm(), 0.0);
  EXPECT_EQ(ends[0].lower, Vec<2>(1.0, 0.0));
  ToolFacets side = cube();
  side.nodes.resize(3 * 2);
  EXPECT_EQ(rim_boxes<3>(side).size(), 4u);
}

/// A parabola whose mid node is off the chord by 0.3 rises no further
TEST(Rims, HaveBoxesAroundBentEdges)
{
  ToolFacets f{Shape::triangle, 2, {}, {}};
  f.x = {0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0,  0.0,
         0.5, 0.5, 0.0, 0.0, 0.5, 0.0, 0.7, -0.3, 0.0};
  f.nodes = {0, 1, 2, 3, 4, 5};
  double lowest = 0.0, highest = 0.0;
  for (const Box<3>& box : rim_boxes<3>(f))
  {
    lowest = std::min(lowest, box.lower[1]);
    highest = std::max(highest, box.upper[1]);
  }
  EXPECT_LE(lowest, -0.3);
  EXPECT_NEAR(highest, 1.0, 1e-15);
}

TEST(Rims, AreThoseOfToolsOfFacets)
{
  const auto tool = make_facet_tool(ring(8, false));
  const FacetedTool* const found = faceted(*tool);
  ASSERT_NE(found, nullptr);
  EXPECT_TRUE(found->has_rim());
  EXPECT_TRUE(
      found->has_rim_in({Vec<3>(0.9, -0.1, 5.0), Vec<3>(1.1, 0.1, 5.0)}));
  EXPECT_FALSE(
      found->has_rim_in({Vec<3>(-0.2, -0.2, 0.0), Vec<3>(0.2, 0.2, 0.0)}));
  EXPECT_FALSE(faceted(*make_facet_tool(ring(24, false)))->has_rim());
  Freedom freedom;
  freedom.rates.resize(1);
  EXPECT_EQ(faceted(*with_freedom(tool, freedom)), found);
}
} // namespace
} // namespace raymortar
