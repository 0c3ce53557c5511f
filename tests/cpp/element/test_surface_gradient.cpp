#include "facing_facets.h"
#include "raymortar/element/any_points.h"
#include "raymortar/element/taylor_gradient.h"

using namespace raymortar;
using namespace raymortar::test;

namespace
{
/// The point at xi with its ray cast, of unit weight in reference coordinates
template <class C>
ContactState at_point(const FacingFacets<C>& facets, const Vector& xi, bool hit)
{
  using F = typename C::F;
  const Facing<C>& e = facets.start;
  const auto undeformed = frame_at<F>(e.reference, xi);
  FacingPoint q{Vec<2>::Zero(), 1.0, undeformed.jacobian};
  q.xi.head(xi.size()) = xi;
  if (revolves(e.measure))
    q.area *= circumference(undeformed.x);
  return FacingFacets<C>::state(e, {q}, hit);
}

/// What the element integrates at xi, by its residual of that one point
template <class C>
Vector integrand(const FacingFacets<C>& facets, const Vector& xi, bool hit)
{
  const ContactState s = at_point(facets, xi, hit);
  Vector f;
  make_assembler(s)->residual(s, [&f](std::size_t, const double* b, int n)
                              { f = Eigen::Map<const Vector>(b, n); });
  return f;
}

struct Rates
{
  Vector f;
  Matrix f_xi;
};

/// The same with its derivative, as moving segments take it
template <class C>
Rates with_gradient(const FacingFacets<C>& facets, const Vector& xi, bool hit)
{
  constexpr int D = C::F::gdim;
  using Law = typename C::Law;
  using Gradient = TaylorGradient<D, Law>;
  const ContactState s = at_point(facets, xi, hit);
  AnyPoints<D, Law> points(s, {.old = is_frictional<Law>,
                               .target = true,
                               .bends = true,
                               .along = true});
  points.take(0);
  points.place(0);
  const auto& e = points.data;
  AnyIntegrand<D> out;
  if (hit)
  {
    const HitPoint<D, Law> p(e, points.at);
    Gradient::hit(e, points.at, p, {e, p}, points.shapes, out);
  }
  else
    Gradient::miss(e, SlavePoint<D, Law>(e, points.at), points.shapes, out);
  const int size = points.shapes.size();
  Rates rates{Eigen::Map<const Vector>(out.f.data(), size),
              Matrix(size, xi.size())};
  for (int j = 0; j < xi.size(); ++j)
    rates.f_xi.col(j) = Eigen::Map<const Vector>(
        out.f_xi[static_cast<std::size_t>(j)].data(), size);
  return rates;
}

template <class C>
void expect_rates(const FacingFacets<C>& facets, bool hit)
{
  for (const auto& point : facets.points)
  {
    const Vector at = point.xi.template head<C::F::tdim>();
    const Rates found = with_gradient(facets, at, hit);
    const Vector f = integrand(facets, at, hit);
    EXPECT_LE((found.f - f).cwiseAbs().maxCoeff(),
              1e-14 * (1 + f.cwiseAbs().maxCoeff()));
    expect_derivative([&](const Vector& xi)
                      { return integrand(facets, xi, hit); },
                      at, found.f_xi);
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
      auto& start = facets.start;
      start.has_coefficient = true;
      start.coefficient =
          Vec<F::dofs>::Constant(0.4) + random_vector<F::dofs>(random, 0.1);
      fill_random(random, start.traction_old, 0.02);
      // The surfaces have turned since the accepted step
      start.slave_old += 0.1 * random_nodes<F>(random, 0.04);
      start.master_old += 0.1 * random_nodes<F>(random, 0.04);
    }
    expect_rates(facets, true);
  }
}
