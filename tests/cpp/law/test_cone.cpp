#include "differences.h"
#include "raymortar/law/cone.h"

using namespace raymortar;
using namespace raymortar::test;

namespace
{
constexpr double infinity = std::numeric_limits<double>::infinity();

template <int D>
struct Input
{
  Vec<D> n, z;
  double s;

  [[nodiscard]] Vector stacked() const
  {
    Vector x(2 * D + 1);
    x << n, z, s;
    return x;
  }
};

template <int D>
Vector value(const Vector& x)
{
  return project_tangential<D>(x.head<D>(), x.segment<D>(D), x[2 * D]).value;
}

template <int D>
Matrix derivative(const Input<D>& in)
{
  const auto r = project_tangential<D>(in.n, in.z, in.s);
  Matrix J(D, 2 * D + 1);
  J << r.by_n, r.by_z, r.by_s;
  return J;
}

/// Random n and z, and the length of the tangential part of z
template <int D>
std::pair<Input<D>, double> random_input(Random& random)
{
  Input<D> in{random.unit<D>(), random.vector<D>(), 0.0};
  const double length = (in.z - in.n.dot(in.z) * in.n).norm();
  return {in, length};
}

template <class Dimension>
class Cone : public testing::Test
{
};
using Dimensions = testing::Types<std::integral_constant<int, 2>,
                                  std::integral_constant<int, 3>>;
TYPED_TEST_SUITE(Cone, Dimensions);
} // namespace

TYPED_TEST(Cone, InsideNothingChanges)
{
  constexpr int D = TypeParam::value;
  Random random(1);
  for (int i = 0; i < 100; ++i)
  {
    auto [in, length] = random_input<D>(random);
    in.s = 1.5 * length;
    const auto r = project_tangential<D>(in.n, in.z, in.s);
    EXPECT_TRUE(r.stick);
    EXPECT_LE((r.value - (in.z - in.n.dot(in.z) * in.n)).norm(), 1e-15);
    EXPECT_TRUE(r.by_s.isZero(0.0));
    expect_derivative(value<D>, in.stacked(), derivative(in));
  }
}

TYPED_TEST(Cone, OutsideTheLengthIsTheBound)
{
  constexpr int D = TypeParam::value;
  Random random(2);
  for (int i = 0; i < 100; ++i)
  {
    auto [in, length] = random_input<D>(random);
    if (length < 0.3)
      continue; // curvature 1/length^2 beyond what the steps resolve
    in.s = 0.6 * length;
    const auto r = project_tangential<D>(in.n, in.z, in.s);
    const Vec<D> q = in.z - in.n.dot(in.z) * in.n;
    EXPECT_FALSE(r.stick);
    EXPECT_NEAR(r.value.norm(), in.s, 1e-14);
    EXPECT_NEAR(r.value.dot(q), in.s * length, 1e-14);
    EXPECT_NEAR(r.value.dot(in.n), 0.0, 1e-15);
    expect_derivative(value<D>, in.stacked(), derivative(in));
  }
}

TYPED_TEST(Cone, OnTheBoundaryItSticksAndIsContinuous)
{
  constexpr int D = TypeParam::value;
  Random random(3);
  for (int i = 0; i < 20; ++i)
  {
    // n along an axis, so that the length of q is s without rounding
    Input<D> in{Vec<D>::Unit(D - 1), random.vector<D>(), 0.0};
    in.s = in.z.template head<D - 1>().norm();
    const auto r = project_tangential<D>(in.n, in.z, in.s);
    EXPECT_TRUE(r.stick);
    Input<D> out = in;
    out.s = in.s * (1.0 - 1e-14);
    EXPECT_LE(
        (project_tangential<D>(out.n, out.z, out.s).value - r.value).norm(),
        1e-13 * in.s);
    // Growing bound and shrinking bound: the two derivatives
    const Vector up = Vector::Unit(2 * D + 1, 2 * D);
    expect_one_sided(value<D>, in.stacked(), up, derivative(in));
    expect_one_sided(value<D>, in.stacked(), -up, derivative(out));
    // Shorter and longer traction
    Vector longer = Vector::Zero(2 * D + 1);
    longer.segment<D>(D) = in.z;
    expect_one_sided(value<D>, in.stacked(), -longer, derivative(in));
    expect_one_sided(value<D>, in.stacked(), longer, derivative(out));
  }
}

TYPED_TEST(Cone, ZeroBoundHoldsNothing)
{
  constexpr int D = TypeParam::value;
  Random random(4);
  const Vec<D> n = random.unit<D>(), z = random.vector<D>();
  const auto r = project_tangential<D>(n, z, 0.0);
  EXPECT_FALSE(r.stick);
  EXPECT_TRUE(r.value.isZero(0.0));
  EXPECT_TRUE(r.by_z.isZero(0.0) and r.by_n.isZero(0.0));
  EXPECT_NEAR(r.by_s.norm(), 1.0, 1e-15);
}

TYPED_TEST(Cone, NoTractionAndNoBoundIsStickAndFinite)
{
  // First touch: neither pressure nor traction
  constexpr int D = TypeParam::value;
  for (const double s : {0.0, -0.0})
  {
    const auto r = project_tangential<D>(Vec<D>::Unit(0), Vec<D>::Zero(), s);
    EXPECT_TRUE(r.stick);
    EXPECT_TRUE(r.value.isZero(0.0) and r.by_s.isZero(0.0));
    EXPECT_TRUE(r.by_z.allFinite() and r.by_n.allFinite());
  }
}

