// Elastic slip: theory (4.51), (4.52), (4.54).
#include "differences.h"
#include "raymortar/law/frictional.h"

using namespace raymortar;
using namespace raymortar::test;

namespace
{
constexpr double mu = 0.4, elastic = 0.02;

template <class Law>
using StateOf = FrictionState<3, Law::template multiplier_size<3>>;

/// Closed, pressed by 2, without a multiplier's tangential part
template <class Law>
StateOf<Law> pressed(double gamma, double elastic_slip = elastic)
{
  StateOf<Law> s;
  s.n = Vec<3>::Unit(2);
  s.gamma = gamma;
  s.touch = 1e-13;
  s.w.setZero();
  s.spring.setZero();
  s.friction = Coulomb{mu, elastic_slip};
  s.g = -2.0 / gamma;
  if constexpr (Law::template multiplier_size < 3 >> 0)
  {
    s.g = 0.0;
    s.lam = -2.0 * s.n;
  }
  return s;
}

template <class Law>
class ElasticSlip : public testing::Test
{
};
using Laws = testing::Types<FrictionalAugmentedLagrangian, FrictionalPenalty>;
TYPED_TEST_SUITE(ElasticSlip, Laws);
} // namespace

TYPED_TEST(ElasticSlip, TractionIsAShareOfTheBoundForEveryGamma)
{
  for (const double gamma : {0.1, 1.0, 1e5})
    for (const double share : {0.0, 0.3, 0.999, 1.001, 4.0})
    {
      auto s = pressed<TypeParam>(gamma);
      s.w = share * elastic * Vec<3>(0.6, -0.8, 0.0);
      const Vec<3> t =
          -mu * 2.0 * std::min(share, 1.0) * Vec<3>(0.6, -0.8, 0.0);
      if constexpr (TypeParam::template multiplier_size < 3 >> 0)
      {
        s.lam += t;
        const auto r = TypeParam::template evaluate<3>(s);
        EXPECT_LE(r.C.norm(), 1e-13);
        EXPECT_EQ(r.status,
                  share < 1.0 ? ContactStatus::stick : ContactStatus::slip);
      }
      else
        EXPECT_LE((TypeParam::template evaluate<3>(s).t - t + 2.0 * s.n).norm(),
                  1e-13);
    }
}

TYPED_TEST(ElasticSlip, WithoutPressureThereIsNoTraction)
{
  auto s = pressed<TypeParam>(1.0);
  s.g = 0.0;
  s.w = {0.5 * elastic, 0.0, 0.0};
  if constexpr (TypeParam::template multiplier_size < 3 >> 0)
  {
    s.lam.setZero();
    EXPECT_TRUE(TypeParam::template evaluate<3>(s).C.isZero(0.0));
  }
  else
    EXPECT_TRUE(TypeParam::template evaluate<3>(s).t.isZero(0.0));
}

TYPED_TEST(ElasticSlip, VanishesIntoTheRigidLaw)
{
  Random random(3);
  for (int i = 0; i < 20; ++i)
  {
    auto s = pressed<TypeParam>(1.0, 0.0);
    s.w = {0.0, 2.0, 0.0}; // slips
    s.spring = 0.1 * random.vector<3>();
    const auto rigid = TypeParam::template evaluate<3>(s);
    s.friction = Coulomb{mu, 1e-12};
    const auto soft = TypeParam::template evaluate<3>(s);
    EXPECT_LE((rigid.t - soft.t).norm() + (rigid.C - soft.C).norm(), 1e-11);
  }
}

TYPED_TEST(ElasticSlip, ChangesWithGammaAsItSays)
{
  // What a change of gamma does besides that of gap and slip times gamma
  constexpr bool has_multiplier = TypeParam::template multiplier_size < 3 >> 0;
  Random random(4);
  for (const double share : {0.5, 3.0})
    for (int i = 0; i < 20; ++i)
    {
      auto s = pressed<TypeParam>(7.0);
      s.w = share * elastic * random.unit<3>();
      s.w[2] = 0.0;
      s.spring = 0.01 * random.vector<3>();
      const auto at = [&s](double gamma)
      {
        auto moved = s;
        moved.gamma = gamma;
        const auto r = TypeParam::template evaluate<3>(moved);
        if constexpr (has_multiplier)
          return Vec<3>(r.C);
        else
          return Vec<3>(r.t);
      };
      const double h = 1e-5;
      const Vec<3> slope =
          (at(7.0 * std::exp(h)) - at(7.0 * std::exp(-h))) / (2.0 * h);
      const auto r = TypeParam::template evaluate<3>(s);
      Vec<3> expected;
      if constexpr (has_multiplier)
        expected = s.g * r.C_g + r.C_w * s.w - r.C_rate;
      else
        expected = s.g * r.t_g + r.t_w * s.w - r.t_rate;
      EXPECT_LE((slope - expected).norm(), 1e-8 * (1.0 + slope.norm()));
    }
}

TYPED_TEST(ElasticSlip, StaysWithinTheCone)
{
  Random random(5);
  for (int i = 0; i < 200; ++i)
  {
    auto s = pressed<TypeParam>(3.0);
    s.w = random.vector<3>();
    s.spring = random.vector<3>();
    const auto r = TypeParam::template evaluate<3>(s);
    Vec<3> t = r.t;
    if constexpr (TypeParam::template multiplier_size < 3 >> 0)
      t += r.C;
    t[2] = 0.0;
    EXPECT_LE(t.norm(), mu * 2.0 * (1.0 + 1e-12));
  }
}
