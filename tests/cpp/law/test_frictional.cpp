#include "differences.h"
#include "raymortar/law/augmented.h"
#include "raymortar/law/frictional.h"
#include "raymortar/law/penalty.h"

using namespace raymortar;
using namespace raymortar::test;

namespace
{
constexpr double gamma_ = 3.0;
constexpr double touch = 1e-11;

template <int D_, class Law_>
struct Kind
{
  static constexpr int D = D_;
  using Law = Law_;
  static constexpr int M = Law::template multiplier_size<D>;
  using State = FrictionState<D, M>;
  /// Inputs one after the other: n, g, w, the spring, then lam
  static constexpr int size = 3 * D + 1 + M;

  [[nodiscard]] static Vector stacked(const State& s)
  {
    Vector x(size);
    x << s.n, s.g, s.w, s.spring, s.lam;
    return x;
  }

  [[nodiscard]] static State state(const Vector& x, const FrictionLaw& law)
  {
    State s;
    s.n = x.head<D>();
    s.g = x[D];
    s.gamma = gamma_;
    s.touch = touch;
    s.w = x.segment<D>(D + 1);
    s.spring = x.segment<D>(2 * D + 1);
    s.lam = x.tail<M>();
    s.friction = law;
    return s;
  }

  [[nodiscard]] static auto evaluate(const State& s)
  {
    return Law::template evaluate<D>(s);
  }

  /// t and C one after the other
  [[nodiscard]] static Vector value(const State& s)
  {
    const auto r = evaluate(s);
    Vector y(D + M);
    y << r.t, r.C;
    return y;
  }

  [[nodiscard]] static Matrix derivative(const State& s)
  {
    const auto r = evaluate(s);
    Matrix J(D + M, size);
    J << r.t_n, r.t_g, r.t_w, r.t_spring, r.t_lam, r.C_n, r.C_g, r.C_w,
        r.C_spring, r.C_lam;
    return J;
  }

  /// Random state; the gap decides whether it is open
  [[nodiscard]] static State random_state(Random& random, double g,
                                          const FrictionLaw& law)
  {
    const Vec<D> n = random.unit<D>(), w = 0.3 * random.vector<D>(),
                 last = 0.5 * random.vector<D>();
    Vector x(size);
    if constexpr (M > 0)
      x << n, g, w, 0.1 * random.vector<D>(), last;
    else
      x << n, g, w, last;
    return state(x, law);
  }

  /// Tangential traction before it is projected
  [[nodiscard]] static Vec<D> trial_traction(const State& s)
  {
    Vec<D> z = s.spring - gamma_ * s.w;
    if constexpr (M > 0)
      z += s.lam;
    return z - s.n.dot(z) * s.n;
  }

  /// Its length
  [[nodiscard]] static double trial(const State& s)
  {
    return trial_traction(s).norm();
  }
};

using Kinds =
    testing::Types<Kind<2, FrictionalAugmentedLagrangian>,
                   Kind<3, FrictionalAugmentedLagrangian>,
                   Kind<2, FrictionalPenalty>, Kind<3, FrictionalPenalty>>;
template <class K>
class Frictional : public testing::Test
{
};
TYPED_TEST_SUITE(Frictional, Kinds);

/// A law whose bound is `share` of the trial traction; share 0: no bound
template <class K>
std::vector<FrictionLaw> laws_at(const typename K::State& s, double share)
{
  if (share == 0.0)
    return {Stick{}};
  const double q = K::trial(s);
  const double p = K::evaluate(s).p;
  // The disc of elastic slip has the same radius
  const double reach = (K::M > 0 ? 0.4 : 1.0) * share * q / gamma_;
  return {Coulomb{-share * q / p}, Tresca{share * q},
          Coulomb{-0.6 * share * q / p, reach}};
}

template <class K>
void expect_exact(typename K::State s, const FrictionLaw& law,
                  ContactStatus status)
{
  s.friction = law;
  EXPECT_EQ(K::evaluate(s).status, status);
  const auto f = [&law](const Vector& x) { return K::value(K::state(x, law)); };
  expect_derivative(f, K::stacked(s), K::derivative(s));
}
} // namespace

TYPED_TEST(Frictional, DerivativesInStick)
{
  Random random(1);
  for (int i = 0; i < 50; ++i)
  {
    const auto s = TypeParam::random_state(random, -1.0, Stick{});
    for (const double share : {0.0, 1.3})
      for (const FrictionLaw& law : laws_at<TypeParam>(s, share))
        expect_exact<TypeParam>(s, law, ContactStatus::stick);
  }
}

TYPED_TEST(Frictional, DerivativesInSlip)
{
  Random random(2);
  for (int i = 0; i < 50; ++i)
  {
    const auto s = TypeParam::random_state(random, -1.0, Stick{});
    if (TypeParam::trial(s) < 0.3)
      continue; // curvature beyond what the steps resolve
    for (const FrictionLaw& law : laws_at<TypeParam>(s, 0.7))
      expect_exact<TypeParam>(s, law, ContactStatus::slip);
  }
}

