// Tools of facets against the closed forms that they stand for.
#include "cast.h"
#include "cube.h"
#include "raymortar/core/error.h"
#include "raymortar/rigid/facet_tool.h"
#include "raymortar/rigid/shapes.h"
#include <gtest/gtest.h>
#include <numbers>
#include <random>

namespace raymortar
{
namespace
{
/// A ring around the origin, counter-clockwise
std::shared_ptr<const Tool> ring(int n, int degree, double radius)
{
  ToolFacets f{Shape::interval, degree, {}, {}};
  const int count = n * degree;
  for (int k = 0; k < count; ++k)
  {
    const double angle = 2.0 * std::numbers::pi * k / count;
    f.x.push_back(radius * std::cos(angle));
    f.x.push_back(radius * std::sin(angle));
  }
  for (int k = 0; k < n; ++k)
  {
    f.nodes.push_back(k * degree);
    f.nodes.push_back((k + 1) * degree % count);
    if (degree == 2)
      f.nodes.push_back(2 * k + 1);
  }
  return make_facet_tool(f);
}

TEST(FacetTool, OfARingIsACircle)
{
  std::mt19937 random(3);
  std::uniform_real_distribution<double> number(-1.5, 1.5);
  const auto exact = make_sphere(Vec<3>::Zero(), 1.0, {});
  for (const int degree : {1, 2})
  {
    const auto facets = ring(200, degree, 1.0);
    const double gate = degree == 1 ? 2e-2 : 2e-4;
    int found = 0;
    for (int k = 0; k < 300; ++k)
    {
      const ToolRay ray{
          {number(random), number(random), 0.0},
          Vec<3>(number(random), number(random), 0.0).normalized()};
      const ToolHit a = cast(*exact, ray), b = cast(*facets, ray);
      if (std::abs(exact->distance(ray.x)) < 1e-2)
        continue;
      EXPECT_EQ(facets->distance(ray.x) < 0.0, exact->distance(ray.x) < 0.0);
      // Obliquely, chords lie elsewhere along the ray
      if (not a.found or std::abs(a.normal.dot(ray.n)) < 0.3)
        continue;
      ASSERT_TRUE(b.found);
      EXPECT_NEAR(a.g, b.g, gate);
      EXPECT_LT((a.normal - b.normal).norm(), gate);
      // In the plane
      Mat<2, 2> bend = b.bend.topLeftCorner<2, 2>();
      if (degree == 2)
        bend -= a.bend.topLeftCorner<2, 2>();
      EXPECT_LT(bend.norm(), 0.02);
      ++found;
    }
    EXPECT_GT(found, 60);
  }
}

TEST(FacetTool, OfACubeHasItsFaces)
{
  const auto tool = make_facet_tool(cube());
  const Vec<3> down(0.0, 0.0, -1.0);
  const ToolHit above = cast(*tool, {{0.3, 0.4, 1.25}, down});
  ASSERT_TRUE(above.found);
  EXPECT_NEAR(above.g, 0.25, 1e-15);
  EXPECT_NEAR(above.normal[2], 1.0, 1e-15);
  EXPECT_EQ(above.bend.norm(), 0.0);
  const ToolHit inside = cast(*tool, {{0.3, 0.4, 0.9}, down});
  ASSERT_TRUE(inside.found);
  EXPECT_NEAR(inside.g, -0.1, 1e-15);
  // Behind it, and beside it
  EXPECT_FALSE(cast(*tool, {{0.3, 0.4, -0.1}, down}).found);
  EXPECT_FALSE(cast(*tool, {{1.3, 0.4, 1.1}, down}).found);
  EXPECT_LT(tool->distance({0.5, 0.5, 0.4}), 0.0);
  EXPECT_GT(tool->distance({0.5, 0.5, 1.4}), 0.0);
}

TEST(FacetTool, OnEdgesIsMet)
{
  const auto tool = make_facet_tool(cube());
  const Vec<3> down(0.0, 0.0, -1.0);
  for (const double x : {0.25, 0.5, 0.75}) // on the diagonal of a face
    EXPECT_TRUE(cast(*tool, {{x, x, 1.5}, down}).found);
}

TEST(FacetTool, WhatIsBesideAnOpenFaceIsNotBehindIt)
{
  // Unit squares in x and y that face downwards: a solid above them
  const auto face = make_facet_tool({Shape::quadrilateral,
                                     1,
                                     {0, 0, 0, 0, 1, 0, 1, 0, 0, 1, 1, 0},
                                     {0, 1, 2, 3}});
  EXPECT_DOUBLE_EQ(face->distance({0.3, 0.6, 0.2}), -0.2);
  EXPECT_DOUBLE_EQ(face->distance({0.3, 0.6, -0.2}), 0.2);
  EXPECT_GT(face->distance({1.3, 0.6, 0.2}), 0.0);
  EXPECT_GT(face->distance({1.3, 0.6, -0.2}), 0.0);
  // A half circle of straight facets, open on its right
  ToolFacets half{Shape::interval, 1, {}, {}};
  for (int k = 0; k <= 8; ++k)
  {
    const double angle = M_PI * (0.5 + k / 8.0);
    half.x.insert(half.x.end(), {std::cos(angle), std::sin(angle)});
    if (k > 0)
      half.nodes.insert(half.nodes.end(), {k - 1, k});
  }
  const auto bow = make_facet_tool(std::move(half));
  EXPECT_LT(bow->distance({-0.5, 0.0, 0.0}), 0.0);
  EXPECT_LT(bow->distance({0.5, 0.5, 0.0}), 0.0);
  EXPECT_GT(bow->distance({-1.5, 0.0, 0.0}), 0.0);
  EXPECT_GT(bow->distance({0.5, 1.5, 0.0}), 0.0);
}

TEST(FacetTool, OfDegreeThreeIsRefused)
{
  EXPECT_THROW((void)make_facet_tool({Shape::triangle, 3, {}, {}}), Error);
}
} // namespace
} // namespace raymortar
