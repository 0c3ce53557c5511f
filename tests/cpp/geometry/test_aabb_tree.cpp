#include "raymortar/geometry/aabb_tree.h"
#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <random>

using namespace raymortar;

namespace
{
template <int D>
Vec<D> vector_between(std::mt19937& random, double lower, double upper)
{
  std::uniform_real_distribution<double> coordinate(lower, upper);
  Vec<D> x;
  for (int i = 0; i < D; ++i)
    x[i] = coordinate(random);
  return x;
}

/// Boxes in the unit cube, with edges up to `size`
template <int D>
std::vector<Box<D>> random_boxes(std::mt19937& random, int n, double size)
{
  std::vector<Box<D>> boxes(n);
  for (Box<D>& box : boxes)
  {
    box.lower = vector_between<D>(random, 0, 1);
    box.upper = box.lower + vector_between<D>(random, 0, size);
  }
  return boxes;
}

/// Boxes of integer cells: most neighbours touch
template <int D>
std::vector<Box<D>> random_cells(std::mt19937& random, int n)
{
  std::vector<Box<D>> boxes(n);
  for (Box<D>& box : boxes)
  {
    box.lower = vector_between<D>(random, 0, 9).array().floor();
    box.upper = box.lower.array() + 1;
  }
  return boxes;
}

template <int D>
std::vector<Index> brute_force(const std::vector<Box<D>>& boxes,
                               const Box<D>& box)
{
  std::vector<Index> hits;
  for (Index k = 0; k < static_cast<Index>(boxes.size()); ++k)
    if (boxes[k].overlaps(box))
      hits.push_back(k);
  return hits;
}

template <int D>
std::vector<Index> tree_hits(const AabbTree<D>& tree, const Box<D>& box)
{
  std::vector<Index> hits;
  tree.query(box, hits);
  return hits;
}

template <int D>
void expect_brute_force(const std::vector<Box<D>>& boxes,
                        const std::vector<Box<D>>& queries)
{
  const AabbTree<D> tree(boxes);
  ASSERT_EQ(tree.size(), static_cast<Index>(boxes.size()));
  for (const Box<D>& query : queries)
    ASSERT_EQ(tree_hits(tree, query), brute_force(boxes, query));
}

template <int D>
class Dimension : public std::integral_constant<int, D>
{
};

template <typename T>
class AabbTreeTest : public testing::Test
{
};
using Dimensions = testing::Types<Dimension<2>, Dimension<3>>;
} // namespace

TYPED_TEST_SUITE(AabbTreeTest, Dimensions, );

TYPED_TEST(AabbTreeTest, FindsTheBoxesOfALine)
{
  constexpr int D = TypeParam::value;
  std::mt19937 random(2);
  const auto boxes = random_boxes<D>(random, 500, 0.05);
  const AabbTree<D> tree(boxes);
  for (int k = 0; k < 40; ++k)
  {
    const Vec<D> x = vector_between<D>(random, -1, 2);
    Vec<D> n = vector_between<D>(random, -1, 1);
    if (k % 3 == 0)
      n[0] = 0.0; // along a face of the boxes
    n.normalize();
    std::vector<Index> hits, expected;
    tree.query_line(x, n, hits);
    for (Index b = 0; b < tree.size(); ++b)
    {
      // Small steps along the line
      bool met = false;
      for (int i = -4000; i <= 4000 and not met; ++i)
      {
        const Vec<D> at = x + i * 1e-3 * n;
        met = Box<D>{at, at}.overlaps(boxes[b]);
      }
      if (met)
        expected.push_back(b);
    }
    EXPECT_TRUE(std::includes(hits.begin(), hits.end(), expected.begin(),
                              expected.end()));
    // Those that are more are grazed within a step
    for (const Index b : hits)
      EXPECT_TRUE(boxes[b].meets(x, n));
    EXPECT_LE(hits.size(), expected.size() + 5);
  }
}

TYPED_TEST(AabbTreeTest, FindsWhatBruteForceFinds)
{
  constexpr int D = TypeParam::value;
  std::mt19937 random(1);
  for (const int n : {1, 2, 4, 5, 6, 31, 500, 3000})
    for (const double size : {0.0, 0.01, 0.1, 1.0})
      expect_brute_force<D>(random_boxes<D>(random, n, size),
                            random_boxes<D>(random, 100, 0.1));
}

