#include "facet_types.h"
#include "raymortar/mortar/layers.h"
#include "slave_square.h"
#include <numeric>

using namespace raymortar;
using namespace raymortar::test;

namespace
{
/// Piece of a master quad with opposite corners (x0, y0), (x1, y1)
Piece<3> piece(Index master, const Vec<2>& first, const Vec<2>& last,
               const std::function<double(const Vec<2>&)>& height)
{
  std::array<Vec<3>, 4> c;
  const std::array<Vec<2>, 4> y = {first, Vec<2>(first.x(), last.y()), last,
                                   Vec<2>(last.x(), first.y())};
  for (std::size_t i = 0; i < 4; ++i)
    c[i] = Vec<3>(y[i].x(), y[i].y(), height(y[i]));
  const auto plane = patch_plane<3>(slave_square, 4);
  const auto seen = project_patch<3>(plane, c, 4);
  return {overlap(slave_reference, 4, seen), master, 0, seen};
}

Piece<3> flat_piece(Index master, const Vec<2>& first, const Vec<2>& last,
                    double height)
{
  return piece(master, first, last, [=](const Vec<2>&) { return height; });
}

/// Interval on the unit slave edge
Piece<2> interval(Index master, double begin, double end, double height)
{
  const std::array<Vec<2>, 4> edge = {Vec<2>(1, 0), Vec<2>(0, 0)};
  const std::array<Vec<2>, 4> c = {Vec<2>(1 - end, height),
                                   Vec<2>(1 - begin, height)};
  const auto seen = project_patch<2>(patch_plane<2>(edge, 2), c, 2);
  return {overlap({}, 2, seen), master, 0, seen};
}

template <int D>
std::vector<double> areas(const std::vector<Piece<D>>& pieces, int masters)
{
  std::vector<double> sum(static_cast<std::size_t>(masters), 0.0);
  for (const Piece<D>& p : pieces)
    sum[static_cast<std::size_t>(p.master)] += measure_of(p.region);
  return sum;
}

/// Area of the union of rectangles within the unit square, on the grid of
/// their own edges
double union_area(const std::vector<std::array<Vec<2>, 2>>& rectangles)
{
  std::array<std::vector<double>, 2> at{std::vector<double>{0, 1}, {0, 1}};
  for (const auto& r : rectangles)
    for (int i = 0; i < 2; ++i)
      for (const Vec<2>& corner : r)
        at[static_cast<std::size_t>(i)].push_back(
            std::clamp(corner[i], 0.0, 1.0));
  for (auto& a : at)
    std::sort(a.begin(), a.end());
  double sum = 0;
  for (std::size_t i = 0; i + 1 < at[0].size(); ++i)
    for (std::size_t j = 0; j + 1 < at[1].size(); ++j)
    {
      const Vec<2> low(at[0][i], at[1][j]), high(at[0][i + 1], at[1][j + 1]);
      const Vec<2> middle = 0.5 * (low + high);
      const bool inside =
          std::any_of(rectangles.begin(), rectangles.end(),
                      [&](const auto& r)
                      {
                        return (middle.array() > r[0].array()).all() and
                               (middle.array() < r[1].array()).all();
                      });
      sum += inside ? (high - low).prod() : 0;
    }
  return sum;
}
} // namespace

TEST(Layers, NearestMasterWinsInAnyOrder)
{
  for (const bool swapped : {false, true})
    for (const double near : {0.1, -0.1, 0.0})
    {
      std::vector<Piece<3>> pieces = {flat_piece(0, {-1, -1}, {2, 2}, near),
                                      flat_piece(1, {-1, -1}, {2, 2}, 0.3)};
      if (swapped)
        std::swap(pieces[0], pieces[1]);
      keep_nearest<3>(pieces, 1.0, 1.0, 1.0);
      EXPECT_EQ(areas(pieces, 2), (std::vector{1.0, 0.0}));
    }
}

TEST(Layers, MasterOutOfRangeGivesWay)
{
  std::vector<Piece<3>> pieces = {flat_piece(0, {-1, -1}, {2, 2}, -0.2),
                                  flat_piece(1, {-1, -1}, {2, 2}, 0.5)};
  keep_nearest<3>(pieces, 1.0, 1.0, 0.1);
  EXPECT_EQ(areas(pieces, 2), (std::vector{0.0, 1.0}));
}

