// Products of shape functions, integrated over a facet.
#pragma once

#include "raymortar/geometry/reference.h"

namespace raymortar
{
/// @brief Integrals of N_a N_b over a facet of area 1 that is evenly spread
/// over xi.
template <Shape S, int L>
[[nodiscard]] Mat<Lagrange<S, L>::nodes, Lagrange<S, L>::nodes> unit_mass()
{
  constexpr int n = Lagrange<S, L>::nodes;
  Mat<n, n> M;
  if constexpr (S == Shape::quadrilateral)
  {
    const auto line = unit_mass<Shape::interval, L>();
    const auto& at = Lagrange<S, L>::factors;
    for (std::size_t a = 0; a < n; ++a)
      for (std::size_t b = 0; b < n; ++b)
        M(static_cast<int>(a), static_cast<int>(b)) =
            line(at[a][0], at[b][0]) * line(at[a][1], at[b][1]);
  }
  else if constexpr (L == 1)
  {
    M.setOnes();
    M.diagonal().array() += 1.0;
    M /= n * (n + 1);
  }
  else
  {
    static_assert(S == Shape::interval);
    M << 4.0, -1.0, 2.0, -1.0, 4.0, 2.0, 2.0, 2.0, 16.0;
    M /= 30.0;
  }
  return M;
}

/// @brief Integrals of the deviations of N_a and N_b from their means, over
/// such a facet.
template <Shape S, int L>
[[nodiscard]] Mat<Lagrange<S, L>::nodes, Lagrange<S, L>::nodes> unit_deviation()
{
  const auto M = unit_mass<S, L>();
  const Vec<Lagrange<S, L>::nodes> mean = M.rowwise().sum();
  return M - mean * mean.transpose();
}
} // namespace raymortar
