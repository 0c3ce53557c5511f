// Points that tools have passed, and those that are beside a tool.
#include "raymortar/mortar/penetrating_points.h"
#include "raymortar/mortar/tool_rays.h"
#include "raymortar/rigid/facet_tool.h"
#include "raymortar/rigid/shapes.h"
#include "surfaces.h"
#include <gtest/gtest.h>
#include <numbers>

using namespace raymortar;
using namespace raymortar::test;

namespace
{
constexpr double height = 1.2, dent = 0.5, hole = 0.01;

/// Half of the section of a block of radius 1 with a round dent below: radius
/// and height along the dent, the rest of the bottom, the side and the top. A
/// small hole keeps facets from degenerating
Vec<2> section(double t)
{
  const double part = std::fmod(4.0 * t, 1.0);
  const double angle = hole + (0.5 * std::numbers::pi - hole) * part;
  if (t < 0.25)
    return dent * Vec<2>(std::sin(angle), std::cos(angle));
  if (t < 0.5)
    return {dent + (1.0 - dent) * part, 0.0};
  if (t < 0.75)
    return {1.0, height * part};
  return {t < 1.0 ? 1.0 - part : hole, height};
}

Surface dented_block(Shape shape)
{
  const bool is_plane = shape == Shape::interval;
  Surface s = make_surface(
      {shape, 1, 1, 48, not is_plane},
      [=](double turn, double t)
      {
        const Vec<2> p = section(is_plane ? std::abs(2.0 * turn - 1.0) : t);
        const double angle = 2.0 * std::numbers::pi * turn;
        return is_plane ? Vec<3>(turn < 0.5 ? -p[0] : p[0], 0.0, p[1])
                        : Vec<3>(p[0] * std::cos(angle), p[0] * std::sin(angle),
                                 p[1]);
      });
  s.thickness.assign(s.facet_id.size(), 2.0);
  return s;
}

/// Heights of the facets that a ball has passed, ascending. A ball in 2D is a
/// circle
std::vector<double> passed_by_ball(const Surface& s, double up, double radius,
                                   const Tool* body)
{
  Vec<3> centre = Vec<3>::Zero();
  centre[s.gdim - 1] = up;
  const PlacedTool ball{make_sphere(centre, radius, {}), {}, {}};
  IntegrationPoints points;
  for (Index f = 0; f < s.num_facets(); ++f)
  {
    points.slave.push_back(f);
    points.xi.emplace_back(s.shape == Shape::quadrilateral ? 0.5 : 0.3, 0.4);
    points.seed.push_back(0);
  }
  const FacetDistances range(1.0, 1.0);
  const std::vector<PlacedTool> tools = {ball};
  const Hits hits = cast_on_tools(s, tools, points, range);
  std::vector<double> heights;
  for (const Index q :
       find_points_inside_tools(s, tools, points, hits, range, body))
  {
    const auto node = static_cast<std::size_t>(
        s.facet_nodes[static_cast<std::size_t>(points.slave[q]) *
                      static_cast<std::size_t>(s.nodes_per_facet())]);
    const auto d = static_cast<std::size_t>(s.gdim);
    heights.push_back(s.x[node * d + d - 1]);
  }
  std::sort(heights.begin(), heights.end());
  return heights;
}

class PenetratingPoints : public testing::TestWithParam<Shape>
{
};
} // namespace

/// The facets of the dent are chords of the ball, and a little inside. Rays
/// from the sides of the block go through its skirt, out into the dent
TEST_P(PenetratingPoints, AreNotBesideToolsInDents)
{
  const Surface s = dented_block(GetParam());
  const auto body =
      make_facet_tool({s.shape, s.node_degree, s.x, s.facet_nodes});
  for (const double up : {-0.05, 0.0, 0.005})
    EXPECT_TRUE(passed_by_ball(s, up, dent, body.get()).empty()) << up;
}

/// A ball within the block, whose top it has passed
TEST_P(PenetratingPoints, AreAboveToolsInTheBody)
{
  const Surface s = dented_block(GetParam());
  const auto body =
      make_facet_tool({s.shape, s.node_degree, s.x, s.facet_nodes});
  for (const Tool* one : {static_cast<const Tool*>(nullptr), body.get()})
  {
    const auto heights = passed_by_ball(s, 0.85, 0.3, one);
    ASSERT_FALSE(heights.empty());
    EXPECT_DOUBLE_EQ(heights.back(), height);
  }
}

INSTANTIATE_TEST_SUITE_P(Shapes, PenetratingPoints,
                         testing::Values(Shape::interval, Shape::triangle,
                                         Shape::quadrilateral));
