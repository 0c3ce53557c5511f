// A facet as it is around one point: a facet type whose nodes are Taylor
// coefficients, so that kernels need not know shapes and degrees.
#pragma once

#include "raymortar/geometry/reference.h"

namespace raymortar
{
/// @brief Monomials around xi = 0: 1, xi_i, and with degree 2 xi_1^2 / 2,
/// xi_1 xi_2, xi_2^2 / 2.
template <int T, int K>
struct Monomials
{
  static constexpr int nodes = K == 1 ? 1 + T : (T == 1 ? 3 : 6);

  [[nodiscard]] static Vec<nodes> values(const Vec<T>& xi)
  {
    Vec<nodes> v;
    v[0] = 1.0;
    v.template segment<T>(1) = xi;
    if constexpr (K == 2 and T == 1)
      v[2] = 0.5 * xi[0] * xi[0];
    else if constexpr (K == 2)
      v.template tail<3>() << 0.5 * xi[0] * xi[0], xi[0] * xi[1],
          0.5 * xi[1] * xi[1];
    return v;
  }

  [[nodiscard]] static Mat<nodes, T> gradients(const Vec<T>& xi)
  {
    Mat<nodes, T> d = Mat<nodes, T>::Zero();
    d.template middleRows<T>(1).setIdentity();
    if constexpr (K == 2 and T == 1)
      d(2, 0) = xi[0];
    else if constexpr (K == 2)
      d.template bottomRows<3>() << xi[0], 0.0, xi[1], xi[0], 0.0, xi[1];
    return d;
  }
};

/// @brief Second derivatives of the monomials of degree 2.
template <int T>
struct SecondOfMonomials
{
  static constexpr int count = T == 1 ? 1 : 3;
  static constexpr int nodes = Monomials<T, 2>::nodes;

  [[nodiscard]] static Mat<nodes, count> at(const Vec<T>&)
  {
    Mat<nodes, count> d = Mat<nodes, count>::Zero();
    d.template bottomRows<count>().setIdentity();
    return d;
  }
};

/// @brief Facet type of a facet around one of its points, where its own
/// coordinates are 0.
///
/// A law's residual and its derivatives at a point need the Taylor polynomial
/// of second order of a facet: position, tangents, curvature. So the kernels of
/// facet types serve facets of any shape and degree, and targets without
/// facets. Displacements vary position and tangents; curvature only enters
/// derivatives along the facet.
template <int D>
struct TaylorFacet
{
  static constexpr int gdim = D;
  static constexpr int tdim = D - 1;
  static constexpr int degree = 1;
  static constexpr int node_degree = 2;
  using Disp = Monomials<tdim, 1>;
  using Node = Monomials<tdim, 2>;
  using SecondOfNode = SecondOfMonomials<tdim>;
  template <int L>
  using Basis = Monomials<tdim, 1>;
  static constexpr int dofs = Disp::nodes;
  static constexpr int nodes = Node::nodes;
  static constexpr bool affine = false;
  static constexpr bool is_taylor = true;
  using Point = Vec<D>;
  using RefPoint = Vec<tdim>;
  using NodeMatrix = Mat<D, nodes>; ///< position, tangents, second derivatives
};
} // namespace raymortar
