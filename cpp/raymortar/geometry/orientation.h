// On which side of a line a point is, decided exactly.
#pragma once

#include "raymortar/core/types.h"
#include "raymortar/geometry/predicates.h"
#include <array>
#include <cmath>

namespace raymortar
{
namespace detail
{
/// Sum that keeps every rounding error (Shewchuk's grow-expansion)
struct ExactSum
{
  int size = 0;
  std::array<double, 12> parts;

  void add(double x)
  {
    for (int k = 0; k < size; ++k)
    {
      const double sum = x + parts[k];
      const double virtual_part = sum - x;
      parts[k] = (x - (sum - virtual_part)) + (parts[k] - virtual_part);
      x = sum;
    }
    parts[size++] = x;
  }

  void add_product(double x, double y)
  {
    const double product = x * y;
    add(std::fma(x, y, -product));
    add(product);
  }

  /// Smallest first: the parts do not overlap, so the sign is exact
  [[nodiscard]] double value() const
  {
    double sum = 0;
    for (int k = 0; k < size; ++k)
      sum += parts[k];
    return sum;
  }
};

inline double exact_orientation(const Vec<2>& p, const Vec<2>& q,
                                const Vec<2>& x)
{
  ExactSum sum;
  sum.add_product(p.x(), q.y());
  sum.add_product(-p.y(), q.x());
  sum.add_product(q.x(), x.y());
  sum.add_product(-q.y(), x.x());
  sum.add_product(x.x(), p.y());
  sum.add_product(-x.y(), p.x());
  return sum.value();
}
} // namespace detail

/// @brief Twice the area of the triangle (p, q, x), > 0 if x is left of pq.
///
/// The sign is exact, and the value has six digits: where rounding could
/// change that, the sum is repeated with every rounding error kept.
[[nodiscard]] inline double orientation(const Vec<2>& p, const Vec<2>& q,
                                        const Vec<2>& x)
{
  const double first = (p.x() - x.x()) * (q.y() - x.y());
  const double second = (p.y() - x.y()) * (q.x() - x.x());
  const double det = first - second;
  const double bound =
      tolerance::orientation * (std::abs(first) + std::abs(second));
  return std::abs(det) >= bound ? det : detail::exact_orientation(p, q, x);
}
} // namespace raymortar
