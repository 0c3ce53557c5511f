#include "raymortar/fem/parts.h"
#include <algorithm>
#include <gtest/gtest.h>
#include <limits>
#include <random>
#include <set>

using namespace raymortar;

namespace
{
/// Unit boxes along x from 0, 2, 4, ...
std::vector<Box<2>> row_of(int n)
{
  std::vector<Box<2>> boxes;
  for (int i = 0; i < n; ++i)
    boxes.push_back({{2.0 * i, 0.0}, {2.0 * i + 1.0, 1.0}});
  return boxes;
}

std::vector<Index> sizes(const std::vector<Index>& part)
{
  std::vector<Index> n;
  for (const Index p : part)
  {
    n.resize(std::max(n.size(), static_cast<std::size_t>(p) + 1), 0);
    ++n[static_cast<std::size_t>(p)];
  }
  return n;
}

template <int D>
std::vector<Box<D>> random_boxes(std::size_t n)
{
  std::mt19937 random(7);
  std::uniform_real_distribution<double> number(-1.0, 1.0);
  std::vector<Box<D>> boxes(n);
  for (Box<D>& box : boxes)
  {
    for (int i = 0; i < D; ++i)
      box.lower[i] = number(random);
    box.upper = box.lower.array() + 0.1;
  }
  return boxes;
}

template <int D>
void expect_hulls()
{
  const auto boxes = random_boxes<D>(500);
  const auto part = parts_of<D>(boxes);
  const auto hulls = part_boxes<D>(boxes, part);
  ASSERT_EQ(hulls.size(), 16u);
  for (std::size_t p = 0; p < hulls.size(); ++p)
  {
    auto lower = raymortar::Vec<D>::Constant(9.0).eval(),
         upper = (-lower).eval();
    for (std::size_t f = 0; f < boxes.size(); ++f)
      if (part[f] == static_cast<Index>(p))
      {
        lower = lower.cwiseMin(boxes[f].lower).eval();
        upper = upper.cwiseMax(boxes[f].upper).eval();
      }
    EXPECT_EQ(hulls[p].lower, lower);
    EXPECT_EQ(hulls[p].upper, upper);
  }
}
} // namespace

TEST(Parts, AreOfEqualSizeAndOneAfterTheOther)
{
  const auto part = parts_of<2>(row_of(64), 4);
  EXPECT_EQ(sizes(part), std::vector<Index>(4, 16));
  EXPECT_TRUE(std::is_sorted(part.begin(), part.end()));
}

TEST(Parts, AreNotCutBelowASize)
{
  EXPECT_EQ(sizes(parts_of<2>(row_of(7))), std::vector<Index>{7});
  EXPECT_EQ(sizes(parts_of<2>(row_of(8))), (std::vector<Index>{4, 4}));
  EXPECT_EQ(sizes(parts_of<2>(row_of(1000))).size(), 16u);
}

TEST(Parts, HoldTheirBoxesTightly)
{
  expect_hulls<2>();
  expect_hulls<3>();
}

TEST(Parts, OfEqualBoxesAndOfNone)
{
  const std::vector<Box<2>> equal(32, Box<2>{{0.0, 0.0}, {1.0, 1.0}});
  EXPECT_EQ(sizes(parts_of<2>(equal, 4)), std::vector<Index>(4, 8));
  EXPECT_TRUE(parts_of<2>({}).empty());
  EXPECT_TRUE(part_boxes<2>({}, {}).empty());
}

TEST(Parts, LeaveOutBoundsThatAreNotNumbers)
{
  auto boxes = row_of(64);
  boxes[5].lower[0] = std::numeric_limits<double>::quiet_NaN();
  const auto part = parts_of<2>(boxes, 4);
  const std::set<Index> used(part.begin(), part.end());
  EXPECT_EQ(used, (std::set<Index>{0, 1, 2, 3}));
}
