#include "pairs.h"

namespace raymortar::test
{
double uniform(std::mt19937& random, double from, double to)
{
  return std::uniform_real_distribution<double>(from, to)(random);
}

double log_uniform(std::mt19937& random, double from, double to)
{
  return std::pow(10, uniform(random, from, to));
}

namespace
{
/// What rounding left convex, as the clip asks for
Facet convex_facet(std::mt19937& random, double flattest)
{
  Facet facet;
  do
    facet = random_facet(random, flattest);
  while (!is_convex(facet));
  return facet;
}

PlanePair ordinary(std::mt19937& random)
{
  return {convex_facet(random, 0.05), convex_facet(random, 0.05)};
}

PlanePair slivers(std::mt19937& random)
{
  const bool both = random() % 2 == 0;
  return {convex_facet(random, 1e-8), convex_facet(random, both ? 1e-8 : 0.1)};
}

/// Repeats the draw until both facets have survived the rounding
template <class Make>
PlanePair until_convex(Make make)
{
  PlanePair pair;
  do
    pair = make();
  while (!is_convex(pair.slave) or !is_convex(pair.master));
  return pair;
}

PlanePair shifted(const PlanePair& pair, const Vec<2>& by)
{
  return {moved(pair.slave, 1, 0, by), moved(pair.master, 1, 0, by)};
}

PlanePair far_away(std::mt19937& random)
{
  return until_convex(
      [&]
      {
        const Vec<2> offset(uniform(random, -1e6, 1e6), 1e6);
        return shifted(ordinary(random), offset);
      });
}

/// Every corner moved by 1e-16 to 1e-6 of the size, together or on its own
Facet nudged(std::mt19937& random, Facet facet)
{
  const double step = diameter(facet) * log_uniform(random, -16, -6);
  const bool together = random() % 2 == 0;
  Vec<2> by = Vec<2>::Zero();
  for (std::size_t k = 0; k < facet.size(); ++k)
  {
    if (k == 0 or !together)
      by = step * Vec<2>(uniform(random, -1, 1), uniform(random, -1, 1));
    facet[k] += by;
  }
  return facet;
}

PlanePair all_but_coincident(std::mt19937& random)
{
  return until_convex(
      [&]
      {
        const Facet facet = convex_facet(random, 0.05);
        return PlanePair{facet,
                         rotated_corners(nudged(random, facet),
                                         static_cast<int>(random() % 3))};
      });
}

/// One corner of the master put on an edge, or the end of one, of the slave
PlanePair corner_on_edge(std::mt19937& random)
{
  return until_convex(
      [&]
      {
        PlanePair pair = ordinary(random);
        const std::size_t edge = random() % pair.slave.size();
        const Vec<2>& a = pair.slave[edge];
        const Vec<2>& b = pair.slave[(edge + 1) % pair.slave.size()];
        const double at = random() % 4 == 0 ? 0 : uniform(random, 0, 1);
        const Vec<2> shift = a + at * (b - a) - pair.master[0];
        pair.master = moved(pair.master, 1, 0, shift);
        return pair;
      });
}

/// One edge of the master on the line of an edge of the slave, to rounding
PlanePair edge_on_edge(std::mt19937& random)
{
  return until_convex(
      [&]
      {
        const Facet slave = convex_facet(random, 0.05);
        const std::size_t edge = random() % slave.size();
        const Vec<2>& a = slave[edge];
        const Vec<2> along = slave[(edge + 1) % slave.size()] - a;
        const double side = random() % 2 == 0 ? 1 : -1;
        const double begin = uniform(random, -0.5, 1);
        const double end = begin + side * uniform(random, 0.05, 1);
        const Vec<2> up(-along.y(), along.x());
        const Vec<2> tip = a + uniform(random, -0.5, 1.5) * along +
                           side * uniform(random, 0.05, 1) * up;
        return PlanePair{slave, {a + begin * along, a + end * along, tip}};
      });
}

PlanePair lattice(std::mt19937& random)
{
  return {random_coarse_facet(random), random_coarse_facet(random)};
}

PlanePair unequal_sizes(std::mt19937& random)
{
  return until_convex(
      [&]
      {
        PlanePair pair = ordinary(random);
        Facet& small = random() % 2 == 0 ? pair.slave : pair.master;
        const Facet& large = &small == &pair.slave ? pair.master : pair.slave;
        const std::size_t edge = random() % large.size();
        const Vec<2> at =
            large[edge] + uniform(random, 0, 1) *
                              (large[(edge + 1) % large.size()] - large[edge]);
        const double size = log_uniform(random, -6, 0);
        small = moved(small, size, 0, at);
        return pair;
      });
}

PlanePair everything(std::mt19937& random)
{
  return until_convex(
      [&]
      {
        const Facet facet = convex_facet(random, 1e-6);
        const Vec<2> offset(log_uniform(random, -3, 6), 0.3);
        const Facet master = random() % 2 == 0 ? nudged(random, facet)
                                               : convex_facet(random, 1e-6);
        return shifted({facet, master}, offset);
      });
}
} // namespace

const std::vector<Family>& plane_families()
{
  static const std::vector<Family> families{
      {"random", ordinary},
      {"slivers to 1e-8", slivers},
      {"offset 1e6 x size", far_away},
      {"coincident to 1e-16..1e-6", all_but_coincident},
      {"corner on edge", corner_on_edge},
      {"edge on edge", edge_on_edge},
      {"shared lattice points", lattice},
      {"sizes 1 : 1e-6..1", unequal_sizes},
      {"slivers, coincident, offset", everything}};
  return families;
}
} // namespace raymortar::test
