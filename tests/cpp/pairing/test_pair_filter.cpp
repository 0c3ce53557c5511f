#include "raymortar/mortar/filtered.h"
#include "rules.h"
#include "surfaces.h"
#include <algorithm>
#include <gtest/gtest.h>

using namespace raymortar;
using namespace raymortar::test;

namespace
{
/// One slave facet that looks up, and a plate that looks down on it
struct Wall
{
  Surface slave, master;
  PairFilter filter;

  explicit Wall(double height, int dim = 2)
  {
    const Shape shape = dim == 2 ? Shape::interval : Shape::triangle;
    slave = make_surface({shape, 1, 1, 1, true}, plate(0.5, 0));
    master = make_surface({shape, 1, 1, 2, false}, plate(1, height));
    const auto facets = [](const Surface& s)
    { return static_cast<std::size_t>(s.num_facets()); };
    // What lies between the two is the body behind both
    slave.thickness.assign(facets(slave), std::abs(height));
    master.thickness.assign(facets(master), std::abs(height));
    filter.offsets.assign(facets(slave) + 1, 0);
  }

  [[nodiscard]] std::size_t hits(const PairFilter* used) const
  {
    const std::vector<SearchDistances> each(
        static_cast<std::size_t>(slave.num_facets()), {1.0, 1.0, 0.0});
    const FacetDistances range(each, true);
    Candidates all = compare_all_boxes(slave, master, range);
    if (used)
      erase_neighbours(all, master, *used);
    const Segmentation s =
        make_segments(slave, master, all, {range, false}, used);
    const IntegrationPoints points =
        make_points(slave, s, segment_rules(slave.shape, 2), {}, false);
    const Hits found = cast_rays(slave, master, points, range, used);
    return static_cast<std::size_t>(
        std::count(found.status.begin(), found.status.end(), RayStatus::hit));
  }
};
} // namespace

TEST(PairFilter, AllowsAllButNeighbours)
{
  const PairFilter filter{{0, 2, 2, 3}, {3, 70, 5}};
  EXPECT_FALSE(filter.allows(0, 3));
  EXPECT_FALSE(filter.allows(0, 70));
  EXPECT_TRUE(filter.allows(0, 5));
  EXPECT_TRUE(filter.allows(1, 3));
  EXPECT_FALSE(filter.allows(2, 5));
}

TEST(PairFilter, ErasesNeighboursAndKeepsTheOrder)
{
  Surface master;
  master.facet_id = {3, 5, 70};
  Candidates candidates{{0, 3, 5, 7}, {0, 1, 2, 0, 1, 1, 2}};
  erase_neighbours(candidates, master, {{0, 2, 2, 3}, {3, 70, 5}});
  EXPECT_EQ(candidates.offsets, (std::vector<std::int64_t>{0, 1, 3, 4}));
  EXPECT_EQ(candidates.masters, (std::vector<Index>{1, 0, 1, 2}));
}

TEST(PairFilter, TheBackOfAWallIsNoContact)
{
  for (const int dim : {2, 3})
  {
    const Wall wall(-0.3, dim);
    EXPECT_GT(wall.hits(nullptr), 0U);
    EXPECT_EQ(wall.hits(&wall.filter), 0U);
  }
}

TEST(PairFilter, AnotherFoldIsContactUpToHalfOfTheWall)
{
  for (const double depth : {0.4, 0.49, 0.51, 0.6})
  {
    Wall wall(-0.3);
    wall.slave.thickness.assign(wall.slave.thickness.size(), 0.3 / depth);
    wall.master.thickness.assign(wall.master.thickness.size(), 0.3 / depth);
    EXPECT_EQ(wall.hits(&wall.filter) > 0, depth < 0.5) << depth;
  }
}

TEST(PairFilter, FacetsThatShareAVertexNeverPair)
{
  Wall wall(0.2);
  EXPECT_GT(wall.hits(&wall.filter), 0U);
  wall.filter.neighbours = wall.master.facet_id;
  std::sort(wall.filter.neighbours.begin(), wall.filter.neighbours.end());
  const auto n = static_cast<std::int64_t>(wall.filter.neighbours.size());
  for (std::size_t f = 1; f < wall.filter.offsets.size(); ++f)
    wall.filter.offsets[f] = n;
  // The same row for each slave facet: there is one
  ASSERT_EQ(wall.slave.num_facets(), 1);
  EXPECT_EQ(wall.hits(&wall.filter), 0U);
}
