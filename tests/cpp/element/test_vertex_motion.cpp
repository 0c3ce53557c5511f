#include "differences.h"
#include "facet_types.h"
#include "raymortar/element/vertex_motion.h"
#include "raymortar/mortar/plane.h"

using namespace raymortar;
using namespace raymortar::test;

namespace
{
/// Nodes of both facets moved by u, [slave | master]
template <class F>
std::array<typename F::NodeMatrix, 2>
moved(const typename F::NodeMatrix& slave, const typename F::NodeMatrix& master,
      const Vector& u)
{
  using Nodes = Eigen::Map<const typename F::NodeMatrix>;
  return {slave + Nodes(u.data()), master + Nodes(u.data() + slave.size())};
}

/// A master over a random slave facet, turned about its normal
template <class F>
typename F::NodeMatrix random_master(std::mt19937& random)
{
  Mat<F::gdim, F::gdim> turn = Mat<F::gdim, F::gdim>::Identity();
  if constexpr (F::gdim == 3)
    turn = Eigen::AngleAxisd(0.6, Vec<3>::UnitZ()).toRotationMatrix();
  typename F::NodeMatrix master = turn * random_nodes<F>(random, 0.05);
  master.row(0).array() += 0.4;
  master.row(F::gdim - 1).array() += F::gdim == 2 ? -0.1 : 0.1;
  return master;
}

/// A motion over the dofs [slave | master], of facets of one type
template <class F>
Matrix rows_of(const VertexMotion<F>& motion)
{
  constexpr int D = F::gdim, side = D * F::dofs;
  const auto values = [](const Vec<2>& at) -> Vec<F::dofs>
  { return F::Disp::values(at.template head<F::tdim>()); };
  const MasterPlace& at = motion.place;
  const Vec<F::dofs> N =
      (1.0 - at.share) * values(at.begin) + at.share * values(at.end);
  Matrix rows(F::tdim, 2 * side);
  rows.leftCols(side) = motion.by_slave;
  for (int a = 0; a < F::dofs; ++a)
    rows.middleCols(side + D * a, D) = N[a] * motion.by_master;
  return rows;
}
} // namespace

template <class F>
class VertexMotionTest : public testing::Test
{
};
TYPED_TEST_SUITE(VertexMotionTest, AllFacets, );

TYPED_TEST(VertexMotionTest, VertexUnderACornerMovesByItsDerivative)
{
  using F = TypeParam;
  std::mt19937 random(1);
  for (int trial = 0; trial < 5; ++trial)
  {
    const auto slave = random_nodes<F>(random, 0.05);
    const auto master = random_master<F>(random);
    typename F::RefPoint xi = master.col(0).template head<F::tdim>();
    ASSERT_TRUE(ray_through<F>(slave, master.col(0), xi));
    Break under;
    under.motion = Break::Motion::corner;
    const auto f = [&](const Vector& u) -> Vector
    {
      const auto [s, m] = moved<F>(slave, master, u);
      typename F::RefPoint at = xi;
      EXPECT_TRUE(ray_through<F>(s, m.col(0), at));
      return at;
    };
    expect_derivative(
        f, Vector::Zero(2 * slave.size()),
        rows_of<F>(vertex_motion<F>(slave, MasterNodes<F>{master}, xi, under)));
  }
}

template <class F>
class CrossingMotionTest : public testing::Test
{
};
using Polygons = testing::Types<Triangle1, Triangle2, Quad1, Quad2>;
TYPED_TEST_SUITE(CrossingMotionTest, Polygons, );

TYPED_TEST(CrossingMotionTest, CrossingOfEdgesMovesByItsDerivative)
{
  using F = TypeParam;
  std::mt19937 random(2);
  for (int trial = 0; trial < 5; ++trial)
  {
    const auto slave = random_nodes<F>(random, 0.05);
    typename F::NodeMatrix master = random_master<F>(random);
    // The slave's edge along the first axis, the master's along the second
    const ReferenceEdge<2> edge_s{{0, 0}, {1, 0}}, edge_m{{0, 0}, {0, 1}};
    double s = 0.4, t = 0.3;
    // Put it where the edges cross, a little off the start
    const auto frame = frame_at<F>(slave, edge_s.at(s + 0.01));
    master.colwise() += (frame.x + 0.1 * frame.n -
                         master * F::Node::values(edge_m.at(t - 0.01)))
                            .eval();
    ASSERT_TRUE((cross_edges<F, F>(slave, edge_s, master, edge_m, s, t)));
    EXPECT_NEAR(s, 0.41, 1e-9);
    EXPECT_NEAR(t, 0.29, 1e-9);
    const Break at{Break::Motion::crossing, edge_m.at(t), edge_s.along,
                   edge_m.along};
    const auto f = [&](const Vector& u) -> Vector
    {
      const auto [x, y] = moved<F>(slave, master, u);
      double s_u = s, t_u = t;
      EXPECT_TRUE((cross_edges<F, F>(x, edge_s, y, edge_m, s_u, t_u)));
      return edge_s.at(s_u);
    };
    expect_derivative(f, Vector::Zero(2 * slave.size()),
                      rows_of<F>(vertex_motion<F>(slave, MasterNodes<F>{master},
                                                  edge_s.at(s), at)));
  }
}

