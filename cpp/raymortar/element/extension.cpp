#include "raymortar/element/extension.h"
#include "raymortar/geometry/dispatch.h"
#include <Eigen/Eigenvalues>
#include <cmath>

namespace raymortar
{
namespace
{
/// Nodal values of the monomials of one total degree, as columns
Eigen::MatrixXd monomials(Shape shape, int largest, int degree)
{
  const bool is_product = shape == Shape::quadrilateral;
  const bool is_line = shape == Shape::interval;
  const std::vector<Vec<2>> places = node_places(shape, largest);
  const auto nodes = static_cast<Eigen::Index>(places.size());
  Eigen::MatrixXd columns(nodes, 0);
  for (int k = std::min(degree, largest); k >= 0; --k)
  {
    const int j = degree - k;
    if (j > (is_line ? 0 : largest) or (not is_product and degree > largest))
      continue;
    columns.conservativeResize(Eigen::NoChange, columns.cols() + 1);
    for (Eigen::Index a = 0; a < nodes; ++a)
    {
      const Vec<2>& x = places[static_cast<std::size_t>(a)];
      columns(a, columns.cols() - 1) = std::pow(x[0], k) * std::pow(x[1], j);
    }
  }
  return columns;
}
} // namespace

std::vector<Vec<2>> node_places(Shape shape, int degree)
{
  std::vector<Vec<2>> places;
  const auto add = [&places]<class Element>()
  {
    for (const auto& point : Element::points)
      places.emplace_back(point[0], point.size() == 1 ? 0.0 : point.back());
  };
  with_shape(shape,
             [&]<Shape S>()
             {
               if (degree == 1)
                 add.template operator()<Lagrange<S, 1>>();
               else
                 add.template operator()<Lagrange<S, 2>>();
             });
  return places;
}

Eigen::MatrixXd polynomials_on_part(Shape shape, int largest,
                                    const Eigen::MatrixXd& part)
{
  // Of a polynomial that is as large on the part as at the nodes
  const double equal = part.sum() / static_cast<double>(part.rows());
  const int dimension = shape == Shape::interval ? 1 : 2;
  Eigen::MatrixXd found(part.rows(), 0);
  for (int degree = 0; degree <= dimension * largest; ++degree)
  {
    Eigen::MatrixXd block = monomials(shape, largest, degree);
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