TYPED_TEST(Frictional, DerivativesWhereOpen)
{
  Random random(3);
  for (const FrictionLaw& law :
       {FrictionLaw(Coulomb{0.3}), FrictionLaw(Tresca{0.2}),
        FrictionLaw(Stick{})})
    expect_exact<TypeParam>(TypeParam::random_state(random, 2.0, law), law,
                            ContactStatus::open);
}

TYPED_TEST(Frictional, DerivativesOfALawOfPressureAndSlipRate)
{
  // s = 0.2 - 0.1 p + 0.05 (|p| |T_n w|)^(1/2), known where it is evaluated
  constexpr int D = TypeParam::D;
  Random random(12);
  int slipping = 0;
  for (int i = 0; i < 50; ++i)
  {
    const auto with_law = [](typename TypeParam::State s)
    {
      s.friction = Stick{};
      const double p = TypeParam::evaluate(s).p;
      const double v = (s.w - s.n.dot(s.w) * s.n).norm();
      const double root = 0.05 * std::sqrt(-p * v);
      s.friction = PointBound{0.2 - 0.1 * p + root, -0.1 + 0.5 * root / p,
                              0.5 * root / v};
      return s;
    };
    const auto s = with_law(TypeParam::random_state(random, -1.0, Stick{}));
    const auto along = (s.w - s.n.dot(s.w) * s.n).eval();
    if (TypeParam::trial(s) < 0.5 or along.norm() < 0.05 or
        TypeParam::trial(s) < std::get<PointBound>(s.friction).s + 0.02)
      continue;
    const auto f = [&](const Vector& x)
    { return TypeParam::value(with_law(TypeParam::state(x, Stick{}))); };
    expect_derivative(f, TypeParam::stacked(s), TypeParam::derivative(s));
    const auto r = TypeParam::evaluate(s);
    const Vec<D> direction = along / along.norm();
    const double s_slip = std::get<PointBound>(s.friction).s_slip;
    const Vec<D> q = TypeParam::trial_traction(s).normalized();
    if constexpr (TypeParam::M == 0)
      EXPECT_LT((r.t_rate - s_slip * along.dot(direction) * q).norm(), 1e-14);
    else
      EXPECT_LT((r.C_rate - s_slip * along.dot(direction) * q).norm(), 1e-14);
    ++slipping;
  }
  EXPECT_GT(slipping, 10);
}

TYPED_TEST(Frictional, BothDerivativesMeetAtTheOnsetOfSlip)
{
  constexpr int D = TypeParam::D;
  Random random(4);
  for (int i = 0; i < 50; ++i)
  {
    auto s = TypeParam::random_state(random, -1.0, Stick{});
    const Vec<D> q = TypeParam::trial_traction(s);
    if (q.norm() < 0.3)
      continue;
    // Just inside, then shorter; outside by more than `touch` and what it
    // fades over, then longer
    for (const double side : {1.0, -1.0})
    {
      const FrictionLaw law =
          Tresca{q.norm() - (side < 0.0 ? 2.0 * fade : -0.5) * gamma_ * touch};
      s.friction = law;
      EXPECT_EQ(TypeParam::evaluate(s).status,
                side > 0.0 ? ContactStatus::stick : ContactStatus::slip);
      Vector d = Vector::Zero(TypeParam::size);
      d.segment<D>(D + 1) = side / gamma_ * q;
      const auto f = [&law](const Vector& x)
      { return TypeParam::value(TypeParam::state(x, law)); };
      expect_one_sided(f, TypeParam::stacked(s), d, TypeParam::derivative(s));
    }
  }
}

TYPED_TEST(Frictional, SlipsShorterThanTouchAreStick)
{
  // On the cone, then moved on against the traction
  constexpr int D = TypeParam::D;
  Random random(9);
  for (int i = 0; i < 50; ++i)
  {
    auto s = TypeParam::random_state(random, -1.0, Stick{});
    const Vec<D> q = TypeParam::trial_traction(s);
    for (const double slip : {-0.5, -1e-5, 0.0, 1e-5, 0.5, 2.0})
    {
      auto moved = s;
      moved.w -= slip * touch * q.normalized();
      for (const FrictionLaw& law : laws_at<TypeParam>(s, 1.0))
      {
        moved.friction = law;
        EXPECT_EQ(TypeParam::evaluate(moved).status,
                  slip < 1.0 ? ContactStatus::stick : ContactStatus::slip);
      }
    }
  }
}

TYPED_TEST(Frictional, OpenCarriesNothing)
{
  Random random(5);
  auto s = TypeParam::random_state(random, 2.0, Coulomb{0.3});
  const auto r = TypeParam::evaluate(s);
  EXPECT_EQ(r.status, ContactStatus::open);
  EXPECT_EQ(r.p, 0.0);
  if constexpr (TypeParam::M > 0)
  {
    EXPECT_EQ(r.C, Vec<TypeParam::D>(-s.lam));
  }
  else
  {
    EXPECT_TRUE(r.t.isZero(0.0));
  }
}

