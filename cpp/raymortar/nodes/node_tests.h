// Test functions of gaps at nodes, which are nowhere negative.
#pragma once

#include "raymortar/geometry/taylor.h"

namespace raymortar
{
/// @brief Set test functions from a multiplier's shape functions at a point:
/// hats as they are, of degree 2 on intervals the Bernstein polynomials [theory
/// (4.23)].
template <int T>
void set_node_tests(const ShapeRows<T>& N, int nodes, ShapeRows<T>& tests)
{
  const auto count = static_cast<std::size_t>(nodes);
  for (std::size_t k = 0; k < count; ++k)
    tests[k] = N[k];
  if (T != 1 or count != 3)
    return;
  for (std::size_t p = 0; p <= T; ++p)
  {
    tests[0][p] += 0.25 * N[2][p];
    tests[1][p] += 0.25 * N[2][p];
    tests[2][p] *= 0.5;
  }
}
} // namespace raymortar
