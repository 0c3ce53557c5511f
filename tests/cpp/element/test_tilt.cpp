#include "differences.h"
#include "raymortar/element/tilt.h"
#include <Eigen/Geometry>

using namespace raymortar;
using namespace raymortar::test;

namespace
{
template <int D>
Mat<D, D> turned(double angle);
template <>
Mat<2, 2> turned<2>(double angle)
{
  return Eigen::Rotation2Dd(angle).toRotationMatrix();
}
template <>
Mat<3, 3> turned<3>(double angle)
{
  return Eigen::AngleAxisd(angle, Vec<3>::UnitZ()).toRotationMatrix();
}

/// A point that has turned, on a facet whose normal lies in the plane of x, y
template <int D>
TwoFrames<D> frames(const Mat<D, D>& old, const Mat<D, D>& now, double side)
{
  const auto frame = [side](const Mat<D, D>& Q)
  {
    Frame<D> f;
    f.x.setZero();
    f.n = side * Q.col(1);
    f.t = Q.template leftCols<D - 1>();
    if constexpr (D == 3)
      f.t.col(1) = Q.col(2);
    f.jacobian = 1.0;
    return f;
  };
  TwoFrames<D> f{frame(now), frame(old), {}};
  f.old_dual = dual_tangents<D>(f.old);
  return f;
}

template <class Size>
class TiltTest : public testing::Test
{
};
using Sizes = testing::Types<std::integral_constant<int, 2>,
                             std::integral_constant<int, 3>>;
TYPED_TEST_SUITE(TiltTest, Sizes);
} // namespace

TYPED_TEST(TiltTest, ChordsAroundARoundBodyBecomeArcs)
{
  constexpr int D = TypeParam::value;
  Random random(1);
  for (const double slave : {0.0, 0.4, -1.1})
    for (const double master : {0.0, 1e-3, 0.9})
    {
      const Mat<D, D> Q = random.rotation<D>(), one = Mat<D, D>::Identity();
      Tilt<D> tilt;
      tilt.set(frames<D>(one, Q * turned<D>(slave), 1.0),
               frames<D>(one, Q * turned<D>(master), -1.0));
      const double angle = slave - master;
      // From a point of the circle to another, as the master carries it
      Vec<D> chord = Q * turned<D>(master) * (turned<D>(angle) - one).eval() *
                     Vec<D>::Unit(1);
      const Vec<D> arc = -angle * (Q * turned<D>(slave)).col(0);
      EXPECT_LE((tilt.turn * chord - arc).norm(), 1e-14);
      if constexpr (D == 3) // across the circle nothing turns
      {
        const Vec<D> axis = Q.col(2);
        EXPECT_LE((tilt.turn * axis - tilt.arc * axis).norm(), 1e-14);
      }
    }
}

TYPED_TEST(TiltTest, SlopesAreDerivatives)
{
  constexpr int D = TypeParam::value;
  Random random(2);
  for (const double angle : {1e-5, 0.3, -1.4})
  {
    const Mat<D, D> Q = random.rotation<D>(), one = Mat<D, D>::Identity();
    const auto slave = frames<D>(Q, Q * turned<D>(angle), 1.0);
    const auto master = frames<D>(one, one, -1.0);
    const Vec<D> v = random.vector<D>();
    Tilt<D> tilt;
    tilt.set(slave, master);
    const auto by_now = [&](const Vector& n) -> Vector
    {
      auto moved = slave;
      moved.now.n = n;
      Tilt<D> at;
      at.set(moved, master);
      return at.turn * v;
    };
    expect_derivative(by_now, slave.now.n, tilt.by_normal(v));
    const auto by_old = [&](const Vector& n) -> Vector
    {
      auto moved = slave;
      moved.old.n = n;
      Tilt<D> at;
      at.set(moved, master);
      return at.turn * v;
    };
    expect_derivative(by_old, slave.old.n, tilt.by_carried(v));
  }
}

TYPED_TEST(TiltTest, OppositeNormalsGiveFiniteTurns)
{
  constexpr int D = TypeParam::value;
  const Mat<D, D> one = Mat<D, D>::Identity();
  Tilt<D> tilt;
  tilt.set(frames<D>(one, -one, 1.0), frames<D>(one, one, -1.0));
  EXPECT_TRUE(tilt.turn.allFinite());
  EXPECT_TRUE(tilt.by_normal(Vec<D>::Ones()).allFinite());
}