TYPED_TEST(Frictional, ExactTouchIsStickAndFinite)
{
  // Gap of rounding error on either side, no traction yet
  constexpr int D = TypeParam::D;
  for (const double g : {0.0, 1e-16, -1e-16})
    for (const FrictionLaw& law :
         {FrictionLaw(Coulomb{0.3}), FrictionLaw(Tresca{0.2}),
          FrictionLaw(Stick{})})
    {
      Vector x = Vector::Zero(TypeParam::size);
      x[D - 1] = 1.0;
      x[D] = g;
      const auto s = TypeParam::state(x, law);
      EXPECT_EQ(TypeParam::evaluate(s).status, ContactStatus::stick);
      EXPECT_TRUE(TypeParam::value(s).allFinite());
      EXPECT_TRUE(TypeParam::derivative(s).allFinite());
    }
}

TYPED_TEST(Frictional, CoulombWithoutFrictionIsTheFrictionlessLaw)
{
  constexpr int D = TypeParam::D;
  Random random(6);
  for (const double g : {-1.0, 2.0})
  {
    const auto s = TypeParam::random_state(random, g, Coulomb{0.0});
    const auto r = TypeParam::evaluate(s);
    if constexpr (TypeParam::M > 0)
    {
      const auto o = VectorAugmentedLagrangian::evaluate<D>(s);
      EXPECT_LE((r.C - o.C).norm(), 1e-14);
      EXPECT_LE((r.C_lam - o.C_lam).norm(), 1e-14);
      EXPECT_LE((r.C_n - o.C_n).norm(), 1e-14);
      EXPECT_LE((r.C_g - o.C_g).norm(), 1e-14);
      EXPECT_TRUE(r.C_w.isZero(0.0));
    }
    else
    {
      const auto o = NormalPenalty::evaluate<D>(s);
      EXPECT_LE((r.t - o.t).norm(), 1e-14);
      EXPECT_LE((r.t_n - o.t_n).norm(), 1e-14);
      EXPECT_LE((r.t_g - o.t_g).norm(), 1e-14);
    }
  }
}

TYPED_TEST(Frictional, TurnsWithItsArguments)
{
  constexpr int D = TypeParam::D;
  Random random(7);
  for (int i = 0; i < 20; ++i)
  {
    auto s = TypeParam::random_state(random, -1.0, Coulomb{0.3});
    const Mat<D, D> Q = random.template rotation<D>();
    auto turned = s;
    turned.n = Q * s.n;
    turned.w = Q * s.w;
    turned.spring = Q * s.spring;
    if constexpr (TypeParam::M > 0)
      turned.lam = Q * s.lam;
    const auto a = TypeParam::evaluate(s), b = TypeParam::evaluate(turned);
    EXPECT_EQ(a.status, b.status);
    EXPECT_LE((Q * a.t - b.t).norm(), 1e-13);
    if constexpr (TypeParam::M > 0)
    {
      EXPECT_LE((Q * a.C - b.C).norm(), 1e-13);
    }
  }
}

TEST(FrictionalPenalty, SlipDissipates)
{
  Random random(8);
  for (int i = 0; i < 200; ++i)
  {
    auto s =
        Kind<3, FrictionalPenalty>::random_state(random, -0.5, Coulomb{0.4});
    s.spring.setZero();
    const auto r = FrictionalPenalty::evaluate<3>(s);
    const Vec<3> t_t = r.t - s.n.dot(r.t) * s.n;
    EXPECT_LE(t_t.dot(s.w), 0.0);
    EXPECT_LE(t_t.norm(), 0.4 * -r.p * (1.0 + 1e-14));
  }
}

TEST(FrictionalPenalty, SpringHoldsWithoutSlip)
{
  auto s = Kind<3, FrictionalPenalty>::state(Vector::Zero(10), Stick{});
  s.n = Vec<3>::Unit(2);
  s.g = -0.5;
  s.spring = {0.2, -0.1, 5.0}; // what is along n drops out
  const auto r = FrictionalPenalty::evaluate<3>(s);
  EXPECT_LE((r.t - Vec<3>(0.2, -0.1, -0.5 * gamma_)).norm(), 1e-15);
}

TEST(FrictionalAugmentedLagrangian, SolutionsAreFixedPointsForEveryGamma)
{
  // In stick w = 0 and g = 0 whatever lam inside the cone; in slip lam has the
  // length of the bound and opposes w
  for (const double gamma : {0.1, 1.0, 1e3})
  {
    auto s = Kind<3, FrictionalAugmentedLagrangian>::state(Vector::Zero(10),
                                                           Coulomb{0.5});
    s.gamma = gamma;
    s.n = Vec<3>::Unit(2);
    s.lam = {0.3, 0.1, -2.0};
    EXPECT_LE(FrictionalAugmentedLagrangian::evaluate<3>(s).C.norm(), 1e-15);
    s.lam = {0.6, -0.8, -2.0};
    s.w = {-0.06, 0.08, 0.0};
    EXPECT_LE(FrictionalAugmentedLagrangian::evaluate<3>(s).C.norm(), 1e-14);
    s.w = -s.w;
    EXPECT_GT(FrictionalAugmentedLagrangian::evaluate<3>(s).C.norm(),
              0.1 * std::min(gamma, 1.0) * s.w.norm());
  }
}
