#include "bent_facets.h"
#include "raymortar/element/extension.h"

using namespace raymortar;
using namespace raymortar::test;

namespace
{
/// Integrals of products of the shape functions over some points of a facet
template <int T>
FacetMatrix part_of(Shape shape, int degree, Vec<2> size)
{
  const ShapeFunctions<T> shapes(shape, degree);
  const auto n = static_cast<Eigen::Index>(shapes.nodes());
  FacetMatrix part = FacetMatrix::Zero(n, n);
  for (int q = 0; q < 12; ++q)
  {
    Vec<T> xi = Vec<T>::Constant(size[1] * (0.3 + 0.2 * std::sin(2.0 * q)));
    xi[0] = size[0] * (0.4 + 0.3 * std::cos(q));
    ShapeRows<T> rows;
    shapes.first(xi, rows);
    for (Eigen::Index a = 0; a < n; ++a)
      for (Eigen::Index b = 0; b < n; ++b)
        part(a, b) += (1.0 + 0.1 * q) * rows[static_cast<std::size_t>(a)][0] *
                      rows[static_cast<std::size_t>(b)][0];
  }
  return part;
}

/// Derivatives of the projection beside central differences
/// @return Number of polynomials that are told
template <int T>
Eigen::Index expect_derivative(Shape shape, int degree, Vec<2> size)
{
  const FacetMatrix part = part_of<T>(shape, degree, size);
  const auto n = part.rows();
  FacetMatrix W(n, n);
  for (Eigen::Index a = 0; a < n; ++a)
    for (Eigen::Index b = 0; b < n; ++b)
      W(a, b) = std::sin(1.0 + 2.0 * static_cast<double>(a) -
                         3.0 * static_cast<double>(b));
  const auto value = [&](const FacetMatrix& of)
  {
    const FacetMatrix K = polynomials_on_part(shape, degree, of);
    return (W.array() * (K * K.transpose()).array()).sum();
  };
  const FacetMatrix by = projection_by_part(shape, degree, part, W);
  // To the moments of another part
  const FacetMatrix to =
      part_of<T>(shape, degree, Vec<2>(0.9 * size[0], 1.1 * size[1]));
  const FacetMatrix change = to - part;
  constexpr double h = 1e-4;
  const double known =
      (value(part + h * change) - value(part - h * change)) / (2.0 * h);
  EXPECT_NEAR((by.array() * change.array()).sum(), known,
              1e-5 * std::abs(known));
  return polynomials_on_part(shape, degree, part).cols();
}

TEST(Extension, ProjectionVariesWithThePart)
{
  EXPECT_EQ(expect_derivative<1>(Shape::interval, 1, {1.0, 0.0}), 2);
  EXPECT_EQ(expect_derivative<1>(Shape::interval, 2, {1.0, 0.0}), 3);
  EXPECT_EQ(expect_derivative<1>(Shape::interval, 2, {0.2, 0.0}), 1);
  EXPECT_EQ(expect_derivative<2>(Shape::triangle, 1, {1.0, 1.0}), 3);
  EXPECT_EQ(expect_derivative<2>(Shape::quadrilateral, 1, {1.0, 1.0}), 4);
}

TEST(Extension, PolynomialsOfADegreeThatIsToldInPartTurn)
{
  // A strip tells one linear polynomial of two
  EXPECT_EQ(expect_derivative<2>(Shape::triangle, 1, {1.0, 0.1}), 2);
  EXPECT_EQ(expect_derivative<2>(Shape::quadrilateral, 1, {1.0, 0.1}), 2);
  EXPECT_EQ(expect_derivative<2>(Shape::triangle, 2, {1.0, 0.2}), 2);
}
} // namespace
