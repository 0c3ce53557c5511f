#include "facing_facets.h"

using namespace raymortar;
using namespace raymortar::test;

namespace
{
/// Vector product; the component out of the plane in 2D
Vec<3> moment(const Vec<3>& x, const Vec<3>& f) { return x.cross(f); }
Vec<1> moment(const Vec<2>& x, const Vec<2>& f)
{
  return Vec<1>(x[0] * f[1] - x[1] * f[0]);
}

template <class C>
class ElementTest : public testing::Test
{
};
} // namespace

TYPED_TEST_SUITE(ElementTest, ElementCases, );

TYPED_TEST(ElementTest, TangentIsTheDerivativeOfTheResidual)
{
  std::mt19937 random(7);
  for (int trial = 0; trial < 12; ++trial)
    FacingFacets<TypeParam>(random, trial % 3 == 0 ? 0.6 : -0.1, trial % 2 == 0)
        .expect_tangent(true);
}

TYPED_TEST(ElementTest, TangentOfPointsWithoutHitIsTheDerivativeOfTheResidual)
{
  std::mt19937 random(2);
  for (const bool current : {false, true})
    FacingFacets<TypeParam>(random, 0.6, current).expect_tangent(false);
}

TYPED_TEST(ElementTest, TangentOfRevolutionIsTheDerivativeOfTheResidual)
{
  if constexpr (TypeParam::F::gdim == 2)
  {
    std::mt19937 random(9);
    for (int trial = 0; trial < 12; ++trial)
    {
      const bool hit = trial % 4 != 0;
      FacingFacets<TypeParam> facets(random, trial % 3 == 0 ? 0.6 : -0.1,
                                     trial % 2 == 0);
      facets.revolve();
      facets.expect_tangent(hit);
    }
  }
}

TYPED_TEST(ElementTest, ForcesOfBothSidesAddUpToNothing)
{
  using C = TypeParam;
  using F = typename C::F;
  constexpr int D = F::gdim;
  std::mt19937 random(3);
  for (int trial = 0; trial < 100; ++trial)
  {
    const FacingFacets<C> pair(random, -0.1, trial % 2 == 0);
    const Eigen::VectorXd b = pair.residual(pair.unknowns(), true);
    Vec<D> sum = Vec<D>::Zero();
    double size = 0;
    for (int a = 0; a < F::dofs; ++a)
      for (const int side : {0, C::Layout::master})
      {
        const Vec<D> force = b.template segment<D>(side + a * D);
        sum += force;
        size += force.norm();
      }
    EXPECT_GT(size, 0.01);
    EXPECT_LT(sum.norm(), 1e-15 * (1 + size));
  }
}

TYPED_TEST(ElementTest, MomentIsThatOfTheTractionsOverTheGap)
{
  // F3: sum x cross f = int g n cross t, but for the couple of friction
  using C = TypeParam;
  using F = typename C::F;
  constexpr int D = F::gdim;
  if constexpr (F::degree == F::node_degree)
  {
    std::mt19937 random(4);
    for (int trial = 0; trial < 100; ++trial)
    {
      const FacingFacets<C> pair(random, -0.1, false);
      const Eigen::VectorXd b = pair.residual(pair.unknowns(), true);
      const auto e = pair.at(pair.unknowns());
      auto sum = moment(Vec<D>(Vec<D>::Zero()), Vec<D>(Vec<D>::Zero()));
      for (int a = 0; a < F::dofs; ++a)
      {
        sum += moment(Vec<D>(e.slave.col(a)),
                      Vec<D>(b.template segment<D>(a * D)));
        sum += moment(Vec<D>(e.master.col(a)),
                      Vec<D>(b.template segment<D>(C::Layout::master + a * D)));
      }
      for (const auto& start : pair.points)
      {
        const auto q = pair.cast(e, start);
        const typename FacingFacets<C>::Hit p(e, q);
        Vec<D> t = p.response.t;
        if (p.has_couple())
          t -= p.turning(t);
        sum -= q.area * q.g * moment(p.slave.n, t);
      }
      EXPECT_LT(sum.norm(), 1e-14);
    }
  }
}

TYPED_TEST(ElementTest, MultiplierPushesTheBodiesApart)
{
  // Compression pushes the slave against its normal in the residual's sense
  using C = TypeParam;
  constexpr int D = C::F::gdim;
  std::mt19937 random(5);
  FacingFacets<C> pair(random, -0.1, false);
  if constexpr (C::Layout::components == D)
    for (int k = 0; k < C::Layout::multipliers; ++k)
      pair.start.lam.col(k) =
          -frame_at<typename C::F>(pair.start.slave, pair.points[0].xi).n;
  const Eigen::VectorXd b = pair.residual(pair.unknowns(), true);
  Vec<D> slave = Vec<D>::Zero();
  for (int a = 0; a < C::F::dofs; ++a)
    slave += b.template segment<D>(a * D);
  const Vec<D> n =
      frame_at<typename C::F>(pair.start.slave, pair.points[0].xi).n;
  EXPECT_GT(slave.dot(n), 0);
}

TYPED_TEST(ElementTest, ScaleOfTheUnknownScalesTheConditionOnly)
{
  using C = TypeParam;
  constexpr int M = C::Layout::multiplier_dofs;
  if constexpr (M > 0)
  {
    std::mt19937 random(6);
    FacingFacets<C> pair(random, -0.1, false);
    const auto once = pair.residual(pair.unknowns(), true);
    pair.start.lam_scale *= 8;
    pair.start.lam /= 8;
    const auto other = pair.residual(pair.unknowns(), true);
    Eigen::VectorXd expected = once;
    expected.segment(C::Layout::side, M) *= 8;
    EXPECT_LT((other - expected).norm(), 1e-14);
  }
}
