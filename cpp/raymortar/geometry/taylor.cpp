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

template <Shape S>
ShapeTaylor<Reference<S>::tdim>
coefficients_of(int degree, const Vec<Reference<S>::tdim>& xi)
{
  if (degree == 1)
    return coefficients<S, 1>(xi);
  if (degree == 2)
    return coefficients<S, 2>(xi);
  throw Error("shape functions of degree " + std::to_string(degree) +
              "; there are those of 1 and 2");
}
} // namespace

template <>
ShapeTaylor<1> shape_taylor<1>(Shape shape, int degree, const Vec<1>& xi)
{
  if (shape != Shape::interval)
    throw Error("facets of 2D problems are intervals");
  return coefficients_of<Shape::interval>(degree, xi);
}

template <>
ShapeTaylor<2> shape_taylor<2>(Shape shape, int degree, const Vec<2>& xi)
{
  if (shape == Shape::interval)
    throw Error("facets of 3D problems are triangles or quadrilaterals");
  return shape == Shape::triangle
             ? coefficients_of<Shape::triangle>(degree, xi)
             : coefficients_of<Shape::quadrilateral>(degree, xi);
}
} // namespace raymortar
