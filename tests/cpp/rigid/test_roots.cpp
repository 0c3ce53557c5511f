#include "raymortar/rigid/roots.h"
#include <gtest/gtest.h>

namespace raymortar
{
namespace
{
/// (t - a)(t - b)(t^2 + c)
Polynomial<4> two_real_roots(double a, double b, double c)
{
  return {a * b * c, -(a + b) * c, a * b + c, -(a + b), 1.0};
}

TEST(Roots, AllFourOfAQuartic)
{
  // (t + 2)(t + 1)(t - 1)(t - 3)
  const auto roots = sign_changes<4>({6.0, 1.0, -7.0, -1.0, 1.0});
  ASSERT_EQ(roots.size, 4);
  const double places[] = {-2.0, -1.0, 1.0, 3.0};
  for (std::size_t k = 0; k < 4; ++k)
  {
    EXPECT_NEAR(roots.at[k].place, places[k], 1e-13);
    EXPECT_EQ(roots.at[k].rises, k % 2 == 1);
  }
}

TEST(Roots, ComplexOnesDoNotCount)
{
  const auto roots = sign_changes<4>(two_real_roots(0.25, 4.0, 2.0));
  ASSERT_EQ(roots.size, 2);
  EXPECT_NEAR(roots.at[0].place, 0.25, 1e-14);
  EXPECT_NEAR(roots.at[1].place, 4.0, 1e-13);
  EXPECT_EQ(sign_changes<4>({1.0, 0.0, 2.0, 0.0, 1.0}).size, 0);
}

TEST(Roots, CloseOnesAreToldApart)
{
  const auto roots = sign_changes<4>(two_real_roots(1.0, 1.0 + 1e-5, 3.0));
  ASSERT_EQ(roots.size, 2);
  EXPECT_NEAR(roots.at[0].place, 1.0, 1e-9);
  EXPECT_NEAR(roots.at[1].place, 1.0 + 1e-5, 1e-9);
}
} // namespace
} // namespace raymortar
