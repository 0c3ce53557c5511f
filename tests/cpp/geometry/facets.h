// Facets in the plane as lists of corners: fixed, moved and random ones.
#pragma once

#include "rational.h"
#include "raymortar/geometry/orientation.h"
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace raymortar::test
{
using Facet = std::vector<Vec<2>>;

inline const Facet unit_square{{0, 0}, {1, 0}, {1, 1}, {0, 1}};
inline const Facet unit_triangle{{0, 0}, {1, 0}, {0, 1}};

inline double cross(const Vec<2>& a, const Vec<2>& b)
{
  return a.x() * b.y() - a.y() * b.x();
}

inline double diameter(const Facet& facet)
{
  double d = 0;
  for (const Vec<2>& a : facet)
    for (const Vec<2>& b : facet)
      d = std::max(d, (a - b).norm());
  return d;
}

inline double facet_area(const Facet& facet)
{
  double twice = 0;
  for (std::size_t k = 1; k + 1 < facet.size(); ++k)
    twice += cross(facet[k] - facet[0], facet[k + 1] - facet[0]);
  return 0.5 * twice;
}

inline Facet moved(Facet facet, double scale, double angle, const Vec<2>& shift)
{
  const double c = std::cos(angle);
  const double s = std::sin(angle);
  for (Vec<2>& x : facet)
    x = scale * Vec<2>(c * x.x() - s * x.y(), s * x.x() + c * x.y()) + shift;
  return facet;
}

inline Facet rotated_corners(Facet facet, int by)
{
  std::rotate(facet.begin(), facet.begin() + by, facet.end());
  return facet;
}

/// Corners on an ellipse with random axes: any aspect, always convex
inline Facet random_facet(std::mt19937& random, double flattest)
{
  std::uniform_real_distribution<double> unit(0, 1);
  const int n = unit(random) < 0.5 ? 3 : 4;
  std::vector<double> angle(n);
  for (double& a : angle)
    a = 2 * std::numbers::pi * unit(random);
  std::sort(angle.begin(), angle.end());
  const double flat = std::pow(flattest, unit(random));
  Facet facet;
  for (int k = 0; k < n; ++k)
    facet.emplace_back(std::cos(angle[k]), flat * std::sin(angle[k]));
  const Vec<2> shift(0.6 * unit(random) - 0.3, 0.6 * unit(random) - 0.3);
  return moved(facet, 0.1 + 0.55 * unit(random),
               2 * std::numbers::pi * unit(random), shift);
}

inline bool is_convex(const Facet& facet)
{
  const std::size_t n = facet.size();
  for (std::size_t k = 0; k < n; ++k)
    if (orientation(facet[k], facet[(k + 1) % n], facet[(k + 2) % n]) <= 0)
      return false;
  return n == 3 or (orientation(facet[0], facet[1], facet[3]) > 0 and
                    orientation(facet[1], facet[2], facet[3]) > 0);
}

/// Convex after rounding to the grid of the exact oracle
inline Facet random_grid_facet(std::mt19937& random, double flattest)
{
  Facet facet;
  do
  {
    facet = random_facet(random, flattest);
    std::transform(facet.begin(), facet.end(), facet.begin(), to_grid);
  } while (!is_convex(facet));
  return facet;
}

/// Corners 0, 1, ..., 6: most pairs share corners, edges or lines
inline Facet random_coarse_facet(std::mt19937& random)
{
  std::uniform_int_distribution<int> coordinate(0, 6);
  Facet facet;
  do
  {
    facet.resize(random() % 2 == 0 ? 3 : 4);
    for (Vec<2>& x : facet)
      x = Vec<2>(coordinate(random), coordinate(random)) / 8;
  } while (!is_convex(facet));
  return facet;
}

/// Where the lines ab and cd meet
inline Vec<2> lines_meet(const Vec<2>& a, const Vec<2>& b, const Vec<2>& c,
                         const Vec<2>& d)
{
  return a + cross(c - a, d - c) / cross(b - a, d - c) * (b - a);
}

/// Grid of n x n cells over [-1, 2]^2, nodes moved by up to `jitter` of a cell,
/// cells cut at random into two triangles or left whole
inline std::vector<Facet> tiling(std::mt19937& random, int n, double jitter)
{
  std::uniform_real_distribution<double> move(-jitter, jitter);
  std::vector<Vec<2>> nodes;
  for (int k = 0; k < (n + 1) * (n + 1); ++k)
    nodes.push_back(3.0 / n *
                        (Vec<2>(k % (n + 1), k / (n + 1)) +
                         Vec<2>(move(random), move(random))) -
                    Vec<2>::Ones());
  std::vector<Facet> facets;
  for (int k = 0; k < n * n; ++k)
  {
    const int first = k % n + (n + 1) * (k / n);
    const Facet q{nodes[first], nodes[first + 1], nodes[first + n + 2],
                  nodes[first + n + 1]};
    const unsigned long cut = random() % 3;
    if (cut == 0)
      facets.push_back(q);
    for (unsigned long t = cut; t < 5 and cut > 0; t += 2)
      facets.push_back({q[t % 4], q[(t + 1) % 4], q[(t + 2) % 4]});
  }
  return facets;
}
} // namespace raymortar::test
