// Fields on the slave facets that laws take at points: coefficients, an offset,
// tractions of springs.
#pragma once

#include "raymortar/geometry/reference.h"
#include <vector>

namespace raymortar
{
/// @brief A polynomial on every slave facet, by its values at the displacement
/// nodes; zero everywhere where there are none.
///
/// With N the shape functions of the displacement at xi, it is nodes * N there,
/// and its derivative by xi is nodes * dN/dxi.
struct FacetField
{
  std::vector<double> nodal; ///< (facets, dofs per facet, width)

  [[nodiscard]] bool empty() const { return nodal.empty(); }

  /// @brief Nodal values on one facet, a column per node.
  /// @tparam Width Components
  template <class F, int Width = 1>
  [[nodiscard]] Mat<Width, F::dofs> nodes(Index facet) const
  {
    if (nodal.empty())
      return Mat<Width, F::dofs>::Zero();
    return Eigen::Map<const Mat<Width, F::dofs>>(
        nodal.data() + static_cast<std::size_t>(facet) * F::dofs * Width);
  }

  /// @brief Value of a scalar field at a point.
  /// @param[in] N Shape functions there
  template <class F>
  [[nodiscard]] double at(Index facet, const Vec<F::dofs>& N) const
  {
    return nodal.empty() ? 0.0 : nodes<F>(facet).dot(N.transpose());
  }
};
} // namespace raymortar
