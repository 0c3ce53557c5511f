#include "raymortar/core/sorted.h"
#include <gtest/gtest.h>
#include <random>
#include <set>

using namespace raymortar;

TEST(Sorted, ValuesAreThoseOfASet)
{
  std::mt19937 random(1);
  for (std::size_t n = 0; n < 50; ++n)
  {
    std::vector<int> values(n);
    for (int& value : values)
      value = static_cast<int>(random() % 20);
    const std::set<int> expected(values.begin(), values.end());
    sort_unique(values);
    EXPECT_EQ(values, std::vector<int>(expected.begin(), expected.end()));
  }
}
