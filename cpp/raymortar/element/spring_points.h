// Forces of friction springs at points, beyond the polynomial on each facet.
#pragma once

#include "raymortar/geometry/taylor.h"
#include <limits>
#include <vector>

namespace raymortar
{
/// @brief What a field on the slave facets has more than a polynomial, at the
/// closed points of the accepted step: facet by facet.
struct SpringPoints
{
  std::vector<std::size_t> first; ///< point of each facet, and their number
  std::vector<Vec<2>> xi;
  std::vector<double> area; ///< that each point stands for
  std::vector<double> rest; ///< (points, gdim)

  [[nodiscard]] bool empty() const { return xi.empty(); }
};

/// @brief Square of the distance between two places of a facet, which does not
/// depend on the order of its corners.
template <int T>
struct SquaredDistance
{
  double value;
  Vec<T> slope;

  SquaredDistance(Shape shape, const Vec<T>& d)
  {
    value = d.dot(d);
    slope = 2.0 * d;
    if (shape != Shape::triangle)
      return;
    // The third barycentric coordinate counts as the other two do
    const double third = d.sum();
    value += third * third;
    slope.array() += 2.0 * third;
  }
};

/// @brief The first of the points [begin, end) that is nearest to a place of
/// their facet.
template <int T>
[[nodiscard]] std::size_t nearest_of(const SpringPoints& points, Shape shape,
                                     std::size_t begin, std::size_t end,
                                     const Vec<T>& xi)
{
  std::size_t nearest = begin;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t q = begin; q < end; ++q)
    if (const double d =
            SquaredDistance<T>(shape, xi - points.xi[q].template head<T>())
                .value;
        d < least)
    {
      nearest = q;
      least = d;
    }
  return nearest;
}

/// @brief The field between these points: Shepard's weighted mean, which has
/// the values themselves at the points  [theory (4.13)].
///
/// With the weights a_q / |xi - xi_q|^2 over the largest of them, all is smooth
/// at the points too.
/// @param[in] facet Of a slave surface of this shape
/// @return Value, and the derivatives by xi if they are asked for
template <int D>
[[nodiscard]] Mat<D, D> rest_at(const SpringPoints& points, Shape shape,
                                std::size_t facet, const Vec<D - 1>& xi,
                                bool along)
{
  constexpr int T = D - 1;
  using Distance = SquaredDistance<T>;
  Mat<D, D> sum = Mat<D, D>::Zero();
  const std::size_t begin = points.first[facet], end = points.first[facet + 1];
  if (begin == end)
    return sum;
  const auto distance = [&](std::size_t q)
  { return Distance(shape, xi - points.xi[q].template head<T>()); };
  const auto rest = [&](std::size_t q)
  { return Eigen::Map<const Vec<D>>(points.rest.data() + q * D); };
  const std::size_t nearest = nearest_of<T>(points, shape, begin, end, xi);
  const Distance here = distance(nearest);
  // Differences from the nearest point: it is met exactly
  double weights = points.area[nearest];
  Vec<T> weights_xi = Vec<T>::Zero();
  for (std::size_t q = begin; q < end; ++q)
  {
    if (q == nearest)
      continue;
    const Distance there = distance(q);
    const double share = points.area[q] / there.value;
    const Vec<D> more = rest(q) - rest(nearest);
    weights += share * here.value;
    sum.col(0) += share * here.value * more;
    if (not along)
      continue;
    const Vec<T> slope =
        share * (here.slope - here.value / there.value * there.slope);
    weights_xi += slope;
    for (int j = 0; j < T; ++j)
      sum.col(1 + j) += slope[j] * more;
  }
  sum.col(0) /= weights;
  for (int j = 0; j < T and along; ++j)
    sum.col(1 + j) = (sum.col(1 + j) - weights_xi[j] * sum.col(0)) / weights;
  sum.col(0) += rest(nearest);
  return sum;
}
} // namespace raymortar
