// Polynomials on a facet from values on a part of it.
#pragma once

#include "raymortar/geometry/reference.h"

namespace raymortar
{
/// Matrix over the displacement nodes of one facet
using FacetMatrix =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 9, 9>;

/// @brief Reference coordinates of a facet's displacement nodes.
[[nodiscard]] std::vector<Vec<2>> node_places(Shape shape, int degree);

/// @brief Nodal polynomials that values on a part of a facet can tell.
///
/// They are orthonormal on the part, from the constant upwards. Of each degree
/// those are left out that are large at the facet's nodes but small on the
/// part: their extension would be made of errors. Where one is left out there
/// are none of higher degree: those are told only up to lower ones, and which
/// would depend on the order of the nodes.
/// @param[in] degree Of the displacement
/// @param[in] part Integrals of products of the shape functions, on the part
[[nodiscard]] FacetMatrix polynomials_on_part(Shape shape, int degree,
                                              const FacetMatrix& part);

/// @brief Derivative by the part of sum_ij W_ij (K K^T)_ij, where K has these
/// polynomials as columns  [theory (8.12)].
[[nodiscard]] FacetMatrix projection_by_part(Shape shape, int degree,
                                             const FacetMatrix& part,
                                             const FacetMatrix& W);
} // namespace raymortar
