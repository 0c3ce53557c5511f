// Slave facets below tools of facets, against the same facets as a master.
#include "raymortar/mortar/tool_cutter.h"
#include "raymortar/mortar/tool_rays.h"
#include "raymortar/rigid/facet_tool.h"
#include "raymortar/rigid/shapes.h"
#include "rules.h"
#include "surfaces.h"
#include <Eigen/Geometry>
#include <gtest/gtest.h>

namespace raymortar::test
{
namespace
{
struct Kinds
{
  Shape slave;
  Shape tool;
  int degree; ///< of the tool
};

class RimSegmentsOf : public testing::TestWithParam<Kinds>
{
protected:
  RimSegmentsOf()
  {
    const auto [shape, kind, degree] = GetParam();
    slave = make_surface({shape, 1, 1, 12, true},
                         graph(1.0, [](double x, double y)
                               { return 0.02 * std::sin(2.0 * x + y); }));
    // A plate that ends inside slave facets, made somewhere else
    Surface plate = make_surface({kind, degree, degree, 3, false},
                                 graph(0.57, [](double x, double y)
                                       { return 0.03 * x * x - 0.02 * y; }));
    master = plate;
    const auto d = static_cast<Eigen::Index>(slave.gdim);
    PlacedTool tool;
    tool.now.rotation =
        Eigen::AngleAxisd(0.7, Vec<3>::Unit(2)).toRotationMatrix();
    tool.now.shift = Vec<3>(0.3, -0.2, d == 2 ? 0.0 : 0.4);
    tool.old = tool.now;
    for (std::size_t k = 0; k < plate.X.size(); k += slave.gdim)
    {
      Vec<3> x = Vec<3>::Zero();
      x.head(d) = Eigen::Map<const Eigen::VectorXd>(plate.X.data() + k, d);
      Eigen::Map<Eigen::VectorXd>(plate.X.data() + k, d) =
          tool.now.origin(x).head(d);
    }
    tool.tool = make_facet_tool({kind, degree, plate.X, plate.facet_nodes});
    tools = {tool};
  }

  Surface slave, master;
  std::vector<PlacedTool> tools;
  FacetDistances range{0.2, 0.2};
};

TEST_P(RimSegmentsOf, AreThoseBelowAMaster)
{
  ASSERT_NE(nullptr, cutter_of(tools));
  const ToolSegments found =
      cutter_of(tools)->cut(slave, tools, range, false, true);
  const Segmentation expected = make_segments(
      slave, master, find_candidates(slave, master, range), {range, false});
  ASSERT_EQ(found.above.size(), expected.covered.size());
  int whole = 0, partly = 0;
  for (std::size_t f = 0; f < found.above.size(); ++f)
  {
    EXPECT_NEAR(found.segmentation.covered[f], expected.covered[f], 1e-10);
    whole += found.above[f] == Above::inside ? 1 : 0;
    const double share = expected.covered[f];
    partly += share > 0.01 and share < 0.99 ? 1 : 0;
    if (found.above[f] == Above::nothing)
    {
      EXPECT_EQ(found.segmentation.covered[f], 0.0);
    }
  }
  EXPECT_GT(whole, 0);
  EXPECT_GT(partly, 1);
}

TEST_P(RimSegmentsOf, HaveRaysThatHit)
{
  const Shape shape = slave.shape;
  const ToolSegments found =
      cutter_of(tools)->cut(slave, tools, range, false, true);
  const IntegrationPoints points =
      make_points(slave, found.segmentation, segment_rules(shape, 4),
                  rule_on(shape, 4), true);
  const Hits hits = cast_on_tools(slave, tools, points, range);
  double area = 0.0, uncovered = 0.0, expected = 0.0;
  for (std::size_t q = 0; q < points.size(); ++q)
  {
    const bool covered = points.seed[q] != no_index;
    EXPECT_EQ(hits.status[q] == RayStatus::hit, covered);
    (covered ? area : uncovered) += points.area[q];
  }
  for (const double whole : points.whole)
    expected += whole;
  EXPECT_NEAR(area + uncovered, expected, 1e-12);
  EXPECT_GT(area, 0.5);
}

TEST_P(RimSegmentsOf, MoveWithTheirOwnFacets)
{
  const ToolSegments found =
      cutter_of(tools)->cut(slave, tools, range, false, true);
  const Segmentation& s = found.segmentation;
  for (const Segment& one : s.segments)
  {
    const bool at_rim =
        found.above[static_cast<std::size_t>(one.slave)] == Above::rim;
    bool moves = false;
    for (std::int32_t v = one.begin; v < one.begin + one.size; ++v)
      moves = moves or s.breaks[static_cast<std::size_t>(v)].motion !=
                           Break::Motion::fixed;
    EXPECT_TRUE(at_rim or not moves);
    EXPECT_TRUE(not at_rim or one.master < found.facets.num_facets());
  }
  for (const Index tool : found.facets.body)
    EXPECT_EQ(tool, 0);
}

INSTANTIATE_TEST_SUITE_P(
    Kinds, RimSegmentsOf,
    testing::Values(Kinds{Shape::interval, Shape::interval, 1},
                    Kinds{Shape::interval, Shape::interval, 2},
                    Kinds{Shape::triangle, Shape::triangle, 1},
                    Kinds{Shape::triangle, Shape::quadrilateral, 2},
                    Kinds{Shape::quadrilateral, Shape::triangle, 2},
                    Kinds{Shape::quadrilateral, Shape::quadrilateral, 1}));

TEST(RimSegments, AreForToolsOfOneKindWithARim)
{
  const auto strip = [](int degree, int n)
  {
    const Surface s = make_surface({Shape::interval, degree, degree, n, false},
                                   plate(0.5, 0.0));
    return PlacedTool{
        make_facet_tool({Shape::interval, degree, s.X, s.facet_nodes}), {}, {}};
  };
  const PlacedTool one = strip(1, 1), many = strip(1, 3), bent = strip(2, 1);
  const PlacedTool ball{make_sphere({0.0, 3.0, 0.0}, 1.0, {}), {}, {}};
  EXPECT_NE(nullptr, cutter_of(std::vector{one}));
  EXPECT_NE(nullptr, cutter_of(std::vector{one, many}));
  EXPECT_EQ(nullptr, cutter_of(std::vector{one, bent}));
  EXPECT_EQ(nullptr, cutter_of(std::vector{one, ball}));
  EXPECT_EQ(nullptr, cutter_of(std::vector{ball}));
  EXPECT_EQ(nullptr, cutter_of(std::vector<PlacedTool>{}));
}

/// A channel whose other arm faces the slave from behind: no ray enters there
TEST(RimSegments, AreNotBelowWhatNoRayMeets)
{
  const Surface slave =
      make_surface({Shape::interval, 1, 1, 4, true}, plate(0.5, 0.0));
  // Above: a face over the left part; below: a plate, its own under side
  // towards the slave's normal
  ToolFacets f{Shape::interval, 1, {}, {}};
  f.x = {-0.5, 0.1, 0.1, 0.1, -0.5, -0.2, 0.5, -0.2, 0.5, -0.1, -0.5, -0.1};
  f.nodes = {0, 1, 2, 3, 3, 4, 4, 5, 5, 2};
  const std::vector tools{PlacedTool{make_facet_tool(f), {}, {}}};
  const ToolSegments found =
      cutter_of(tools)->cut(slave, tools, {0.5, 0.5}, false, true);
  double covered = 0.0;
  for (const double share : found.segmentation.covered)
    covered += 0.25 * share;
  EXPECT_NEAR(covered, 0.6, 1e-12);
}
} // namespace
} // namespace raymortar::test