TEST(Layers, NearerMasterTakesOnlyWhatItCovers)
{
  std::vector<Piece<3>> pieces = {
      flat_piece(0, {-1, -1}, {2, 2}, 0.3),
      flat_piece(1, {0.25, 0.25}, {0.75, 0.5}, 0.1)};
  keep_nearest<3>(pieces, 1.0, 1.0, 1.0);
  const auto area = areas(pieces, 2);
  EXPECT_NEAR(area[0], 0.875, 1e-15);
  EXPECT_NEAR(area[1], 0.125, 1e-15);
}

TEST(Layers, ThreeLayersLeaveTheNearestEverywhere)
{
  std::vector<int> order = {0, 1, 2};
  do
  {
    const std::vector<Piece<3>> layers = {
        flat_piece(0, {-1, -1}, {2, 2}, 0.3),
        flat_piece(1, {-1, -1}, {0.5, 2}, 0.2),
        flat_piece(2, {-1, -1}, {2, 0.5}, 0.1)};
    std::vector<Piece<3>> pieces;
    for (const int k : order)
      pieces.push_back(layers[static_cast<std::size_t>(k)]);
    keep_nearest<3>(pieces, 1.0, 1.0, 1.0);
    const auto area = areas(pieces, 3);
    EXPECT_NEAR(area[0], 0.25, 1e-15);
    EXPECT_NEAR(area[1], 0.25, 1e-15);
    EXPECT_NEAR(area[2], 0.5, 1e-15);
  } while (std::next_permutation(order.begin(), order.end()));
}

TEST(Layers, NeighboursWithoutOverlapStayAsTheyAre)
{
  std::vector<Piece<3>> pieces = {flat_piece(0, {-1, -1}, {0.3, 2}, 0.3),
                                  flat_piece(1, {0.3, -1}, {2, 2}, 0.1)};
  const auto before = areas(pieces, 2);
  keep_nearest<3>(pieces, 1.0, 1.0, 1.0);
  ASSERT_EQ(pieces.size(), 2u);
  EXPECT_EQ(areas(pieces, 2), before);
}

TEST(Layers, AreasAddUpToTheUnion)
{
  std::mt19937 random(1);
  std::uniform_real_distribution<double> at(-0.5, 1.5);
  for (int trial = 0; trial < 10000; ++trial)
  {
    std::vector<Piece<3>> pieces;
    std::vector<std::array<Vec<2>, 2>> rectangles;
    for (Index m = 0; m < 2 + trial % 5; ++m)
    {
      const Vec<2> a(at(random), at(random)), b(at(random), at(random));
      rectangles.push_back({a.cwiseMin(b), a.cwiseMax(b)});
      const Piece<3> p = flat_piece(m, rectangles.back()[0],
                                    rectangles.back()[1], 0.1 * at(random));
      if (p.region.size > 0)
        pieces.push_back(p);
    }
    keep_nearest<3>(pieces, 1.0, 1.0, 1.0);
    const auto area = areas(pieces, 6);
    ASSERT_NEAR(std::accumulate(area.begin(), area.end(), 0.0),
                union_area(rectangles), 1e-13);
  }
}

TEST(Layers, OverlapOnAPartlyCoveredFacetCountsOnce)
{
  // Together no larger than the facet, so that the sum does not show it
  std::vector<Piece<3>> pieces = {flat_piece(0, {0.1, 0.1}, {0.4, 0.4}, 0.3),
                                  flat_piece(1, {0.2, 0.2}, {0.5, 0.5}, 0.1)};
  keep_nearest<3>(pieces, 1.0, 1.0, 1.0);
  const auto area = areas(pieces, 2);
  EXPECT_NEAR(area[0], 0.05, 1e-15);
  EXPECT_NEAR(area[1], 0.09, 1e-15);
}

TEST(Layers, IntervalsKeepTheNearest)
{
  std::vector<Piece<2>> pieces = {interval(0, -1, 2, 0.3),
                                  interval(1, 0.2, 0.6, 0.1),
                                  interval(2, 0.5, 0.7, 0.2)};
  keep_nearest<2>(pieces, 1.0, 1.0, 1.0);
  const auto length = areas(pieces, 3);
  EXPECT_NEAR(length[0], 0.5, 1e-15);
  EXPECT_NEAR(length[1], 0.4, 1e-15);
  EXPECT_NEAR(length[2], 0.1, 1e-15);
}
