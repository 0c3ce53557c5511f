#include "differences.h"
#include "raymortar/law/augmented.h"
#include "raymortar/law/penalty.h"
#include <random>

using namespace raymortar;
using namespace raymortar::test;

namespace
{
template <class L, int Dim>
struct Case
{
  using Law = L;
  static constexpr int D = Dim;
  static constexpr int M = L::template multiplier_size<Dim>;
  using State = PointState<D, M>;
  using Response = PointResponse<D, M>;
};

template <class C>
typename C::Response evaluate(const typename C::State& s)
{
  return C::Law::template evaluate<C::D>(s);
}

/// State with normal pressure `lam_n` (compression < 0) and some shear
template <class C>
typename C::State state(std::mt19937& random, double g, double lam_n)
{
  std::uniform_real_distribution<double> unit(-1, 1);
  typename C::State s{};
  for (int i = 0; i < C::D; ++i)
    s.n[i] = unit(random);
  s.n.normalize();
  s.g = g;
  s.gamma = 3;
  if constexpr (C::M == 1)
    s.lam[0] = lam_n;
  if constexpr (C::M == C::D)
  {
    for (int i = 0; i < C::D; ++i)
      s.lam[i] = unit(random);
    s.lam += (lam_n - s.lam.dot(s.n)) * s.n;
  }
  return s;
}

/// Normal traction of the augmented law from the state's own multiplier
template <class C>
double trial(const typename C::State& s)
{
  if constexpr (C::M == 0)
    return s.gamma * s.g;
  else if constexpr (C::M == 1)
    return s.lam[0] + s.gamma * s.g;
  else
    return s.lam.dot(s.n) + s.gamma * s.g;
}

/// Multiplier as a vector in space
template <class C>
Vec<C::D> traction(const typename C::State& s)
{
  if constexpr (C::M == 0)
    return std::min(0.0, s.gamma * s.g) * s.n;
  else if constexpr (C::M == 1)
    return s.lam[0] * s.n;
  else
    return s.lam;
}

/// (n, g, lam) as one vector, and back into a state
template <class C>
Eigen::VectorXd arguments(const typename C::State& s)
{
  Eigen::VectorXd x(C::D + 1 + C::M);
  x << s.n, s.g, s.lam;
  return x;
}
template <class C>
typename C::State with(typename C::State s, const Eigen::VectorXd& x)
{
  s.n = x.template head<C::D>();
  s.g = x[C::D];
  s.lam = x.template tail<C::M>();
  return s;
}

template <class C>
void expect_derivatives(const typename C::State& s)
{
  const auto r = evaluate<C>(s);
  Eigen::MatrixXd J(C::D + C::M, C::D + 1 + C::M);
  J << r.t_n, r.t_g, r.t_lam, r.C_n, r.C_g, r.C_lam;
  expect_derivative(
      [&](const Eigen::VectorXd& x)
      {
        const auto at = evaluate<C>(with<C>(s, x));
        Eigen::VectorXd f(C::D + C::M);
        f << at.t, at.C;
        return f;
      },
      arguments<C>(s), J);
}

template <class C>
class LawTest : public testing::Test
{
};
using Cases = testing::Types<
    Case<NormalAugmentedLagrangian, 2>, Case<NormalAugmentedLagrangian, 3>,
    Case<VectorAugmentedLagrangian, 2>, Case<VectorAugmentedLagrangian, 3>,
    Case<NormalPenalty, 2>, Case<NormalPenalty, 3>>;
} // namespace

TYPED_TEST_SUITE(LawTest, Cases, );

TYPED_TEST(LawTest, OpenPointDrivesTheMultiplierToZero)
{
  using C = TypeParam;
  std::mt19937 random(1);
  for (const double lam_n : {0.0, -0.5, 0.5})
  {
    const auto s = state<C>(random, 0.3, lam_n);
    const auto r = evaluate<C>(s);
    EXPECT_EQ(r.status, ContactStatus::open);
    EXPECT_EQ(r.p, 0);
    EXPECT_LT((r.C + s.lam).norm(), 1e-15);
    EXPECT_LT((r.C_lam + Mat<C::M, C::M>::Identity()).norm(), 1e-15);
    EXPECT_EQ(r.C_g.norm(), 0);
    EXPECT_EQ(r.t_g.norm(), 0);
    if constexpr (C::M > 0)
    {
      EXPECT_LT((C::Law::template without_hit<C::D>(s.lam) - r.C).norm(),
                1e-15);
    }
  }
}

