#include "raymortar/mortar/layers.h"
#include "raymortar/geometry/aabb_tree.h"
#include "raymortar/geometry/subtract.h"
#include <algorithm>
#include <limits>

namespace raymortar
{
namespace
{
/// Distance by which masters compete: infinite out of the search range
double rank_of(double height, double reach, double depth)
{
  return height > reach or height < -depth
             ? std::numeric_limits<double>::infinity()
             : std::abs(height);
}

auto without(const Region<2>& a, const Region<2>& b)
{
  return subtract_interval(a, b);
}
auto without(const Region<3>& a, const Region<3>& b)
{
  return subtract_convex(a, b);
}

/// First moments of a region: measure times centroid
Vec<1> moment_of(const Region<2>& r) { return measure_of(r) * centre_of(r); }
Vec<2> moment_of(const Region<3>& r)
{
  Vec<2> sum = Vec<2>::Zero();
  const auto n = static_cast<std::size_t>(r.size);
  for (std::size_t i = 1; i + 1 < n; ++i)
  {
    const Vec<2> e = r.points[i] - r.points[0];
    const Vec<2> f = r.points[i + 1] - r.points[0];
    sum += 0.5 * parallelogram(e, f) * (r.points[0] + (e + f) / 3.0);
  }
  return sum;
}

/// Common part of two regions, known by the rest of one after cutting off the
/// other
template <int D>
struct Common
{
  double measure;
  Vec<D - 1> centroid;
};

template <int D>
Common<D> common(const Region<D>& a, const Region<D>& b)
{
  Common<D> c{measure_of(a), moment_of(a)};
  const auto rest = without(a, b);
  for (std::size_t i = 0; i < static_cast<std::size_t>(rest.size); ++i)
  {
    c.measure -= measure_of(rest.pieces[i]);
    c.centroid -= moment_of(rest.pieces[i]);
  }
  c.centroid /= c.measure;
  return c;
}

/// Whether an edge of `a` has all of `b` on its outer side, up to rounding
bool separates(const Region<3>& a, const Region<3>& b, double slack)
{
  for (std::size_t i = 0; i < static_cast<std::size_t>(a.size); ++i)
  {
    const Vec<2>& p = a.points[i];
    const Vec<2> e = a.points[(i + 1) % static_cast<std::size_t>(a.size)] - p;
    bool outside = true;
    for (std::size_t j = 0; j < static_cast<std::size_t>(b.size); ++j)
    {
      const Vec<2> d = b.points[j] - p;
      outside = outside and parallelogram(e, d) <= slack * e.norm();
    }
    if (outside)
      return true;
  }
  return false;
}

/// Cheap test that rules out most pairs: neighbouring masters share an edge
bool apart(const Region<3>& a, const Region<3>& b)
{
  return separates(a, b, tolerance::overlap) or
         separates(b, a, tolerance::overlap);
}
bool apart(const Region<2>& a, const Region<2>& b)
{
  return std::min(a.points[1], b.points[1]) -
             std::max(a.points[0], b.points[0]) <=
         tolerance::overlap;
}

/// Whether any two pieces overlap: a sweep along the first axis, as a slave
/// facet may see ten thousand small masters
template <int D>
bool any_overlap(const std::vector<Piece<D>>& pieces)
{
  std::vector<std::pair<Box<D - 1>, const Region<D>*>> order;
  order.reserve(pieces.size());
  for (const Piece<D>& p : pieces)
  {
    Box<D - 1> box;
    for (std::size_t i = 0; i < static_cast<std::size_t>(p.region.size); ++i)
      box.merge(
          {Vec<D - 1>(p.region.points[i]), Vec<D - 1>(p.region.points[i])});
    order.emplace_back(box, &p.region);
  }
  std::sort(order.begin(), order.end(),
            [](const auto& a, const auto& b)
            { return a.first.lower[0] < b.first.lower[0]; });
  for (auto a = order.begin(); a != order.end(); ++a)
    for (auto b = a + 1;
         b != order.end() and b->first.lower[0] < a->first.upper[0]; ++b)
      if (a->first.overlaps(b->first) and not apart(*a->second, *b->second))
        return true;
  return false;
}

/// With the loser goes what has lost to it: a third layer that has been cut
/// there already does not meet the winner any more
void note(std::vector<Rivalry>& rivalries, const Rivalry& one)
{
  const auto add = [&](const Rivalry& r)
  {
    if (r.winner != r.loser and
        std::find(rivalries.begin(), rivalries.end(), r) == rivalries.end())
      rivalries.push_back(r);
  };
  const std::size_t count = rivalries.size();
  for (std::size_t k = 0; k < count; ++k)
    if (rivalries[k].winner == one.loser)
      add({one.winner, rivalries[k].loser});
  add(one);
}

/// Cut `loser` by the winner's region and append the rest
template <int D>
void give_way(std::vector<Piece<D>>& pieces, std::size_t loser,
              const Region<D> winner)
{
  const Piece<D> old = pieces[loser];
  const auto rest = without(old.region, winner);
  pieces[loser].region.size = 0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(rest.size); ++i)
    if (measure_of(rest.pieces[i]) > tolerance::segment_area)
      pieces.push_back(
          {rest.pieces[i], old.master, old.master_patch, old.seen});
}
} // namespace

template <int D>
std::vector<Rivalry> keep_nearest(std::vector<Piece<D>>& pieces, double whole,
                                  double reach, double depth,
                                  const LayerOrder<D>& order)
{
  std::vector<Rivalry> rivalries;
  if (not any_overlap<D>(pieces))
    return rivalries;
  const auto first_wins =
      [&](const Piece<D>& a, const Piece<D>& b, const Vec<D - 1>& at)
  {
    const int verdict = order ? order(a.master, b.master, at) : 0;
    if (verdict != 0)
      return verdict < 0;
    return rank_of(a.seen.height(at), reach, depth) <=
           rank_of(b.seen.height(at), reach, depth);
  };
  // Pieces that are cut are appended and compared again, against all
  for (std::size_t i = 0; i < pieces.size(); ++i)
    for (std::size_t j = 0; j < i and pieces[i].region.size > 0; ++j)
    {
      if (pieces[j].region.size == 0 or
          apart(pieces[i].region, pieces[j].region))
        continue;
      const Common<D> both = common<D>(pieces[i].region, pieces[j].region);
      if (not(both.measure > tolerance::overlap * whole))
        continue;
      const std::size_t winner =
          first_wins(pieces[j], pieces[i], both.centroid) ? j : i;
      const std::size_t loser = winner == i ? j : i;
      note(rivalries, {pieces[winner].master, pieces[loser].master});
      give_way(pieces, loser, pieces[winner].region);
    }
  std::erase_if(pieces, [](const Piece<D>& p) { return p.region.size == 0; });
  std::sort(rivalries.begin(), rivalries.end());
  return rivalries;
}

template std::vector<Rivalry> keep_nearest<2>(std::vector<Piece<2>>&, double,
                                              double, double,
                                              const LayerOrder<2>&);
template std::vector<Rivalry> keep_nearest<3>(std::vector<Piece<3>>&, double,
                                              double, double,
                                              const LayerOrder<3>&);
} // namespace raymortar