TYPED_TEST(Cone, InfiniteBoundIsStick)
{
  constexpr int D = TypeParam::value;
  Random random(5);
  Input<D> in{random.unit<D>(), 1e9 * random.vector<D>(), infinity};
  const auto r = project_tangential<D>(in.n, in.z, in.s);
  EXPECT_TRUE(r.stick);
  EXPECT_TRUE(derivative(in).allFinite());
  EXPECT_LE((r.value - (in.z - in.n.dot(in.z) * in.n)).norm(), 1e-6);
}

TYPED_TEST(Cone, NormalPartDropsOut)
{
  constexpr int D = TypeParam::value;
  Random random(6);
  for (const double factor : {0.5, 2.0})
  {
    auto [in, length] = random_input<D>(random);
    in.s = factor * length;
    const auto a = project_tangential<D>(in.n, in.z, in.s);
    const auto b = project_tangential<D>(in.n, Vec<D>(in.z + 3.0 * in.n), in.s);
    EXPECT_LE((a.value - b.value).norm(), 1e-14);
    EXPECT_LE((a.by_z * in.n).norm(), 1e-14);
  }
}

TYPED_TEST(Cone, TurnsWithItsArguments)
{
  constexpr int D = TypeParam::value;
  Random random(7);
  for (int i = 0; i < 50; ++i)
  {
    auto [in, length] = random_input<D>(random);
    in.s = (i % 2 ? 0.5 : 2.0) * length;
    const Mat<D, D> Q = random.rotation<D>();
    const auto a = project_tangential<D>(in.n, in.z, in.s);
    const auto b =
        project_tangential<D>(Vec<D>(Q * in.n), Vec<D>(Q * in.z), in.s);
    EXPECT_LE((Q * a.value - b.value).norm(), 1e-13);
    EXPECT_LE((Q * a.by_z * Q.transpose() - b.by_z).norm(), 1e-13);
    EXPECT_LE((Q * a.by_n * Q.transpose() - b.by_n).norm(), 1e-13);
    EXPECT_LE((Q * a.by_s - b.by_s).norm(), 1e-13);
  }
}

TYPED_TEST(Cone, OutsideByNoMoreThanTheSlackIsInside)
{
  constexpr int D = TypeParam::value;
  Random random(8);
  constexpr double slack = 1e-10;
  for (int i = 0; i < 50; ++i)
  {
    const auto [in, length] = random_input<D>(random);
    const Vec<D> q = in.z - in.n.dot(in.z) * in.n;
    // Inside, on the circle but for rounding, and outside by less or more
    for (const double beyond : {-0.5 * slack, -1e-16, 1e-16, 0.5 * slack,
                                2.0 * slack, 2.0 * fade * slack})
    {
      const double s = length - beyond;
      const auto r = project_tangential<D>(in.n, in.z, s, slack);
      EXPECT_EQ(r.stick, beyond < slack);
      const double rest =
          std::max(0.0, slack - (beyond - slack) / (fade - 1.0));
      const double radius = r.stick ? length : s + rest;
      EXPECT_LE((r.value - radius / length * q).norm(), 1e-14);
      const Mat<D, D> T = Mat<D, D>::Identity() - in.n * in.n.transpose();
      EXPECT_EQ((r.by_z - T).norm() <= 1e-14, r.stick);
      EXPECT_EQ(r.by_s.isZero(0.0), r.stick);
    }
  }
}

TYPED_TEST(Cone, NothingJumpsBeyondTheSlack)
{
  constexpr int D = TypeParam::value;
  Random random(10);
  const auto [in, length] = random_input<D>(random);
  constexpr double slack = 1e-3;
  for (const double edge : {slack, fade * slack})
  {
    const auto at = [&](double beyond)
    {
      return project_tangential<D>(in.n, in.z, length - beyond, slack)
          .value.norm();
    };
    EXPECT_NEAR(at(edge * (1.0 - 1e-9)), at(edge * (1.0 + 1e-9)), 1e-6 * slack);
  }
  // The radius falls in between, with the slope that the derivative says
  const double s = length - 0.5 * fade * slack, h = 1e-6;
  const auto radius = [&](double bound)
  { return project_tangential<D>(in.n, in.z, bound, slack).value.norm(); };
  const auto r = project_tangential<D>(in.n, in.z, s, slack);
  EXPECT_NEAR(r.by_s.dot(r.value.normalized()),
              (radius(s + h) - radius(s - h)) / (2.0 * h), 1e-7);
}

TYPED_TEST(Cone, RestIsStickWhateverTheRounding)
{
  // Neither pressure nor traction, but for rounding of either sign
  constexpr int D = TypeParam::value;
  Random random(9);
  for (int i = 0; i < 50; ++i)
    for (const double s : {0.0, 1e-17})
    {
      const Vec<D> n = random.unit<D>(), z = 1e-15 * random.vector<D>();
      const auto r = project_tangential<D>(n, z, s, 1e-11);
      EXPECT_TRUE(r.stick);
      EXPECT_TRUE(r.by_s.isZero(0.0));
      EXPECT_TRUE(r.by_z.isApprox(Mat<D, D>::Identity() - n * n.transpose()));
    }
}
