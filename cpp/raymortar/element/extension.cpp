#include "raymortar/element/extension.h"
#include "raymortar/geometry/dispatch.h"
#include <Eigen/Eigenvalues>

namespace raymortar
{
namespace
{
/// A polynomial is not found from the closed part of a facet where its mean
/// square there is below this times that at the nodes: its extension would be
/// 14 times as large
constexpr double smallest_share = 5e-3;

/// Nodal values of the monomials of one total degree, of which there are three
using Monomials =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 9, 3>;
using Pencil = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 3, 3>;

/// @param[in] largest Degree of the displacement
Monomials monomials(Shape shape, int largest, int degree,
                    const std::vector<Vec<2>>& places)
{
  const bool is_product = shape == Shape::quadrilateral;
  const auto nodes = static_cast<Eigen::Index>(places.size());
  Monomials columns(nodes, 0);
  for (int k = std::min(degree, largest); k >= 0; --k)
  {
    const int j = degree - k;
    if (j > (shape == Shape::interval ? 0 : largest) or
        (not is_product and degree > largest))
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
  const auto append = [&places](const auto& points)
  {
    for (const auto& x : points)
      places.emplace_back(x[0], x[x.size() - 1]);
  };
  with_shape(shape,
             [&]<Shape S>()
             {
               if (degree == 1)
                 append(Lagrange<S, 1>::points);
               else
                 append(Lagrange<S, 2>::points);
             });
  return places;
}

FacetMatrix polynomials_on_part(Shape shape, int degree,
                                const FacetMatrix& part)
{
  const std::vector<Vec<2>> places = node_places(shape, degree);
  // Share of a polynomial that is as large on the part as at the nodes
  const double equal = part.sum() / static_cast<double>(places.size());
  const int last = shape == Shape::interval ? degree : 2 * degree;
  FacetMatrix found(part.rows(), 0);
  for (int total = 0; total <= last; ++total)
  {
    Monomials block = monomials(shape, degree, total, places);
    if (block.cols() == 0)
      break;
    const Monomials weighted = part.lazyProduct(block);
    block -= found.lazyProduct(found.transpose().lazyProduct(weighted));
    const Pencil on_part =
        block.transpose().lazyProduct(part.lazyProduct(block));
    const Pencil at_nodes = block.transpose().lazyProduct(block);
    const Eigen::GeneralizedSelfAdjointEigenSolver<Pencil> solver(on_part,
                                                                  at_nodes);
    const auto wanted = found.cols() + block.cols();
    for (int k = 0; k < block.cols(); ++k)
    {
      const double share = solver.eigenvalues()[k];
      if (share < smallest_share * equal)
        continue;
      found.conservativeResize(Eigen::NoChange, found.cols() + 1);
      found.col(found.cols() - 1) =
          block.lazyProduct(solver.eigenvectors().col(k)) / std::sqrt(share);
    }
    if (found.cols() < wanted)
      break;
  }
  return found;
}
} // namespace raymortar
