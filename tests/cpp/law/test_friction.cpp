#include "differences.h"
#include "raymortar/law/friction.h"
#include <gtest/gtest.h>

using namespace raymortar;

namespace
{
double bound(const FrictionLaw& law, double p) { return bound_at(law, p).s; }

/// The derivative against central differences at a pressure
void expect_slope(const FrictionLaw& law, double p)
{
  const double h = 1e-3;
  const double slope = (bound(law, p + h) - bound(law, p - h)) / (2.0 * h);
  EXPECT_NEAR(bound_at(law, p).s_p, slope, 1e-12);
}
} // namespace

TEST(Friction, CoulombHoldsAShareOfThePressure)
{
  EXPECT_DOUBLE_EQ(bound(Coulomb{0.3}, -2.0), 0.6);
  EXPECT_DOUBLE_EQ(bound_at(Coulomb{0.3}, -2.0).s_p, -0.3);
  EXPECT_EQ(bound(Coulomb{0.0}, -2.0), 0.0);
  expect_slope(Coulomb{0.3}, -2.0);
}

TEST(Friction, CoulombHoldsNothingWithoutPressure)
{
  EXPECT_EQ(bound(Coulomb{0.3}, 0.0), 0.0);
}

TEST(Friction, BoundIsNeverNegative)
{
  // Bodies that touch exactly: p > 0 by rounding
  for (const double p : {1e-300, 1e-15, 1e-3})
    for (const FrictionLaw& law :
         {FrictionLaw(Coulomb{0.3}), FrictionLaw(Tresca{0.1}),
          FrictionLaw(Stick{})})
      EXPECT_GE(bound(law, p), 0.0);
}

TEST(Friction, TrescaDoesNotDependOnThePressure)
{
  for (const double p : {0.0, -1e-9, -2.0, -1e9})
  {
    EXPECT_DOUBLE_EQ(bound(Tresca{0.4}, p), 0.4);
    EXPECT_EQ(bound_at(Tresca{0.4}, p).s_p, 0.0);
  }
}

TEST(Friction, CoefficientsMayDifferFromPointToPoint)
{
  EXPECT_DOUBLE_EQ(bound(with_coefficient(Coulomb{0.3}, 0.5), -2.0), 1.0);
  EXPECT_DOUBLE_EQ(bound(with_coefficient(Tresca{0.3}, 0.5), -2.0), 0.5);
  EXPECT_EQ(bound(with_coefficient(Stick{}, 0.5), -2.0),
            std::numeric_limits<double>::infinity());
  const double h = 1e-3, p = -2.0;
  for (const FrictionLaw& law :
       {FrictionLaw(Coulomb{0.3}), FrictionLaw(Tresca{0.3}),
        FrictionLaw(Stick{})})
  {
    const auto s = [&](double c) { return bound(with_coefficient(law, c), p); };
    const double slope = std::holds_alternative<Stick>(law)
                             ? 0.0
                             : (s(0.3 + h) - s(0.3 - h)) / (2.0 * h);
    EXPECT_NEAR(bound_at(law, p).s_coefficient, slope, 1e-12);
  }
}

TEST(Friction, StickHasNoBound)
{
  EXPECT_EQ(bound(Stick{}, -1.0), std::numeric_limits<double>::infinity());
  EXPECT_EQ(bound(Stick{}, 0.0), std::numeric_limits<double>::infinity());
  // Finite, or it would make NaN of a zero change of p
  EXPECT_EQ(bound_at(Stick{}, -1.0).s_p, 0.0);
}
