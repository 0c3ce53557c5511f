// Reference facets and Lagrange shape functions of degree 1 and 2, in the node
// order of Basix: vertices, mid-edges, centre.
#pragma once

#include "raymortar/core/types.h"
#include <array>

namespace raymortar
{
enum class Shape : std::int8_t
{
  interval,
  triangle,
  quadrilateral
};

/// @brief Reference facet: corners, the cycle around them, measure.
///
/// `cycle` lists the corners counter-clockwise; edge e runs from cycle[e] to
/// cycle[e + 1]. An interval has its two ends as "edges".
template <Shape S>
struct Reference;

template <>
struct Reference<Shape::interval>
{
  static constexpr int tdim = 1;
  static constexpr int corners = 2;
  static constexpr int edges = 2;
  static constexpr double measure = 1.0;
  static constexpr std::array<int, 2> cycle = {0, 1};
};

template <>
struct Reference<Shape::triangle>
{
  static constexpr int tdim = 2;
  static constexpr int corners = 3;
  static constexpr int edges = 3;
  static constexpr double measure = 0.5;
  static constexpr std::array<int, 3> cycle = {0, 1, 2};
};

template <>
struct Reference<Shape::quadrilateral>
{
  static constexpr int tdim = 2;
  static constexpr int corners = 4;
  static constexpr int edges = 4;
  static constexpr double measure = 1.0;
  static constexpr std::array<int, 4> cycle = {0, 1, 3, 2};
};

/// @brief How far a point lies outside the reference facet, and across which
/// edge.
struct Violation
{
  double amount = 0.0; ///< <= 0 inside; else distance in reference coordinates
  int edge = -1;       ///< edge with the largest violation, -1 inside
};

namespace detail
{
template <std::size_t N>
[[nodiscard]] inline Violation worst(const std::array<double, N>& outside)
{
  Violation v{outside[0], 0};
  for (std::size_t e = 1; e < N; ++e)
    if (outside[e] > v.amount)
      v = {outside[e], static_cast<int>(e)};
  if (v.amount <= 0.0)
    v.edge = -1;
  return v;
}
} // namespace detail

/// @brief Violation of the reference facet by xi; edges as in Reference.
template <Shape S>
[[nodiscard]] inline Violation violation(const Vec<Reference<S>::tdim>& xi)
{
  if constexpr (S == Shape::interval)
    return detail::worst<2>({-xi[0], xi[0] - 1.0});
  else if constexpr (S == Shape::triangle)
    return detail::worst<3>({-xi[1], xi[0] + xi[1] - 1.0, -xi[0]});
  else
    return detail::worst<4>({-xi[1], xi[0] - 1.0, xi[1] - 1.0, -xi[0]});
}

/// @brief Lagrange basis of degree K on a reference facet. It is Basix's, which
/// has it at run time only: test_reference_facets.py compares the two.
/// `values(xi)` has shape (nodes,), `gradients(xi)` shape (nodes, tdim).
template <Shape S, int K>
struct Lagrange;

template <>
struct Lagrange<Shape::interval, 1>
{
  static constexpr int nodes = 2;
  [[nodiscard]] static Vec<2> values(const Vec<1>& xi)
  {
    return {1.0 - xi[0], xi[0]};
  }
  [[nodiscard]] static Mat<2, 1> gradients(const Vec<1>&)
  {
    return Mat<2, 1>(-1.0, 1.0);
  }
  static constexpr std::array<std::array<double, 1>, 2> points = {
      {{0.0}, {1.0}}};
};

template <>
struct Lagrange<Shape::interval, 2>
{
  static constexpr int nodes = 3;
  [[nodiscard]] static Vec<3> values(const Vec<1>& xi)
  {
    const double s = xi[0];
    return {(1.0 - s) * (1.0 - 2.0 * s), s * (2.0 * s - 1.0),
            4.0 * s * (1.0 - s)};
  }
  [[nodiscard]] static Mat<3, 1> gradients(const Vec<1>& xi)
  {
    const double s = xi[0];
    return Mat<3, 1>(4.0 * s - 3.0, 4.0 * s - 1.0, 4.0 - 8.0 * s);
  }
  static constexpr std::array<std::array<double, 1>, 3> points = {
      {{0.0}, {1.0}, {0.5}}};
};

template <>
struct Lagrange<Shape::triangle, 1>
{
  static constexpr int nodes = 3;
  [[nodiscard]] static Vec<3> values(const Vec<2>& xi)
  {
    return {1.0 - xi[0] - xi[1], xi[0], xi[1]};
  }
  [[nodiscard]] static Mat<3, 2> gradients(const Vec<2>&)
  {
    Mat<3, 2> d;
    d << -1.0, -1.0, 1.0, 0.0, 0.0, 1.0;
    return d;
  }
  static constexpr std::array<std::array<double, 2>, 3> points = {
      {{0.0, 0.0}, {1.0, 0.0}, {0.0, 1.0}}};
};

template <>
struct Lagrange<Shape::triangle, 2>
{
  static constexpr int nodes = 6;
  [[nodiscard]] static Vec<6> values(const Vec<2>& xi)
  {
    const double a = xi[0], b = xi[1], c = 1.0 - a - b;
    Vec<6> v;
    v << c * (2.0 * c - 1.0), a * (2.0 * a - 1.0), b * (2.0 * b - 1.0),
        4.0 * a * b, 4.0 * b * c, 4.0 * a * c;
    return v;
  }
  [[nodiscard]] static Mat<6, 2> gradients(const Vec<2>& xi)
  {
    const double a = xi[0], b = xi[1], c = 1.0 - a - b;
    Mat<6, 2> d;
    d << 1.0 - 4.0 * c, 1.0 - 4.0 * c, 4.0 * a - 1.0, 0.0, 0.0, 4.0 * b - 1.0,
        4.0 * b, 4.0 * a, -4.0 * b, 4.0 * (c - b), 4.0 * (c - a), -4.0 * a;
    return d;
  }
  static constexpr std::array<std::array<double, 2>, 6> points = {
      {{0.0, 0.0}, {1.0, 0.0}, {0.0, 1.0}, {0.5, 0.5}, {0.0, 0.5}, {0.5, 0.0}}};
};

/// Quadrilaterals are tensor products: node i is the product of the interval
/// nodes `factors[i]`
template <int K>
struct Lagrange<Shape::quadrilateral, K>
{
  using Line = Lagrange<Shape::interval, K>;
  static constexpr int nodes = (K + 1) * (K + 1);
  static constexpr std::array<std::array<int, 2>, 9> factors = {
      {{0, 0}, {1, 0}, {0, 1}, {1, 1}, {2, 0}, {0, 2}, {1, 2}, {2, 1}, {2, 2}}};
  [[nodiscard]] static Vec<nodes> values(const Vec<2>& xi)
  {
    const Vec<K + 1> a = Line::values(Vec<1>(xi[0]));
    const Vec<K + 1> b = Line::values(Vec<1>(xi[1]));
    Vec<nodes> v;
    for (int i = 0; i < nodes; ++i)
      v[i] = a[factor(i, 0)] * b[factor(i, 1)];
    return v;
  }
  [[nodiscard]] static Mat<nodes, 2> gradients(const Vec<2>& xi)
  {
    const Vec<1> s(xi[0]), t(xi[1]);
    const Vec<K + 1> a = Line::values(s), b = Line::values(t);
    const Vec<K + 1> da = Line::gradients(s), db = Line::gradients(t);
    Mat<nodes, 2> d;
    for (int i = 0; i < nodes; ++i)
    {
      d(i, 0) = da[factor(i, 0)] * b[factor(i, 1)];
      d(i, 1) = a[factor(i, 0)] * db[factor(i, 1)];
    }
    return d;
  }
  static constexpr auto points = []
  {
    std::array<std::array<double, 2>, nodes> x{};
    for (std::size_t i = 0; i < nodes; ++i)
      for (std::size_t j = 0; j < 2; ++j)
        x[i][j] = Line::points[factors[i][j]][0];
    return x;
  }();

private:
  static constexpr int factor(int node, std::size_t direction)
  {
    return factors[node][direction];
  }
};

template <Shape S, int K>
struct SecondGradients; // in curvature.h

/// @brief A facet type: shape, degree P of the displacement, degree K >= P of
/// the positions x = X + u (K = 2 where the geometry is quadratic).
template <Shape S, int P, int K>
struct FacetType
{
  static constexpr Shape shape = S;
  static constexpr int degree = P;
  static constexpr int node_degree = K;
  using Ref = Reference<S>;
  using Disp = Lagrange<S, P>;
  using Node = Lagrange<S, K>;
  using SecondOfNode = SecondGradients<S, K>;
  /// Shape functions of other fields, of degree L
  template <int L>
  using Basis = Lagrange<S, L>;
  static constexpr int tdim = Ref::tdim;
  static constexpr int gdim = tdim + 1;
  static constexpr int dofs = Disp::nodes;
  static constexpr int nodes = Node::nodes;
  /// Flat with constant tangents
  static constexpr bool affine = K == 1 and S != Shape::quadrilateral;
  using Point = Vec<gdim>;
  using RefPoint = Vec<tdim>;
  using NodeMatrix = Mat<gdim, nodes>;
};
} // namespace raymortar
