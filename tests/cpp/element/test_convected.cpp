#include "bent_facets.h"
#include "raymortar/element/convected.h"

using namespace raymortar;
using namespace raymortar::test;

namespace
{
template <class F>
auto convected(const typename F::NodeMatrix& old,
               const typename F::NodeMatrix& now, const Vec<F::gdim>& v,
               const typename F::RefPoint& eta = centre<F>())
{
  const auto before = frame_at<F>(old, eta);
  return convect<F::gdim>(before, dual_tangents<F::gdim>(before),
                          frame_at<F>(now, eta), v);
}

template <class F>
class Convected : public testing::Test
{
};
TYPED_TEST_SUITE(Convected, AllFacets);
} // namespace

TYPED_TEST(Convected, RestLeavesAVector)
{
  Random random(1);
  const auto x = bent_facet<TypeParam>(random);
  const Vec<TypeParam::gdim> v = random.vector<TypeParam::gdim>();
  EXPECT_LE((convected<TypeParam>(x, x, v).value - v).norm(), 1e-14);
}

TYPED_TEST(Convected, RigidRotationsOfAnySizeTurnIt)
{
  constexpr int D = TypeParam::gdim;
  Random random(2);
  for (int i = 0; i < 50; ++i)
  {
    const auto x = bent_facet<TypeParam>(random);
    const Mat<D, D> Q = random.rotation<D>();
    const Vec<D> v = random.vector<D>();
    EXPECT_LE((convected<TypeParam>(x, Q * x, v).value - Q * v).norm(), 1e-13);
  }
}

TYPED_TEST(Convected, TangentsAndNormalStayWhatTheyAre)
{
  constexpr int D = TypeParam::gdim;
  Random random(3);
  const auto x = bent_facet<TypeParam>(random);
  const auto y = bent_facet<TypeParam>(random);
  const Frame<D> old = frame_at<TypeParam>(x, centre<TypeParam>());
  const Frame<D> now = frame_at<TypeParam>(y, centre<TypeParam>());
  EXPECT_LE((convected<TypeParam>(x, y, old.n).value - now.n).norm(), 1e-13);
  for (int i = 0; i < D - 1; ++i)
    EXPECT_LE(
        (convected<TypeParam>(x, y, old.t.col(i)).value - now.t.col(i)).norm(),
        1e-13);
}

TYPED_TEST(Convected, VariationIsTheDerivative)
{
  using F = TypeParam;
  constexpr int D = F::gdim;
  Random random(4);
  const auto x = bent_facet<F>(random), y = bent_facet<F>(random);
  const Vec<D> v = random.vector<D>();
  const auto f = [&](const Vector& u) -> Vector
  {
    const typename F::NodeMatrix at =
        y + Eigen::Map<const typename F::NodeMatrix>(u.data());
    return convected<F>(x, at, v).value;
  };
  const Frame<D> now = frame_at<F>(y, centre<F>());
  auto rows = no_rows<D, D>();
  add_convected<D, D>(convected<F>(x, y, v), Mat<D, D>::Identity(), now.n,
                      dual_tangents<D>(now.t), rows);
  expect_derivative(f, Vector::Zero(F::dofs * D),
                    by_dofs<F, D>(rows, centre<F>()));
}

TYPED_TEST(Convected, ChangesAlongTheMasterByItsDerivative)
{
  using F = TypeParam;
  constexpr int D = F::gdim;
  Random random(5);
  const auto x = bent_facet<F>(random), y = bent_facet<F>(random);
  const Vec<D> v = random.vector<D>();
  const auto f = [&](const Vector& at) -> Vector
  {
    const typename F::RefPoint eta = at;
    return convected<F>(x, y, v, eta).value;
  };
  const auto bend = [](const typename F::NodeMatrix& nodes)
  {
    return curvature_at<F>(nodes, centre<F>(), frame_at<F>(nodes, centre<F>()));
  };
  const Frame<D> before = frame_at<F>(x, centre<F>());
  const Mat<D, D> carry = convection<D>(before, dual_tangents<D>(before.t),
                                        frame_at<F>(y, centre<F>()));
  expect_derivative(f, centre<F>(),
                    convected_along_master<D>(convected<F>(x, y, v), carry,
                                              bend(x), bend(y)));
}

TEST(ClosedPart, IsWhatWasOpenAndIsNotAnyMore)
{
  EXPECT_EQ(closed_part(0.3, 0.1).length, 0.3 - 0.1);
  EXPECT_EQ(closed_part(0.3, -0.1).length, 0.3);
  for (const auto& [old, now] : {std::pair{0.3, 0.3},
                                 {0.3, 0.4},
                                 {0.0, -0.1},
                                 {-0.2, -0.3},
                                 {-0.2, 0.1}})
    EXPECT_EQ(closed_part(old, now).length, 0.0) << old << ' ' << now;
}

TEST(ClosedPart, DerivativesAreDifferences)
{
  const double h = 1e-6;
  for (const auto& [old, now] : {std::pair{0.3, 0.1}, {0.3, -0.1}, {-0.2, 0.1}})
  {
    const Closing at = closed_part(old, now);
    const double by_old =
        closed_part(old + h, now).length - closed_part(old - h, now).length;
    const double by_now =
        closed_part(old, now + h).length - closed_part(old, now - h).length;
    EXPECT_NEAR(at.by_old, by_old / (2.0 * h), 1e-9);
    EXPECT_NEAR(at.by_now, by_now / (2.0 * h), 1e-9);
  }
}
