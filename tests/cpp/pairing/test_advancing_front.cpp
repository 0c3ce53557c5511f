#include "facet_types.h"
#include "raymortar/pairing/advancing_front.h"
#include "surfaces.h"
#include <numbers>
#include <set>

using namespace raymortar;
using namespace raymortar::test;

namespace
{
double uniform(std::mt19937& random, double low, double high)
{
  return std::uniform_real_distribution<double>(low, high)(random);
}

int whole(std::mt19937& random, int low, int high)
{
  return std::uniform_int_distribution<int>(low, high)(random);
}

enum class Kind
{
  flat,
  cap,
  saddle,
  noise,
  islands,
  folded,
  thin
};
constexpr int kinds = 7;

/// Strip that runs to and fro in x while it falls: layers over each other
Map fold(double width, double fall)
{
  return [=](double s, double t)
  {
    const double x = 2 * s - 1 + 0.8 * std::sin(4 * std::numbers::pi * s);
    return Vec<3>(width * x, width * (2 * t - 1), -fall * s);
  };
}

template <class F>
class AdvancingFrontTest : public testing::Test
{
protected:
  static constexpr int D = F::gdim;

  static Surface grid(int n, bool up, const Map& map)
  {
    return make_surface({F::shape, F::degree, F::node_degree, n, up}, map);
  }

  static void shake(Surface& s, std::mt19937& random, double amount)
  {
    transform<D>(s,
                 [&](const Vec<D>& x) -> Vec<D>
                 { return x + random_vector<D>(random, amount); });
  }

  static Surface surface(std::mt19937& random, Kind kind, int n, bool up)
  {
    const double bend = uniform(random, -0.5, 0.5), h = 2.0 / n;
    const double w = uniform(random, 0.6, 1.2);
    switch (kind)
    {
    case Kind::flat:
      return grid(n, up, plate(w, 0));
    case Kind::cap:
      return grid(
          n, up,
          graph(w, [=](double x, double y) { return bend * (x * x + y * y); }));
    case Kind::saddle:
      return grid(n, up,
                  graph(w, [=](double x, double y)
                        { return bend * (x * x - y * y + x * y); }));
    case Kind::noise:
    {
      Surface s = grid(n, up, plate(w, 0));
      shake(s, random, uniform(random, 0.0, 0.4) * h);
      return s;
    }
    case Kind::islands:
    {
      Surface s = grid(n, up, plate(w, 0));
      for (int k = whole(random, 1, 3); k > 0; --k)
      {
        Surface island = grid(whole(random, 1, n), up, plate(0.3 * w, 0));
        const Vec<D> to = random_vector<D>(random, 1.0);
        transform<D>(island, [&](const Vec<D>& x) -> Vec<D> { return x + to; });
        s = joined(s, island);
      }
      return s;
    }
    case Kind::folded:
      return grid(2 * n, up, fold(w, uniform(random, 0.0, 1.0)));
    case Kind::thin:
      return joined(grid(n, up, plate(w, 0)),
                    grid(n, not up, plate(w, up ? -0.1 * h : 0.1 * h)));
    }
    return {};
  }

  /// Two surfaces of random kinds, sizes, places and directions
  static std::pair<Surface, Surface> scene(std::mt19937& random)
  {
    const int most = D == 2 ? 150 : 14;
    const auto any = [&](bool up)
    {
      Surface s =
          surface(random, static_cast<Kind>(whole(random, 0, kinds - 1)),
                  whole(random, 1, most), up);
      turn_and_shift(s, uniform(random, -0.4, 0.4), uniform(random, -0.2, 0.2));
      return s;
    };
    return {any(false), any(true)};
  }
};

std::set<std::pair<Index, Index>> pairs_of(const Segmentation& s)
{
  std::set<std::pair<Index, Index>> pairs;
  for (const Segment& one : s.segments)
    pairs.emplace(one.slave, one.master);
  return pairs;
}
} // namespace

TYPED_TEST_SUITE(AdvancingFrontTest, AllFacets, );

TYPED_TEST(AdvancingFrontTest, FindsWhatBruteForceFinds)
{
  std::mt19937 random(11);
  std::size_t found = 0;
  for (int trial = 0; trial < 170; ++trial)
  {
    const auto [slave, master] = this->scene(random);
    const SearchDistances distances{uniform(random, 0, 0.6),
                                    uniform(random, 0, 0.6),
                                    uniform(random, 0, 0.1)};
    const auto all =
        find_candidates(slave, master, distances, Strategy::brute_force);
    const auto front =
        find_candidates(slave, master, distances, Strategy::advancing_front);
    ASSERT_EQ(front.offsets, all.offsets) << "trial " << trial;
    ASSERT_EQ(front.masters, all.masters) << "trial " << trial;
    found += all.masters.size();
  }
  EXPECT_GT(found, 10000u);
}

TYPED_TEST(AdvancingFrontTest, GivesTheSegmentsAndAreaOfTheTree)
{
  std::mt19937 random(12);
  for (int trial = 0; trial < 10; ++trial)
  {
    const auto [slave, master] = this->scene(random);
    const SegmentationOptions options{0.4, 0.4, false};
    const auto by = [&, &slave = slave, &master = master](Strategy strategy)
    {
      return make_segments(
          slave, master,
          find_candidates(slave, master, {0.4, 0.4, 0.05}, strategy), options);
    };
    const Segmentation front = by(Strategy::advancing_front);
    const Segmentation tree = by(Strategy::bvh);
    EXPECT_EQ(pairs_of(front), pairs_of(tree));
    EXPECT_NEAR(total(front.covered), total(tree.covered),
                1e-10 * (1 + total(tree.covered)));
  }
}

TYPED_TEST(AdvancingFrontTest, EmptySidesHaveNoPairs)
{
  const Surface full = this->grid(3, true, plate(1, 0));
  Surface none = full;
  none.facet_id.clear();
  none.neighbours.clear();
  const auto without_master =
      find_candidates(full, none, {1, 1, 0}, Strategy::advancing_front);
  EXPECT_TRUE(without_master.masters.empty());
  EXPECT_EQ(without_master.offsets.size(), full.facet_id.size() + 1);
  EXPECT_EQ(find_candidates(none, full, {1, 1, 0}, Strategy::advancing_front)
                .offsets.size(),
            1u);
}
