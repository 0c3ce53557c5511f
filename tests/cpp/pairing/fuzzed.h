// Pairs of random surfaces that do not match: what a search has to cope with.
#pragma once

#include "facet_types.h"
#include "raymortar/pairing/candidates.h"
#include "surfaces.h"
#include <numbers>

namespace raymortar::test
{
inline double uniform(std::mt19937& random, double low, double high)
{
  return std::uniform_real_distribution<double>(low, high)(random);
}

inline int whole(std::mt19937& random, int low, int high)
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
inline constexpr int kinds = 7;

/// Strip that runs to and fro in x while it falls: layers over each other
inline Map fold(double width, double fall)
{
  return [=](double s, double t)
  {
    const double x = 2 * s - 1 + 0.8 * std::sin(4 * std::numbers::pi * s);
    return Vec<3>(width * x, width * (2 * t - 1), -fall * s);
  };
}

template <class F>
class FuzzedSurfaces : public testing::Test
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

  static Surface with_islands(std::mt19937& random, int n, bool up, double w)
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
      return with_islands(random, n, up, w);
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

  /// Reach, depth and skin of any size
  static SearchDistances distances(std::mt19937& random)
  {
    return {uniform(random, 0, 0.6), uniform(random, 0, 0.6),
            uniform(random, 0, 0.1)};
  }

  /// Compare a strategy with brute force on random surfaces
  /// @return candidates of all trials
  static std::size_t compare(FindPairs find, unsigned seed, int trials)
  {
    std::mt19937 random(seed);
    std::size_t found = 0;
    for (int trial = 0; trial < trials; ++trial)
    {
      const auto [slave, master] = scene(random);
      const SearchDistances range = distances(random);
      const auto all = compare_all_boxes(slave, master, range);
      const auto pairs = find(slave, master, range);
      EXPECT_EQ(pairs.offsets, all.offsets) << "trial " << trial;
      EXPECT_EQ(pairs.masters, all.masters) << "trial " << trial;
      found += all.masters.size();
    }
    return found;
  }
};
} // namespace raymortar::test
