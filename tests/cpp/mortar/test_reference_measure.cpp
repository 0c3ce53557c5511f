// Lengths and areas of parts of a reference facet, and its middle.
#include "raymortar/geometry/dispatch.h"
#include "raymortar/geometry/middle.h"
#include "raymortar/mortar/reference_measure.h"
#include <gtest/gtest.h>

namespace raymortar
{
namespace
{
struct Placed
{
  int number;
  Vec<2> xi;
};

TEST(ReferenceMeasure, IsLengthOrSignedArea)
{
  const std::array<Vec<2>, 2> interval = {Vec<2>(0.25, 7.0), Vec<2>(0.75, 3.0)};
  EXPECT_EQ(reference_measure(interval), 0.5);
  std::vector<Vec<2>> polygon = {
      {0.0, 0.0}, {0.5, 0.0}, {0.75, 0.25}, {0.5, 0.5}, {0.0, 0.5}};
  EXPECT_EQ(reference_measure(polygon), 0.25 + 0.0625);
  std::vector<Placed> placed;
  for (const Vec<2>& xi : polygon)
    placed.push_back({1, xi + Vec<2>(0.25, 0.25)});
  EXPECT_EQ(reference_measure(placed, &Placed::xi), 0.25 + 0.0625);
  std::reverse(polygon.begin(), polygon.end());
  EXPECT_EQ(reference_measure(polygon), -0.25 - 0.0625);
}

TEST(ReferenceMeasure, HalvesAndThirdsMeetInTheMiddle)
{
  EXPECT_EQ((middle_of_reference<FacetType<Shape::interval, 2, 2>>()[0]), 0.5);
  const auto in_quadrilateral =
      middle_of_reference<FacetType<Shape::quadrilateral, 1, 1>>();
  EXPECT_EQ(in_quadrilateral, Vec<2>(0.5, 0.5));
  // The three parts of a triangle around its middle are alike
  const Vec<2> middle = middle_of_reference<FacetType<Shape::triangle, 1, 1>>();
  const std::array<Vec<2>, 3> corners = {Vec<2>(0.0, 0.0), Vec<2>(1.0, 0.0),
                                         Vec<2>(0.0, 1.0)};
  for (std::size_t i = 0; i < 3; ++i)
  {
    const std::array<Vec<2>, 3> part = {corners[i], corners[(i + 1) % 3],
                                        middle};
    EXPECT_NEAR(reference_measure(part), 0.5 / 3.0, 1e-16);
  }
}
} // namespace
} // namespace raymortar
