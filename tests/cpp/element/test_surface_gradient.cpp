#include "facing_facets.h"
#include "raymortar/element/surface_gradient.h"

using namespace raymortar;
using namespace raymortar::test;

namespace
{
template <class C>
using Gradient =
    SurfaceGradient<typename C::F, C::multiplier_degree, typename C::Law>;

/// The point at xi with its ray cast, of unit weight in reference coordinates
template <class C>
ElementPoint<typename C::F> unit_point(const FacingFacets<C>& facets,
                                       const Vector& xi, bool hit)
{
  using F = typename C::F;
  const typename C::Data& e = facets.start;
  const auto undeformed = frame_at<F>(e.reference, xi);
  ElementPoint<F> q{xi, F::RefPoint::Zero(), 1.0, undeformed.jacobian, 0.0};
  if (revolves(e.measure))
    q.area *= circumference(undeformed.x);
  return hit ? facets.cast(e, q) : q;
}

/// What the element integrates at xi, by its residual of that one point
template <class C>
Vector integrand(const FacingFacets<C>& facets, const Vector& xi, bool hit)
{
  using Facing = FacingFacets<C>;
  const auto kernel = std::make_unique<typename C::Kernel>();
  kernel->b.setZero();
  const auto q = unit_point(facets, xi, hit);
  if (hit)
    kernel->add_hit(typename Facing::Hit(facets.start, q));
  else
    kernel->add_miss(typename Facing::Miss(facets.start, q));
  return kernel->b;
}

/// The same with its derivative, as moving segments take it
template <class C>
auto with_gradient(const FacingFacets<C>& facets, const Vector& xi, bool hit)
{
  using Facing = FacingFacets<C>;
  const typename C::Data& e = facets.start;
  const auto q = unit_point(facets, xi, hit);
  if (not hit)
    return Gradient<C>::miss(e, q, typename Facing::Miss(e, q));
  const typename Facing::Hit p(e, q);
  return Gradient<C>::hit(e, q, p, {e, q, p});
}

template <class C>
void expect_rates(const FacingFacets<C>& facets, bool hit)
{
  for (const auto& point : facets.points)
  {
    const auto found = with_gradient(facets, point.xi, hit);
    const Vector f = integrand(facets, point.xi, hit);
    EXPECT_LE((found.f - f).cwiseAbs().maxCoeff(),
              1e-14 * (1 + f.cwiseAbs().maxCoeff()));
    expect_derivative([&](const Vector& xi)
                      { return integrand(facets, xi, hit); },
                      point.xi, found.f_xi);
  }
}

template <class C>
class SurfaceGradientTest : public testing::Test
{
};
} // namespace

TYPED_TEST_SUITE(SurfaceGradientTest, ElementCases, );

TYPED_TEST(SurfaceGradientTest, IsTheDerivativeOfWhatIsIntegrated)
{
  std::mt19937 random(7);
  for (int trial = 0; trial < 12; ++trial)
    expect_rates(FacingFacets<TypeParam>(random, trial % 3 == 0 ? 0.6 : -0.1,
                                         trial % 2 == 0),
                 true);
}

TYPED_TEST(SurfaceGradientTest, OfRevolutionIsTheDerivativeOfWhatIsIntegrated)
{
  if constexpr (TypeParam::F::gdim == 2)
  {
    std::mt19937 random(8);
    for (int trial = 0; trial < 12; ++trial)
    {
      FacingFacets<TypeParam> facets(random, trial % 3 == 0 ? 0.6 : -0.1,
                                     trial % 2 == 0);
      facets.revolve();
      expect_rates(facets, trial % 4 != 0);
    }
  }
}

TYPED_TEST(SurfaceGradientTest, OfPointsWithoutHitIsThatOfTheirCondition)
{
  std::mt19937 random(2);
  for (const bool current : {false, true})
    expect_rates(FacingFacets<TypeParam>(random, 0.6, current), false);
}

TYPED_TEST(SurfaceGradientTest, TakesFieldsOfTheSlaveAlong)
{
  using C = TypeParam;
  using F = typename C::F;
  std::mt19937 random(3);
  for (int trial = 0; trial < 8; ++trial)
  {
    FacingFacets<C> facets(random, -0.1, trial % 2 == 0);
    facets.start.offset = random_vector<F::dofs>(random, 0.03);
    if constexpr (is_frictional<typename C::Law>)
    {
      auto& history = facets.start.history;
      history.has_coefficient = true;
      history.coefficient =
          Vec<F::dofs>::Constant(0.4) + random_vector<F::dofs>(random, 0.1);
      fill_random(random, history.traction_old, 0.02);
      // The surfaces have turned since the accepted step
      history.slave_old += 0.1 * random_nodes<F>(random, 0.04);
      history.master_old += 0.1 * random_nodes<F>(random, 0.04);
    }
    expect_rates(facets, true);
  }
}
