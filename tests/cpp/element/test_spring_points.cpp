#include "bent_facets.h"
#include "raymortar/element/spring_points.h"

using namespace raymortar;
using namespace raymortar::test;

namespace
{
template <int D>
SpringPoints some_points(Random& random, int count)
{
  SpringPoints points;
  points.first = {0, 0, static_cast<std::size_t>(count)};
  for (int q = 0; q < count; ++q)
  {
    const double a = 0.5 + 0.4 * std::sin(3.0 * q), b = 0.3 * std::cos(2.0 * q);
    points.xi.emplace_back(a, D == 3 ? b : 0.0);
    points.area.push_back(1.0 + 0.5 * std::sin(q));
    const Vec<D> v = random.vector<D>();
    points.rest.insert(points.rest.end(), v.data(), v.data() + D);
  }
  return points;
}

template <int D>
Vec<D - 1> place(double a, double b)
{
  Vec<D - 1> xi = Vec<D - 1>::Constant(b);
  xi[0] = a;
  return xi;
}

template <int D>
void expect_points_are_met()
{
  Random random(3);
  for (const int count : {1, 2, 7})
  {
    const SpringPoints points = some_points<D>(random, count);
    const Shape shape = D == 2 ? Shape::interval : Shape::triangle;
    for (int q = 0; q < count; ++q)
    {
      const Vec<D> held(points.rest.data() + D * q);
      const Vec<D - 1> xi = points.xi[static_cast<std::size_t>(q)].head(D - 1);
      EXPECT_EQ((rest_at<D>(points, shape, 1, xi, false).col(0) - held).norm(),
                0.0);
      const Vec<D - 1> beside = xi + place<D>(1e-13, 1e-13);
      EXPECT_LE(
          (rest_at<D>(points, shape, 1, beside, false).col(0) - held).norm(),
          1e-12);
      // The field is flat there
      EXPECT_LE(rest_at<D>(points, shape, 1, beside, true)
                    .template rightCols<D - 1>()
                    .norm(),
                1e-9);
    }
    EXPECT_EQ(rest_at<D>(points, shape, 0, place<D>(0.1, 0.2), true).norm(),
              0.0);
  }
}

template <int D>
void expect_slopes(Shape shape)
{
  Random random(5);
  const SpringPoints points = some_points<D>(random, 6);
  const double h = 1e-6;
  for (const double a : {0.05, 0.33, 0.71})
    for (const double b : {0.1, 0.2})
    {
      const Vec<D - 1> xi = place<D>(a, b);
      const Mat<D, D> at = rest_at<D>(points, shape, 1, xi, true);
      for (int j = 0; j < D - 1; ++j)
      {
        const Vec<D - 1> e = Vec<D - 1>::Unit(j) * h;
        const Vec<D> rate =
            (rest_at<D>(points, shape, 1, xi + e, false).col(0) -
             rest_at<D>(points, shape, 1, xi - e, false).col(0)) /
            (2.0 * h);
        EXPECT_LE((rate - at.col(1 + j)).norm(), 1e-7 * (1.0 + rate.norm()));
      }
    }
}
} // namespace

TEST(SpringPoints, TheFieldMeetsThePoints)
{
  expect_points_are_met<2>();
  expect_points_are_met<3>();
}

TEST(SpringPoints, DerivativesAreThoseOfDifferences)
{
  expect_slopes<2>(Shape::interval);
  expect_slopes<3>(Shape::triangle);
  expect_slopes<3>(Shape::quadrilateral);
}

TEST(SpringPoints, CornersOfATriangleMayHaveAnyOrder)
{
  // The corners (0, 0), (1, 0), (0, 1) in turn
  const auto next = [](const Vec<2>& xi)
  { return Vec<2>(1.0 - xi[0] - xi[1], xi[0]); };
  Random random(6);
  SpringPoints points = some_points<3>(random, 5);
  const Vec<2> xi(0.2, 0.5);
  const Vec<3> before =
      rest_at<3>(points, Shape::triangle, 1, xi, false).col(0);
  for (auto& one : points.xi)
    one = next(one);
  const Vec<3> after =
      rest_at<3>(points, Shape::triangle, 1, next(xi), false).col(0);
  EXPECT_LE((after - before).norm(), 1e-14);
}
