#include "raymortar/mortar/elements.h"
#include <gtest/gtest.h>
#include <numeric>
#include <random>
#include <set>

using namespace raymortar;

namespace
{
/// Points of 50 slave facets, up to 12 each, on up to 4 masters or none
std::pair<IntegrationPoints, Hits> random_points(std::mt19937& random)
{
  IntegrationPoints points;
  Hits hits;
  for (Index f = 0; f < 50; ++f)
    for (unsigned long q = random() % 13; q > 0; --q)
    {
      points.slave.push_back(f);
      points.xi.push_back(Vec<2>::Zero());
      hits.master.push_back(static_cast<Index>(random() % 5) - 1);
    }
  return {points, hits};
}
} // namespace

TEST(Elements, KeepEveryPointExactlyOnce)
{
  std::mt19937 random(1);
  for (int trial = 0; trial < 100; ++trial)
  {
    const auto [points, hits] = random_points(random);
    const ContactElements elements = group_points(points, hits);
    std::vector<Index> all = elements.point;
    std::sort(all.begin(), all.end());
    std::vector<Index> expected(points.size());
    std::iota(expected.begin(), expected.end(), 0);
    EXPECT_EQ(all, expected);
    EXPECT_EQ(elements.offsets.size(), elements.size() + 1);
    EXPECT_EQ(elements.offsets.back(),
              static_cast<std::int64_t>(points.size()));
  }
}

TEST(Elements, AreTheDistinctPairsOfFacets)
{
  std::mt19937 random(2);
  for (int trial = 0; trial < 100; ++trial)
  {
    const auto [points, hits] = random_points(random);
    const ContactElements elements = group_points(points, hits);
    std::set<std::pair<Index, Index>> pairs;
    for (std::size_t e = 0; e < elements.size(); ++e)
    {
      EXPECT_TRUE(pairs.emplace(elements.slave[e], elements.master[e]).second);
      EXPECT_FALSE(elements.points_of(e).empty());
      Index last = -1;
      for (const Index q : elements.points_of(e))
      {
        const auto k = static_cast<std::size_t>(q);
        EXPECT_EQ(points.slave[k], elements.slave[e]);
        EXPECT_EQ(hits.master[k], elements.master[e]);
        EXPECT_GT(q, last);
        last = q;
      }
    }
    std::set<std::pair<Index, Index>> expected;
    for (std::size_t q = 0; q < points.size(); ++q)
      expected.emplace(points.slave[q], hits.master[q]);
    EXPECT_EQ(pairs, expected);
  }
}

TEST(Elements, NoPointsGiveNoElements)
{
  const ContactElements elements = group_points({}, {});
  EXPECT_EQ(elements.size(), 0u);
  EXPECT_EQ(elements.offsets, (std::vector<std::int64_t>{0}));
}
