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
} // namespace raymortar
