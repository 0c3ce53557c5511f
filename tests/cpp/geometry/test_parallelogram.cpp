#include "facet_types.h"
#include "raymortar/geometry/parallelogram.h"
#include <Eigen/LU>

using namespace raymortar;
using namespace raymortar::test;

TEST(Parallelogram, AreaIsTheDeterminantAndChangesItsSignWithTheOrder)
{
  std::mt19937 random(1);
  for (int trial = 0; trial < 1000; ++trial)
  {
    Mat<2, 2> sides;
    sides << random_vector<2>(random, 1.0), random_vector<2>(random, 1.0);
    const double area = parallelogram(sides.col(0), sides.col(1));
    EXPECT_NEAR(area, sides.determinant(), 1e-15);
    EXPECT_EQ(parallelogram(sides.col(1), sides.col(0)), -area);
  }
  // To the left
  EXPECT_EQ(parallelogram({2.0, 0.0}, {5.0, 3.0}), 6.0);
}
