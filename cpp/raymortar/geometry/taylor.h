// Shape functions of facets whose type is known at run time, as their Taylor
// polynomials at a point.
#pragma once

#include "raymortar/geometry/reference.h"

namespace raymortar
{
/// Coefficients of a Taylor polynomial of degree 2 in T variables: the value,
/// the first derivatives, and those of second order (11, 12, 22)
template <int T>
inline constexpr int taylor_size = T == 1 ? 3 : 6;

/// @brief Taylor coefficients of each shape function, a row per node.
///
/// Of nodal values V as columns, V * this are the coefficients of the field.
template <int T>
using ShapeTaylor =
    Eigen::Matrix<double, Eigen::Dynamic, taylor_size<T>, 0, 9, taylor_size<T>>;

/// @brief Taylor coefficients of the shape functions of degree 1 or 2 at xi.
/// @throw Error for other shapes or degrees, or a shape of another dimension
template <int T>
[[nodiscard]] ShapeTaylor<T> shape_taylor(Shape shape, int degree,
                                          const Vec<T>& xi);

/// @brief The same where kernels take them: the coefficients of one node follow
/// each other.
template <int T>
using ShapeRows = std::array<std::array<double, taylor_size<T>>, 9>;

/// @brief Shape functions of a facet type, which is chosen once for many
/// points.
template <int T>
class ShapeFunctions
{
public:
  /// @throw Error as shape_taylor
  ShapeFunctions(Shape shape, int degree);

  [[nodiscard]] int nodes() const { return _nodes; }
  /// @brief Whether gradients are the same everywhere.
  [[nodiscard]] bool is_affine() const { return _is_affine; }

  /// @brief Set values and first derivatives.
  void first(const Vec<T>& xi, ShapeRows<T>& rows) const { _first(xi, rows); }
  /// @brief Set those of second order, too.
  void second(const Vec<T>& xi, ShapeRows<T>& rows) const { _second(xi, rows); }

private:
  using Tabulate = void (*)(const Vec<T>&, ShapeRows<T>&);
  int _nodes;
  bool _is_affine;
  Tabulate _first, _second;
};
} // namespace raymortar
