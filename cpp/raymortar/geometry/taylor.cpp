#include "raymortar/geometry/taylor.h"
#include "raymortar/core/error.h"
#include "raymortar/geometry/curvature.h"

namespace raymortar
{
namespace
{
template <Shape S, int K>
ShapeTaylor<Reference<S>::tdim> coefficients(const Vec<Reference<S>::tdim>& xi)
{
  constexpr int T = Reference<S>::tdim;
  ShapeTaylor<T> c(Lagrange<S, K>::nodes, taylor_size<T>);
  c.col(0) = Lagrange<S, K>::values(xi);
  c.template middleCols<T>(1) = Lagrange<S, K>::gradients(xi);
  c.template rightCols<taylor_size<T> - 1 - T>() =
      SecondGradients<S, K>::at(xi);
  return c;
}

/// Call `fn.template operator()<S, K>()` for a facet with T coordinates
template <int T, class Fn>
decltype(auto) with_lagrange(Shape shape, int degree, Fn&& fn)
{
  const auto with_degree = [&]<Shape S>() -> decltype(auto)
  {
    if (degree == 1)
      return fn.template operator()<S, 1>();
    if (degree == 2)
      return fn.template operator()<S, 2>();
    throw Error("shape functions of degree " + std::to_string(degree) +
                "; there are those of 1 and 2");
  };
  if ((T == 1) != (shape == Shape::interval))
    throw Error(T == 1
                    ? "facets of 2D problems are intervals"
                    : "facets of 3D problems are triangles or quadrilaterals");
  if constexpr (T == 1)
    return with_degree.template operator()<Shape::interval>();
  else if (shape == Shape::triangle)
    return with_degree.template operator()<Shape::triangle>();
  else
    return with_degree.template operator()<Shape::quadrilateral>();
}

template <Shape S, int K>
void set_first(const Vec<Reference<S>::tdim>& xi,
               ShapeRows<Reference<S>::tdim>& rows)
{
  constexpr int T = Reference<S>::tdim;
  const auto N = Lagrange<S, K>::values(xi);
  const auto dN = Lagrange<S, K>::gradients(xi);
  for (std::size_t a = 0; a < Lagrange<S, K>::nodes; ++a)
  {
    const auto node = static_cast<Eigen::Index>(a);
    rows[a][0] = N[node];
    for (std::size_t j = 0; j < T; ++j)
      rows[a][1 + j] = dN(node, static_cast<Eigen::Index>(j));
  }
}

template <Shape S, int K>
void set_second(const Vec<Reference<S>::tdim>& xi,
                ShapeRows<Reference<S>::tdim>& rows)
{
  constexpr std::size_t T = Reference<S>::tdim;
  set_first<S, K>(xi, rows);
  const auto bends = SecondGradients<S, K>::at(xi);
  for (std::size_t a = 0; a < Lagrange<S, K>::nodes; ++a)
    for (std::size_t j = 1 + T; j < taylor_size<int(T)>; ++j)
      rows[a][j] = bends(static_cast<Eigen::Index>(a),
                         static_cast<Eigen::Index>(j - 1 - T));
}
} // namespace

template <int T>
ShapeTaylor<T> shape_taylor(Shape shape, int degree, const Vec<T>& xi)
{
  return with_lagrange<T>(shape, degree,
                          [&]<Shape S, int K>() -> ShapeTaylor<T>
                          { return coefficients<S, K>(xi); });
}

template <int T>
ShapeFunctions<T>::ShapeFunctions(Shape shape, int degree)
    : _is_affine(degree == 1 and shape != Shape::quadrilateral)
{
  with_lagrange<T>(shape, degree,
                   [this]<Shape S, int K>()
                   {
                     _nodes = Lagrange<S, K>::nodes;
                     _first = set_first<S, K>;
                     _second = set_second<S, K>;
                   });
}

template ShapeTaylor<1> shape_taylor<1>(Shape, int, const Vec<1>&);
template ShapeTaylor<2> shape_taylor<2>(Shape, int, const Vec<2>&);
template class ShapeFunctions<1>;
template class ShapeFunctions<2>;
} // namespace raymortar
