// Rays on closed-form tools against their distances: hits, entries, normals and
// how these change.
#include "cast.h"
#include "raymortar/rigid/shapes.h"
#include <Eigen/Geometry>
#include <gtest/gtest.h>
#include <optional>
#include <random>

namespace raymortar
{
namespace
{
struct Named
{
  const char* name;
  std::shared_ptr<const Tool> tool;
};

std::vector<Named> tools()
{
  const Vec<3> c(0.1, -0.2, 0.3), axis(1.0, 2.0, -0.5);
  return {{"plane", make_plane(c, axis)},
          {"sphere", make_sphere(c, 0.8, {})},
          {"hollow sphere", make_sphere(c, 0.8, {true})},
          {"cylinder", make_cylinder(c, axis, 0.6, {})},
          {"bore", make_cylinder(c, axis, 0.6, {true})},
          {"cone", make_cone(c, axis, 0.7, {})},
          {"blunt cone", make_cone(c, axis, 1.4, {})},
          {"seat", make_cone(c, axis, 0.7, {true})},
          {"torus", make_torus(c, axis, 0.9, 0.3, {})},
          {"hollow torus", make_torus(c, axis, 0.9, 0.3, {true})}};
}

class Rays
{
public:
  explicit Rays(unsigned seed) : _random(seed) {}

  ToolRay operator()() { return {vector(1.5), vector(1.0).normalized()}; }

private:
  Vec<3> vector(double size)
  {
    std::uniform_real_distribution<double> number(-size, size);
    const double x = number(_random), y = number(_random), z = number(_random);
    return {x, y, z};
  }

  std::mt19937 _random;
};

/// The entry that small steps along the ray find: behind for points inside,
/// ahead for the others; none where the first crossing is an exit, or none
std::optional<double> entry_by_steps(const Tool& tool, const ToolRay& ray)
{
  constexpr double pace = 2e-3, far = 8.0;
  const auto inside = [&](double g)
  { return tool.distance(ray.x + g * ray.n) < 0.0; };
  const bool is_inside = inside(0.0);
  const double way = is_inside ? -pace : pace;
  for (int k = 1; std::abs(k * way) < far; ++k)
    if (inside(k * way) != is_inside)
      return (k - 0.5) * way;
  return {};
}

/// The cone's distance is that of a double cone's flank beyond its tip
bool is_beyond_tip(const Named& one, const Vec<3>& x)
{
  const std::string name = one.name;
  const bool is_cone = name.find("cone") != std::string::npos or name == "seat";
  const Vec<3> tip(0.1, -0.2, 0.3), axis(1.0, 2.0, -0.5);
  return is_cone and (x - tip).dot(axis) < 0.1;
}

class ClosedForms : public testing::TestWithParam<Named>
{
};

TEST_P(ClosedForms, RaysEnterWhereSmallStepsDo)
{
  const Tool& tool = *GetParam().tool;
  Rays rays(3);
  int found = 0;
  for (int k = 0; k < 400; ++k)
  {
    const ToolRay ray = rays();
    const auto expected = entry_by_steps(tool, ray);
    const ToolHit hit = cast(tool, ray);
    if (std::abs(tool.distance(ray.x)) < 0.01 or
        (hit.found and is_beyond_tip(GetParam(), ray.x + hit.g * ray.n)))
      continue;
    if (not hit.found)
    {
      EXPECT_TRUE(not expected or
                  is_beyond_tip(GetParam(), ray.x + *expected * ray.n));
      continue;
    }
    EXPECT_EQ(hit.g < 0.0, tool.distance(ray.x) < 0.0);
    // Steps end somewhere, and pass over the chord of a ray that only grazes
    if (std::abs(hit.g) > 7.0 or std::abs(hit.normal.dot(ray.n)) < 0.2)
      continue;
    ASSERT_TRUE(expected);
    EXPECT_NEAR(hit.g, *expected, 2e-3);
    ++found;
  }
  EXPECT_GT(found, 40);
}

TEST_P(ClosedForms, HitsLieOnTheSurfaceAndFaceTheRay)
{
  const Tool& tool = *GetParam().tool;
  Rays rays(5);
  for (int k = 0; k < 400; ++k)
  {
    const ToolRay ray = rays();
    const ToolHit hit = cast(tool, ray);
    if (not hit.found)
      continue;
    const double size = 1.0 + std::abs(hit.g);
    EXPECT_NEAR(tool.distance(ray.x + hit.g * ray.n), 0.0, 1e-10 * size);
    EXPECT_NEAR(hit.normal.norm(), 1.0, 1e-13);
    EXPECT_LT(hit.normal.dot(ray.n), 0.0);
  }
}

TEST_P(ClosedForms, NormalsAreGradientsOfTheDistance)
{
  constexpr double h = 1e-5;
  const Tool& tool = *GetParam().tool;
  Rays rays(7);
  for (int k = 0; k < 200; ++k)
  {
    const ToolRay ray = rays();
    const ToolHit hit = cast(tool, ray);
    const Vec<3> x = ray.x + hit.g * ray.n;
    if (not hit.found or is_beyond_tip(GetParam(), x))
      continue;
    for (int i = 0; i < 3; ++i)
    {
      const Vec<3> e = h * Vec<3>::Unit(i);
      EXPECT_NEAR(hit.normal[i],
                  (tool.distance(x + e) - tool.distance(x - e)) / (2.0 * h),
                  1e-8);
    }
  }
}

TEST_P(ClosedForms, BendsAreDerivativesOfTheNormal)
{
  constexpr double h = 2e-5;
  const Tool& tool = *GetParam().tool;
  Rays rays(9);
  // The normal at the point of the surface that a ray through it meets
  const auto normal_near = [&](const Vec<3>& x, const Vec<3>& n) {
    return cast(tool, {x - 0.05 * n, n}).normal;
  };
  for (int k = 0; k < 200; ++k)
  {
    const ToolRay ray = rays();
    const ToolHit hit = cast(tool, ray);
    const Vec<3> x = ray.x + hit.g * ray.n, n = -hit.normal;
    if (not hit.found or is_beyond_tip(GetParam(), x))
      continue;
    const Vec<3> t = hit.normal.cross(Vec<3>::UnitX()).normalized();
    for (const Vec<3>& along : {t, Vec<3>(t.cross(hit.normal))})
    {
      const Vec<3> slope =
          (normal_near(x + h * along, n) - normal_near(x - h * along, n)) /
          (2.0 * h);
      EXPECT_LT((hit.bend * along - slope).norm(), 1e-5);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, ClosedForms, testing::ValuesIn(tools()),
                         [](const auto& test)
                         {
                           std::string name = test.param.name;
                           std::replace(name.begin(), name.end(), ' ', '_');
                           return name;
                         });

TEST(ClosedForms, DigitsAreKeptFarFromTheOrigin)
{
  // A large sphere, and a ray that nearly touches its top
  const auto sphere = make_sphere({0.0, 0.0, -1e6}, 1e6, {});
  const ToolHit hit = cast(*sphere, {{1e-2, 0.0, 1e-3}, {0.0, 0.0, -1.0}});
  ASSERT_TRUE(hit.found);
  EXPECT_NEAR(hit.g, 1e-3 + 5e-11, 1e-9);
}
} // namespace
} // namespace raymortar
