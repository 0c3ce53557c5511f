// Polynomials on a facet from values on a part of it.
#pragma once

#include "raymortar/geometry/reference.h"
#include <vector>

namespace raymortar
{
namespace tolerance
{
/// A polynomial is not found from the closed part of a facet where its mean
/// square there is below this times that at the nodes: its extension would be
/// 14 times as large
inline constexpr double extension = 5e-3;
} // namespace tolerance

/// @brief Reference coordinates of the nodes of a facet.
[[nodiscard]] std::vector<Vec<2>> node_places(Shape shape, int degree);

/// @brief Nodal polynomials that values on a part of a facet can tell.
///
/// They are orthonormal on the part, from the constant upwards. Of each degree
/// those are left out that are large at the facet's nodes but small on the
/// part: their extension would be made of errors. Where one is left out there
/// are none of higher degree: those are told only up to lower ones, and which
/// would depend on the order of the nodes.
/// @param[in] degree Of the polynomials on the facet
/// @param[in] part Integrals of products of the shape functions, on the part
[[nodiscard]] Eigen::MatrixXd polynomials_on_part(Shape shape, int degree,
                                                  const Eigen::MatrixXd& part);
} // namespace raymortar
