#include "bent_facets.h"
#include "raymortar/element/tilt.h"

using namespace raymortar;
using namespace raymortar::test;

namespace
{
/// Rotation of the first coordinate towards the last
template <int D>
Mat<D, D> tilted(double angle)
{
  Mat<D, D> Q = Mat<D, D>::Identity();
  Q(0, 0) = Q(D - 1, D - 1) = std::cos(angle);
  Q(D - 1, 0) = std::sin(angle);
  Q(0, D - 1) = -std::sin(angle);
  return Q;
}

/// A point of a flat master that turns by Q, and faces down
template <int D>
TwoFrames<D> master_below(const Mat<D, D>& Q)
{
  TwoFrames<D> f;
  f.old.x.setZero();
  f.old.t = Mat<D, D - 1>(Mat<D, D>::Identity().template leftCols<D - 1>());
  f.old.t.col(0) *= -1.0;
  set_normal(f.old);
  f.now = f.old;
  f.now.t = Mat<D, D - 1>(Q * f.old.t);
  set_normal(f.now);
  f.old_dual = dual_tangents<D>(f.old);
  return f;
}

/// What a step around a circle of radius 1 slides, made longer
/// @param[in] theta Angle of the slave against the master
template <int D>
Vec<D> path(double theta, const Mat<D, D>& Q, bool of_target)
{
  const TwoFrames<D> master = master_below<D>(Q);
  const Vec<D> now = Q * -master.old.n, old = tilted<D>(-theta) * -master.old.n;
  // The chord between two points of the circle, on the surface of the law
  const Vec<D> chord = Vec<D>(old) - Vec<D>(-master.old.n);
  const Vec<D> frame = of_target ? Vec<D>(-master.old.n) : old;
  const Vec<D> slide = Q * (chord - dot<D>(frame, chord) * frame);
  Tilt<D> tilt;
  tilt.set(old, now, master, of_target);
  const Vec<D> w = tilt.lengthened(slide);
  const Vec<D> nu = of_target ? Vec<D>(-master.now.n) : now;
  return w - dot<D>(nu, w) * nu;
}

template <int D>
void expect_arcs()
{
  for (const bool of_target : {false, true})
    for (const double theta : {1e-3, 0.1, 0.3141592653589793, 0.6})
      for (const double common : {0.0, 0.8})
      {
        const double length =
            path<D>(theta, tilted<D>(common), of_target).norm();
        EXPECT_NEAR(length / theta, 1.0, theta > 0.5 ? 1e-4 : 1e-8) << theta;
      }
}

template <int D>
void expect_slopes(bool of_target)
{
  Random random(4);
  const Mat<D, D> Q = random.rotation<D>();
  const TwoFrames<D> master = master_below<D>(Q);
  const Vec<D> old = tilted<D>(-0.4) * -master.old.n;
  const Vec<D> slide = random.vector<D>();
  const auto value =
      [&](const Vec<D>& s, const Vec<D>& carried, const Vec<D>& n)
  {
    Tilt<D> t;
    t.n = n;
    t.carried.value = carried;
    t.unit = carried / carried.norm();
    t.across = t.unit - dot<D>(n, t.unit) * n;
    t.arc = missing_arc(dot<D>(t.across, t.across), of_target);
    return t.lengthened(s);
  };
  Tilt<D> tilt;
  tilt.set(old, tilted<D>(0.2) * (Q * -master.old.n), master, of_target);
  tilt.carried.value *= 1.3;
  const TiltSlopes<D> by(tilt, slide);
  const Vec<D>&c = tilt.carried.value, &n = tilt.n;
  const double h = 1e-6;
  for (int i = 0; i < D; ++i)
  {
    const Vec<D> e = Vec<D>::Unit(i) * h;
    const auto rate = [&](const Vec<D>& high, const Vec<D>& low)
    { return Vec<D>((high - low) / (2.0 * h)); };
    EXPECT_LE((rate(value(slide + e, c, n), value(slide - e, c, n)) -
               by.by_slide.col(i))
                  .norm(),
              1e-9);
    EXPECT_LE((rate(value(slide, c + e, n), value(slide, c - e, n)) -
               by.by_carried.col(i))
                  .norm(),
              1e-9);
    EXPECT_LE(
        (rate(value(slide, c, n + e), value(slide, c, n - e)) - by.by_n.col(i))
            .norm(),
        1e-9);
  }
}
} // namespace

TEST(Tilt, APathAroundACircleIsItsArc)
{
  expect_arcs<2>();
  expect_arcs<3>();
}

TEST(Tilt, ACommonRotationLengthensNothing)
{
  Random random(2);
  const Mat<3, 3> Q = random.rotation<3>();
  const TwoFrames<3> master = master_below<3>(Q);
  Tilt<3> tilt;
  tilt.set(-master.old.n, Q * -master.old.n, master, false);
  const Vec<3> v = random.vector<3>();
  EXPECT_LE((tilt.lengthened(v) - v).norm(), 1e-14);
}

TEST(Tilt, DerivativesAreThoseOfDifferences)
{
  for (const bool of_target : {false, true})
  {
    expect_slopes<2>(of_target);
    expect_slopes<3>(of_target);
  }
}