TYPED_TEST(AabbTreeTest, TouchingBoxesOverlap)
{
  constexpr int D = TypeParam::value;
  std::mt19937 random(2);
  const std::vector<Box<D>> cells = random_cells<D>(random, 1000);
  expect_brute_force<D>(cells, cells);
  EXPECT_TRUE(
      cells[0].overlaps({cells[0].upper, cells[0].upper + Vec<D>::Ones()}));
}

TYPED_TEST(AabbTreeTest, EmptyTreeFindsNothing)
{
  constexpr int D = TypeParam::value;
  const Box<D> box{Vec<D>::Zero(), Vec<D>::Ones()};
  EXPECT_TRUE(tree_hits(AabbTree<D>(), box).empty());
  EXPECT_TRUE(tree_hits(AabbTree<D>(std::vector<Box<D>>()), box).empty());
}

TYPED_TEST(AabbTreeTest, IdenticalBoxesAreAllFound)
{
  constexpr int D = TypeParam::value;
  const Box<D> box{Vec<D>::Zero(), Vec<D>::Ones()};
  const std::vector<Box<D>> boxes(10000, box);
  EXPECT_EQ(tree_hits(AabbTree<D>(boxes), box), brute_force(boxes, box));
}

TYPED_TEST(AabbTreeTest, BoxThatIsNotANumberIsNeverFound)
{
  constexpr int D = TypeParam::value;
  std::mt19937 random(3);
  std::vector<Box<D>> boxes = random_boxes<D>(random, 1000, 0.1);
  for (std::size_t k = 0; k < boxes.size(); k += 3)
    boxes[k].lower[static_cast<int>(k) % D] = NAN;
  for (std::size_t k = 1; k < boxes.size(); k += 7)
    boxes[k] = {Vec<D>::Constant(NAN), Vec<D>::Constant(NAN)};
  expect_brute_force<D>(boxes, random_boxes<D>(random, 200, 0.2));
  const std::vector<Box<D>> none(
      50, {Vec<D>::Constant(NAN), Vec<D>::Constant(NAN)});
  EXPECT_TRUE(tree_hits(AabbTree<D>(none), boxes[2]).empty());
  EXPECT_TRUE(tree_hits(AabbTree<D>(boxes), none[0]).empty());
}

TYPED_TEST(AabbTreeTest, EmptyAndInfiniteBoxesAreHandled)
{
  constexpr int D = TypeParam::value;
  std::mt19937 random(4);
  std::vector<Box<D>> boxes = random_boxes<D>(random, 100, 0.1);
  const Box<D> empty;
  const Box<D> everything{empty.upper, empty.lower};
  boxes.insert(boxes.end(), 20, empty);
  boxes.insert(boxes.end(), 20, everything);
  expect_brute_force<D>(boxes, {empty, everything, boxes[3]});
  EXPECT_FALSE(empty.overlaps(empty));
  const Box<D> finite{Vec<D>::Constant(-9), Vec<D>::Constant(9)};
  EXPECT_EQ(tree_hits(AabbTree<D>(boxes), finite).size(), 120u);
}

TYPED_TEST(AabbTreeTest, QueryAppends)
{
  constexpr int D = TypeParam::value;
  const std::vector<Box<D>> boxes(3, {Vec<D>::Zero(), Vec<D>::Ones()});
  std::vector<Index> hits{7};
  AabbTree<D>(boxes).query(boxes[0], hits);
  EXPECT_EQ(hits, (std::vector<Index>{7, 0, 1, 2}));
}

TYPED_TEST(AabbTreeTest, InflatedBoxIsLargerOnAllSides)
{
  constexpr int D = TypeParam::value;
  Box<D> box{Vec<D>::Zero(), Vec<D>::Ones()};
  const Box<D> larger = box.inflated(0.25);
  EXPECT_EQ(larger.lower, Vec<D>::Constant(-0.25));
  EXPECT_EQ(larger.upper, Vec<D>::Constant(1.25));
  box.merge(larger);
  EXPECT_EQ(box.lower, larger.lower);
  EXPECT_EQ(box.upper, larger.upper);
}