namespace
{
/// Plane of a slave patch, its corners and those of a master's in there
template <class F>
struct FlatView
{
  Patch patch;
  std::array<typename F::Point, 4> corners;
  PatchPlane<F::gdim> plane;

  FlatView(const typename F::NodeMatrix& slave, const Patch& of)
      : patch(of), corners(patch_corners<F>(slave, of)),
        plane(patch_plane<F::gdim>(corners, of.size))
  {
  }

  /// As the segmentation takes points of the plane to the facet
  [[nodiscard]] typename F::RefPoint xi(const typename F::RefPoint& y) const
  {
    const auto at = patch_reference<F>(patch);
    typename F::RefPoint s = y;
    std::size_t last = F::tdim;
    if constexpr (F::shape == Shape::quadrilateral)
    {
      std::array<Vec<2>, 4> flat;
      for (std::size_t i = 0; i < 4; ++i)
        flat[i] = plane.coordinates(corners[i]);
      s = inverse_bilinear(flat, y);
      last = 3;
    }
    typename F::RefPoint result = at[0] + s[0] * (at[1] - at[0]);
    if constexpr (F::tdim == 2)
      result += s[1] * (at[last] - at[0]);
    return result;
  }
};

template <class F>
Break flat_break(Break::Motion motion, int begin, int end)
{
  const auto point = [](int node)
  {
    return typename F::RefPoint(
        F::Node::points[static_cast<std::size_t>(node)].data());
  };
  Break at;
  at.motion = motion;
  at.eta.template head<F::tdim>() = point(begin);
  at.along_m.template head<F::tdim>() = point(end) - point(begin);
  return at;
}
} // namespace

TYPED_TEST(VertexMotionTest, FlatPlaceUnderACornerMovesByItsDerivative)
{
  using F = TypeParam;
  std::mt19937 random(3);
  for (const bool subdivide : {false, true})
    for (const Patch& patch : patches<F>(subdivide))
    {
      const auto slave = random_nodes<F>(random, 0.05);
      const auto master = random_master<F>(random);
      const auto f = [&](const Vector& u) -> Vector
      {
        const auto [s, m] = moved<F>(slave, master, u);
        const FlatView<F> view(s, patch);
        return view.xi(view.plane.coordinates(m.col(0)));
      };
      const Vector none = Vector::Zero(2 * slave.size());
      expect_derivative(
          f, none,
          rows_of<F>(flat_motion<F>(
              FlatPatch<F>(slave, patch), MasterNodes<F>{master}, f(none),
              flat_break<F>(Break::Motion::flat_corner, 0, 0))));
    }
}

TYPED_TEST(CrossingMotionTest, FlatCrossingMovesByItsDerivative)
{
  using F = TypeParam;
  std::mt19937 random(4);
  for (const bool subdivide : {false, true})
    for (const Patch& patch : patches<F>(subdivide))
    {
      const auto slave = random_nodes<F>(random, 0.05);
      const auto master = random_master<F>(random);
      const auto at = patch_reference<F>(patch);
      // First edge of the patch with the line through master corners 0 and 1
      const auto f = [&](const Vector& u) -> Vector
      {
        const auto [x, y] = moved<F>(slave, master, u);
        const FlatView<F> view(x, patch);
        const auto in_plane = [&](const Vec<3>& p)
        { return view.plane.coordinates(p); };
        const Vec<2> a = in_plane(view.corners[0]), b = in_plane(y.col(0));
        Mat<2, 2> A;
        A.col(0) = in_plane(view.corners[1]) - a;
        A.col(1) = b - in_plane(y.col(1));
        return at[0] + (A.inverse() * (b - a))[0] * (at[1] - at[0]);
      };
      const Vector none = Vector::Zero(2 * slave.size());
      Break crossing = flat_break<F>(Break::Motion::flat_crossing, 0, 1);
      crossing.along_s = at[1] - at[0];
      expect_derivative(f, none,
                        rows_of<F>(flat_motion<F>(FlatPatch<F>(slave, patch),
                                                  MasterNodes<F>{master},
                                                  f(none), crossing)));
    }
}
