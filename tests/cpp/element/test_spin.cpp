#include "bent_facets.h"
#include "raymortar/element/spin.h"

using namespace raymortar;
using namespace raymortar::test;

namespace
{
/// A point of a facet before and after
template <class F>
TwoFrames<3> frames(const typename F::NodeMatrix& old,
                    const typename F::NodeMatrix& now)
{
  TwoFrames<3> f{
      frame_at<F>(now, centre<F>()), frame_at<F>(old, centre<F>()), {}};
  f.old_dual = dual_tangents<3>(f.old);
  return f;
}

/// The other side of a surface
template <class F>
typename F::NodeMatrix facing(typename F::NodeMatrix x)
{
  x.row(0).swap(x.row(1));
  return x;
}

Mat<3, 3> turn(double angle, const Vec<3>& axis)
{
  return Eigen::AngleAxisd(angle, axis).toRotationMatrix();
}

template <class F>
class SpinTest : public testing::Test
{
};
using Facets = testing::Types<Triangle1, Triangle2, Quad1, Quad2>;
TYPED_TEST_SUITE(SpinTest, Facets);
} // namespace

TYPED_TEST(SpinTest, TurnsAChordToTheEndOfItsArc)
{
  using F = TypeParam;
  Random random(1);
  for (const double slave : {-0.7, 0.0, 1.2})
    for (const double master : {0.0, 0.9})
    {
      const auto x = bent_facet<F>(random), y = facing<F>(x);
      const Vec<3> n = frame_at<F>(x, centre<F>()).n;
      // Both are turned together besides
      const Mat<3, 3> Q = random.rotation<3>();
      Spin<3> spin;
      spin.set(frames<F>(x, Q * turn(slave, n) * x),
               frames<F>(y, Q * turn(master, n) * y));
      const Vec<3> v = n.cross(random.vector<3>());
      const double half = 0.5 * (slave - master);
      const double arc = half == 0.0 ? 1.0 : half / std::sin(half);
      const Vec<3> expected = arc * (Q * turn(half, n) * v);
      EXPECT_LE((spin.turned(Q * v) - expected).norm(), 1e-13);
    }
}

TYPED_TEST(SpinTest, StretchAndTiltAreNone)
{
  using F = TypeParam;
  Random random(2);
  const auto x = bent_facet<F>(random, 0.0), y = facing<F>(x);
  const Mat<3, 3> tilt = turn(0.4, Vec<3>::UnitX());
  Mat<3, 3> stretch = Vec<3>(1.3, 0.8, 1.0).asDiagonal();
  stretch(0, 1) = stretch(1, 0) = 0.2;
  Spin<3> spin;
  spin.set(frames<F>(x, tilt * x), frames<F>(y, y));
  EXPECT_NEAR(spin.half, 0.0, 1e-15);
  spin.set(frames<F>(x, stretch * x), frames<F>(y, y));
  EXPECT_NEAR(spin.half, 0.0, 1e-15);
}
