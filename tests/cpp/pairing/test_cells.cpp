#include "raymortar/pairing/cells.h"
#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <numeric>
#include <random>

using namespace raymortar;

namespace
{
template <int D>
using Boxes = std::vector<Box<D>>;

/// Small boxes of the surface z = 0 of the unit square, in no order
template <int D>
Boxes<D> scattered(std::size_t n)
{
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(0, 1);
  Boxes<D> boxes(n);
  for (Box<D>& box : boxes)
  {
    Vec<D> x = Vec<D>::Zero();
    for (int i = 0; i < D - 1; ++i)
      x[i] = unit(random);
    box = Box<D>{x, x}.inflated(1e-3);
  }
  return boxes;
}

template <int D>
double extent(const Boxes<D>& boxes, std::span<const Index> group)
{
  Box<D> all;
  for (const Index k : group)
    all.merge(boxes[static_cast<std::size_t>(k)]);
  return (all.upper - all.lower).maxCoeff();
}

template <class T>
class CellsTest : public testing::Test
{
protected:
  static void expect_each_box_once(const Boxes<T::value>& boxes,
                                   const BoxGroups& groups)
  {
    std::vector<Index> all(boxes.size()), found;
    std::iota(all.begin(), all.end(), 0);
    for (std::size_t k = 0; k < groups.size(); ++k)
    {
      EXPECT_FALSE(groups[k].empty());
      EXPECT_LE(groups[k].size(), 32u);
      found.insert(found.end(), groups[k].begin(), groups[k].end());
    }
    std::sort(found.begin(), found.end());
    EXPECT_EQ(found, all);
  }
};

using Dimensions = testing::Types<std::integral_constant<int, 2>,
                                  std::integral_constant<int, 3>>;
} // namespace

TYPED_TEST_SUITE(CellsTest, Dimensions, );

TYPED_TEST(CellsTest, EveryBoxIsInOneGroup)
{
  constexpr int D = TypeParam::value;
  for (const std::size_t n : {0, 1, 2, 31, 32, 33, 1000})
  {
    const auto boxes = scattered<D>(n);
    this->expect_each_box_once(boxes, group_by_cells<D>(boxes));
  }
}

TYPED_TEST(CellsTest, GroupsLieCloseTogetherWhateverTheOrder)
{
  constexpr int D = TypeParam::value;
  const std::size_t n = 20000;
  const auto boxes = scattered<D>(n);
  const BoxGroups groups = group_by_cells<D>(boxes);
  EXPECT_LT(groups.size(), n / 4);
  // A cell that holds 16 boxes of an even surface
  const double cell = std::pow(16.0 / n, 1.0 / (D - 1));
  for (std::size_t k = 0; k < groups.size(); ++k)
    EXPECT_LE(extent<D>(boxes, groups[k]), cell + 2.1e-3);
}

TYPED_TEST(CellsTest, BoxesInOnePlaceMakeSmallGroups)
{
  constexpr int D = TypeParam::value;
  const Boxes<D> boxes(1000, Box<D>{Vec<D>::Ones(), Vec<D>::Ones()});
  this->expect_each_box_once(boxes, group_by_cells<D>(boxes));
}

TYPED_TEST(CellsTest, BoundsMayBeInfiniteOrNoNumbers)
{
  constexpr int D = TypeParam::value;
  auto boxes = scattered<D>(100);
  boxes[3] = {}; // empty
  boxes[40].upper[0] = std::numeric_limits<double>::quiet_NaN();
  this->expect_each_box_once(boxes, group_by_cells<D>(boxes));
  boxes[70].lower[D - 1] = -std::numeric_limits<double>::infinity();
  this->expect_each_box_once(boxes, group_by_cells<D>(boxes));
  boxes[80] = {Vec<D>::Constant(-1e308), Vec<D>::Constant(1e308)};
  this->expect_each_box_once(boxes, group_by_cells<D>(boxes));
}
