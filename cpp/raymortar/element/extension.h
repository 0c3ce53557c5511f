// Polynomials on a facet from values on a part of it.
#pragma once

#include "raymortar/geometry/predicates.h"
#include "raymortar/geometry/reference.h"
#include <Eigen/Eigenvalues>

namespace raymortar
{
namespace tolerance
{
/// A polynomial is not found from the closed part of a facet where its mean
/// square there is below this times that at the nodes: its extension would be
/// 14 times as large
inline constexpr double extension = 5e-3;
} // namespace tolerance

/// @brief Nodal values of the monomials of one total degree, as columns.
template <class F>
[[nodiscard]] Eigen::MatrixXd monomials(int degree)
{
  constexpr bool is_product = F::shape == Shape::quadrilateral;
  constexpr int largest = F::degree;
  Eigen::MatrixXd columns(F::dofs, 0);
  for (int k = std::min(degree, largest); k >= 0; --k)
  {
    const int j = degree - k;
    if (j > (F::tdim == 1 ? 0 : largest) or
        (not is_product and degree > largest))
      continue;
    columns.conservativeResize(Eigen::NoChange, columns.cols() + 1);
    for (int a = 0; a < F::dofs; ++a)
    {
      const auto& x = F::Disp::points[static_cast<std::size_t>(a)];
      columns(a, columns.cols() - 1) =
          std::pow(x[0], k) * std::pow(x[F::tdim - 1], j);
    }
  }
  return columns;
}

/// @brief Nodal polynomials that values on a part of a facet can tell.
///
/// They are orthonormal on the part, from the constant upwards. Of each degree
/// those are left out that are large at the facet's nodes but small on the
/// part: their extension would be made of errors. Where one is left out there
/// are none of higher degree: those are told only up to lower ones, and which
/// would depend on the order of the nodes.
/// @param[in] part Integrals of products of the shape functions, on the part
template <class F>
[[nodiscard]] Eigen::MatrixXd
polynomials_on_part(const Mat<F::dofs, F::dofs>& part)
{
  // Share of a polynomial that is as large on the part as at the nodes
  const double equal = part.sum() / F::dofs;
  Eigen::MatrixXd found(F::dofs, 0);
  for (int degree = 0; degree <= F::tdim * F::degree; ++degree)
  {
    Eigen::MatrixXd block = monomials<F>(degree);
    if (block.cols() == 0)
      break;
    block -= found * (found.transpose() * part * block);
    const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> solver(
        block.transpose() * part * block, block.transpose() * block);
    const auto wanted = found.cols() + block.cols();
    for (int k = 0; k < block.cols(); ++k)
    {
      const double share = solver.eigenvalues()[k];
      if (share < tolerance::extension * equal)
        continue;
      found.conservativeResize(Eigen::NoChange, found.cols() + 1);
      found.col(found.cols() - 1) =
          block * solver.eigenvectors().col(k) / std::sqrt(share);
    }
    if (found.cols() < wanted)
      break;
  }
  return found;
}
} // namespace raymortar
