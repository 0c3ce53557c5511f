#include "facing_facets.h"
#include "raymortar/core/error.h"

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
    const Vector b = pair.residual(pair.unknowns(), true);
    Vec<D> sum = Vec<D>::Zero();
    double size = 0;
    for (int a = 0; a < F::dofs; ++a)
      for (const int side : {0, C::master})
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
      const Vector b = pair.residual(pair.unknowns(), true);
      const auto e = pair.at(pair.unknowns());
      auto sum = moment(Vec<D>(Vec<D>::Zero()), Vec<D>(Vec<D>::Zero()));
      for (int a = 0; a < F::dofs; ++a)
      {
        sum += moment(Vec<D>(e.slave.col(a)),
                      Vec<D>(b.template segment<D>(a * D)));
        sum += moment(Vec<D>(e.master.col(a)),
                      Vec<D>(b.template segment<D>(C::master + a * D)));
      }
      const ContactState state = FacingFacets<C>::state(e, pair.points, true);
      const PointResults points = make_assembler(state)->results(state);
      const bool has_couple =
          FacingFacets<C>::has_friction and
          (C::components == 0 or e.offset[0] != 0.0 or e.couples_over_gaps);
      for (std::size_t q = 0; q < pair.points.size() and not has_couple; ++q)
      {
        const Vec<D> n(points.normal.data() + D * q);
        const Vec<D> t(points.traction.data() + D * q);
        sum -= pair.points[q].area * state.hits.gap[q] * moment(n, t);
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
  if constexpr (C::components == D)
    for (int k = 0; k < C::multipliers; ++k)
      pair.start.lam.col(k) =
          -frame_at<typename C::F>(
               pair.start.slave, pair.points[0].xi.template head<C::F::tdim>())
               .n;
  const Vector b = pair.residual(pair.unknowns(), true);
  Vec<D> slave = Vec<D>::Zero();
  for (int a = 0; a < C::F::dofs; ++a)
    slave += b.template segment<D>(a * D);
  const Vec<D> n =
      frame_at<typename C::F>(pair.start.slave,
                              pair.points[0].xi.template head<C::F::tdim>())
          .n;
  EXPECT_GT(slave.dot(n), 0);
}

TYPED_TEST(ElementTest, ScaleOfTheUnknownScalesTheConditionOnly)
{
  using C = TypeParam;
  constexpr int M = C::multiplier_dofs;
  if constexpr (M > 0)
  {
    std::mt19937 random(6);
    FacingFacets<C> pair(random, -0.1, false);
    const auto once = pair.residual(pair.unknowns(), true);
    pair.start.lam_scale *= 8;
    pair.start.lam /= 8;
    const auto other = pair.residual(pair.unknowns(), true);
    Vector expected = once;
    expected.segment(C::side, M) *= 8;
    EXPECT_LT((other - expected).norm(), 1e-14);
  }
}

TEST(Assembler, RefusesMultipliersOfADegreeThatIsNotStable)
{
  using C = Case<Triangle2, 1, NormalAugmentedLagrangian>;
  std::mt19937 random(1);
  const FacingFacets<C> pair(random, -0.1, false);
  ContactState s = FacingFacets<C>::state(pair.start, pair.points, true);
  EXPECT_NO_THROW((void)make_assembler(s));
  for (const int degree : {0, 2})
  {
    s.multipliers.degree = degree;
    EXPECT_THROW((void)make_assembler(s), Error);
  }
}
