// Test functions of an element at one of its points, of facets of any kind.
#pragma once

#include "raymortar/geometry/taylor.h"

namespace raymortar
{
/// @brief How position and tangents of a body move by its unknowns: of each
/// coefficient and component, D * coefficient + component, a row over them.
template <int D>
using BodyColumns = Eigen::Matrix<double, D * D, 6, Eigen::RowMajor>;

/// @brief Shape functions of the unknowns of an element, in their order: slave,
/// multiplier, target.
template <int D>
struct PointShapes
{
  static constexpr int T = D - 1;
  /// Most unknowns of an element: of two facets and a multiplier
  static constexpr int most = D == 2 ? 6 + 6 + 6 : 27 + 12 + 27;

  int components = 0;    ///< of the multiplier
  int slave_nodes = 0;   ///< of the displacement
  int multipliers = 0;   ///< nodes of the multiplier
  int target_nodes = 0;  ///< of the displacement of a facet
  int body_unknowns = 0; ///< of a body in place of a facet
  double scale = 1.0;    ///< traction per unit of the multiplier's unknown
  ShapeRows<T> slave;
  ShapeRows<T> multiplier;
  ShapeRows<T> target;
  BodyColumns<D> body;

  [[nodiscard]] int side() const { return D * slave_nodes; }
  /// Unknowns without the target's, which come last
  [[nodiscard]] int alone() const { return side() + components * multipliers; }
  [[nodiscard]] int size() const
  {
    return alone() + D * target_nodes + body_unknowns;
  }
  [[nodiscard]] bool has_target() const
  {
    return target_nodes > 0 or body_unknowns > 0;
  }

  [[nodiscard]] double slave_value(int node) const
  {
    return slave[static_cast<std::size_t>(node)][0];
  }
  [[nodiscard]] double multiplier_value(int node) const
  {
    return scale * multiplier[static_cast<std::size_t>(node)][0];
  }
  [[nodiscard]] double target_value(int node) const
  {
    return target[static_cast<std::size_t>(node)][0];
  }
  [[nodiscard]] Vec<T> slave_gradient(int node) const
  {
    return Eigen::Map<const Vec<T>>(
        slave[static_cast<std::size_t>(node)].data() + 1);
  }
  /// Rate of the tangents along the body's normal n, by an unknown
  [[nodiscard]] Vec<T> body_rates(int unknown, const Vec<D>& n) const
  {
    Vec<T> rates;
    for (int j = 0; j < T; ++j)
      rates[j] = n.dot(body.col(unknown).template segment<D>(D * (1 + j)));
    return rates;
  }
  /// Second derivatives, where they are tabulated
  [[nodiscard]] Mat<T, T> target_second(int node) const
  {
    const double* const N =
        target[static_cast<std::size_t>(node)].data() + 1 + T;
    Mat<T, T> second;
    for (int i = 0; i < T; ++i)
      for (int j = 0; j < T; ++j)
        second(i, j) = N[i + j];
    return second;
  }
  [[nodiscard]] Vec<T> target_gradient(int node) const
  {
    return Eigen::Map<const Vec<T>>(
        target[static_cast<std::size_t>(node)].data() + 1);
  }
};
} // namespace raymortar
