#include "raymortar/pairing/distances.h"
#include <gtest/gtest.h>

using namespace raymortar;

TEST(Distances, AreWidenedFacetByFacet)
{
  const std::vector<double> reach{0.0, 0.5}, depth{0.25, 0.0};
  const FacetDistances local({{1.0, 2.0, 0.1}, {3.0, 4.0, 0.2}}, true);
  for (const FacetDistances& before : {local, FacetDistances(1.0, 2.0, 0.1)})
  {
    const FacetDistances after = before.widened(reach, depth);
    EXPECT_EQ(after.depth_is_default(), before.depth_is_default());
    for (const Index f : {0, 1})
    {
      const auto k = static_cast<std::size_t>(f);
      EXPECT_EQ(after[f].reach, before[f].reach + reach[k]);
      EXPECT_EQ(after[f].depth, before[f].depth + depth[k]);
      EXPECT_EQ(after[f].skin, before[f].skin);
    }
  }
}
