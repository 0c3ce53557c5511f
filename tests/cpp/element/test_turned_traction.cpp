#include "bent_facets.h"
#include "raymortar/element/turned_traction.h"

using namespace raymortar;
using namespace raymortar::test;

namespace
{
template <class F>
auto turn(const typename F::NodeMatrix& old, const typename F::NodeMatrix& now,
          const Vec<F::gdim>& traction,
          const typename F::RefPoint& xi = centre<F>(), bool whole = false)
{
  const auto before = frame_at<F>(old, xi);
  return carry_traction<F::gdim>(before, dual_tangents<F::gdim>(before),
                                 frame_at<F>(now, xi), traction, whole);
}

template <class F>
class TurnedTractions : public testing::Test
{
};
TYPED_TEST_SUITE(TurnedTractions, AllFacets);
} // namespace

TYPED_TEST(TurnedTractions, RestLeavesTheTangentialPart)
{
  constexpr int D = TypeParam::gdim;
  Random random(1);
  const auto x = bent_facet<TypeParam>(random);
  const Vec<D> v = random.vector<D>();
  const Vec<D> n = frame_at<TypeParam>(x, centre<TypeParam>()).n;
  const Vec<D> expected = v - n.dot(v) * n;
  EXPECT_LE((turn<TypeParam>(x, x, v).value() - expected).norm(), 1e-14);
}

TYPED_TEST(TurnedTractions, AsAWholeItTurnsAndKeepsItsLength)
{
  constexpr int D = TypeParam::gdim;
  Random random(8);
  const auto at = centre<TypeParam>();
  for (int i = 0; i < 20; ++i)
  {
    const auto x = bent_facet<TypeParam>(random);
    const auto y = bent_facet<TypeParam>(random);
    const Mat<D, D> Q = random.rotation<D>();
    const Vec<D> v = random.vector<D>();
    EXPECT_LE((turn<TypeParam>(x, Q * x, v, at, true).value() - Q * v).norm(),
              1e-13);
    EXPECT_NEAR(turn<TypeParam>(x, y, v, at, true).value().norm(), v.norm(),
                1e-13);
  }
}

TYPED_TEST(TurnedTractions, RigidRotationsOfAnySizeTurnIt)
{
  constexpr int D = TypeParam::gdim;
  Random random(2);
  for (int i = 0; i < 50; ++i)
  {
    const auto x = bent_facet<TypeParam>(random);
    const Mat<D, D> Q = random.rotation<D>();
    const Vec<D> v = random.vector<D>();
    const Vec<D> rest = turn<TypeParam>(x, x, v).value();
    const Vec<D> turned = turn<TypeParam>(x, Q * x, v).value();
    EXPECT_LE((turned - Q * rest).norm(), 1e-13);
  }
}

TYPED_TEST(TurnedTractions, StretchNeitherTurnsNorScalesIt)
{
  // A symmetric stretch within the plane of a flat facet
  constexpr int D = TypeParam::gdim;
  Random random(3);
  const auto x = bent_facet<TypeParam>(random, 0.0);
  Mat<D, D> U = Mat<D, D>::Identity();
  U(0, 0) = 1.7;
  U(D - 2, 0) = U(0, D - 2) = D == 3 ? 0.3 : 1.7;
  const Vec<D> v = random.vector<D>();
  const Vec<D> rest = turn<TypeParam>(x, x, v).value();
  EXPECT_LE((turn<TypeParam>(x, U * x, v).value() - rest).norm(), 1e-14);
}

TYPED_TEST(TurnedTractions, StaysInThePresentTangentPlaneWithItsLength)
{
  constexpr int D = TypeParam::gdim;
  Random random(4);
  for (int i = 0; i < 50; ++i)
  {
    const auto x = bent_facet<TypeParam>(random);
    const auto y = bent_facet<TypeParam>(random);
    const Vec<D> v = random.vector<D>();
    const auto c = turn<TypeParam>(x, y, v);
    const Vec<D> n = frame_at<TypeParam>(y, centre<TypeParam>()).n;
    EXPECT_NEAR(n.dot(c.value()), 0.0, 1e-13);
    EXPECT_NEAR(c.value().norm(), turn<TypeParam>(x, x, v).value().norm(),
                1e-13);
  }
}

TYPED_TEST(TurnedTractions, VariationIsTheDerivative)
{
  using F = TypeParam;
  constexpr int D = F::gdim;
  Random random(5);
  for (int i = 0; i < 10; ++i)
  {
    const auto x = bent_facet<F>(random), y = bent_facet<F>(random);
    const Vec<D> v = random.vector<D>();
    const auto f = [&](const Vector& u) -> Vector
    {
      const typename F::NodeMatrix at =
          y + Eigen::Map<const typename F::NodeMatrix>(u.data());
      return turn<F>(x, at, v, centre<F>(), i % 2 == 0).value();
    };
    const auto now = frame_at<F>(y, centre<F>());
    auto rows = no_rows<D, D>();
    add_turned<D, D>(turn<F>(x, y, v, centre<F>(), i % 2 == 0),
                     Mat<D, D>::Identity(), now, dual_tangents<D>(now), rows);
    expect_derivative(f, Vector::Zero(F::dofs * D),
                      by_dofs<F, D>(rows, centre<F>()));
  }
}

TYPED_TEST(TurnedTractions, NoTractionHasNoVariation)
{
  using F = TypeParam;
  Random random(6);
  const auto x = bent_facet<F>(random), y = bent_facet<F>(random);
  const auto c = turn<F>(x, y, Vec<F::gdim>::Zero());
  EXPECT_TRUE(c.value().isZero(0.0));
  constexpr int D = F::gdim;
  const auto now = frame_at<F>(y, centre<F>());
  auto rows = no_rows<D, D>();
  add_turned<D, D>(c, Mat<D, D>::Identity(), now, dual_tangents<D>(now), rows);
  for (const Mat<D, D>& by : rows)
    EXPECT_TRUE(by.isZero(0.0));
}

TYPED_TEST(TurnedTractions, ChangesAlongTheFacetByItsDerivative)
{
  using F = TypeParam;
  constexpr int D = F::gdim;
  Random random(7);
  for (int i = 0; i < 10; ++i)
  {
    const auto x = bent_facet<F>(random), y = bent_facet<F>(random);
    Mat<D, F::dofs> nodal;
    for (int a = 0; a < F::dofs; ++a)
      nodal.col(a) = random.vector<D>();
    const Vec<D> v = nodal * F::Disp::values(centre<F>());
    const auto f = [&](const Vector& at) -> Vector
    {
      const typename F::RefPoint xi = at;
      return turn<F>(x, y, nodal * F::Disp::values(xi), xi, i % 2 == 0).value();
    };
    const auto bent = [](const typename F::NodeMatrix& nodes)
    {
      const auto frame = frame_at<F>(nodes, centre<F>());
      return BentFrame<D>{frame, curvature_at<F>(nodes, centre<F>(), frame)};
    };
    expect_derivative(f, centre<F>(),
                      turned_with_facet<D>(
                          turn<F>(x, y, v, centre<F>(), i % 2 == 0), bent(x),
                          dual_tangents<D>(frame_at<F>(x, centre<F>())),
                          bent(y), v, nodal * F::Disp::gradients(centre<F>())));
  }
}