TYPED_TEST(LawTest, TractionIsTheMultiplier)
{
  // Elements take these derivatives as they are here without looking
  using C = TypeParam;
  std::mt19937 random(7);
  for (const double g : {-0.2, 0.3})
  {
    const auto r = evaluate<C>(state<C>(random, g, -0.5));
    if constexpr (C::M > 0)
    {
      EXPECT_TRUE(r.t_g.isZero(0));
    }
    if constexpr (C::M == C::D)
    {
      EXPECT_TRUE(r.t_n.isZero(0));
      EXPECT_TRUE(r.t_lam.isIdentity(0));
    }
  }
}

TYPED_TEST(LawTest, ClosedPointAsksForNoGap)
{
  using C = TypeParam;
  std::mt19937 random(2);
  for (const double g : {-0.2, -1e-12})
  {
    const auto s = state<C>(random, g, -0.5);
    const auto r = evaluate<C>(s);
    EXPECT_EQ(r.status, ContactStatus::slip);
    EXPECT_NEAR(r.p, trial<C>(s), 1e-15);
    EXPECT_LT(r.p, 0);
    EXPECT_LT((r.t - traction<C>(s)).norm(), 1e-15);
    if constexpr (C::M == 1)
    {
      EXPECT_NEAR(r.C[0], s.gamma * g, 1e-16);
    }
    // The vector multiplier is to be normal as well: no friction
    if constexpr (C::M == C::D)
    {
      EXPECT_LT((r.C - (r.p * s.n - s.lam)).norm(), 1e-15);
      EXPECT_NEAR(r.C.dot(s.n), s.gamma * g, 1e-15);
    }
  }
}

TYPED_TEST(LawTest, PullingMultiplierOpensAPenetratingPoint)
{
  using C = TypeParam;
  if constexpr (C::M > 0)
  {
    std::mt19937 random(3);
    const auto r = evaluate<C>(state<C>(random, -0.1, 0.5));
    EXPECT_EQ(r.status, ContactStatus::open);
  }
}

TYPED_TEST(LawTest, TouchingPointIsClosedUpToTheTolerance)
{
  using C = TypeParam;
  std::mt19937 random(4);
  for (const double touch : {0.0, 1e-9})
  {
    auto s = state<C>(random, 0, 0);
    s.lam.setZero();
    s.touch = touch;
    EXPECT_EQ(evaluate<C>(s).status, ContactStatus::slip);
    s.g = 0.5 * touch;
    EXPECT_EQ(evaluate<C>(s).status, ContactStatus::slip);
    s.g = 1.5 * touch + 1e-12;
    EXPECT_EQ(evaluate<C>(s).status, ContactStatus::open);
  }
}

TYPED_TEST(LawTest, DerivativesAreThoseOfTheValues)
{
  using C = TypeParam;
  std::mt19937 random(5);
  for (int k = 0; k < 20; ++k)
  {
    expect_derivatives<C>(state<C>(random, 0.5, 0.1));
    expect_derivatives<C>(state<C>(random, 0.5, -0.4));
    expect_derivatives<C>(state<C>(random, -0.3, -0.4));
    expect_derivatives<C>(state<C>(random, -0.5, 0.2));
  }
}

TYPED_TEST(LawTest, TurningTheStateTurnsTheTraction)
{
  using C = TypeParam;
  std::mt19937 random(6);
  for (const double g : {0.3, -0.3})
  {
    auto s = state<C>(random, g, -0.2);
    const auto r = evaluate<C>(s);
    // Reflection on the first axes' diagonal
    const auto turned = [](Vec<C::D> v)
    {
      std::swap(v[0], v[1]);
      return v;
    };
    s.n = turned(s.n);
    if constexpr (C::M == C::D)
      s.lam = turned(s.lam);
    EXPECT_LT((evaluate<C>(s).t - turned(r.t)).norm(), 1e-15);
    EXPECT_NEAR(evaluate<C>(s).C.norm(), r.C.norm(), 1e-15);
  }
}
