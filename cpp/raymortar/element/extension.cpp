#include "raymortar/element/extension.h"
#include "raymortar/geometry/dispatch.h"
#include <array>
#include <cmath>

namespace raymortar
{
namespace
{
/// A polynomial is not found from the closed part of a facet where its mean
/// square there is below this times that at the nodes: its extension would be
/// 14 times as large
constexpr double smallest_share = 5e-3;

/// Nodal values of the monomials of one total degree, of which there are three
using PowersOnFacet =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 9, 3>;
using Pencil = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 3, 3>;

/// Solutions of A v = s B v with v . B v = 1
struct Eigenpairs
{
  Eigen::Vector3d values;
  Eigen::Matrix3d vectors; ///< as columns, the first of which are set
};

/// Turn two rows and columns of C so that their entry is zero, and Q with them
void rotate(Eigen::Matrix3d& C, Eigen::Matrix3d& Q, int p, int q)
{
  if (C(p, q) == 0.0)
    return;
  const double theta = 0.5 * (C(q, q) - C(p, p)) / C(p, q);
  const double t = std::copysign(1.0, theta) /
                   (std::abs(theta) + std::sqrt(theta * theta + 1.0));
  const double c = 1.0 / std::sqrt(t * t + 1.0), s = t * c;
  for (int i = 0; i < 3; ++i)
  {
    const double a = C(i, p), b = C(i, q);
    C(i, p) = c * a - s * b;
    C(i, q) = s * a + c * b;
  }
  for (int i = 0; i < 3; ++i)
  {
    const double a = C(p, i), b = C(q, i);
    C(p, i) = c * a - s * b;
    C(q, i) = s * a + c * b;
    const double u = Q(i, p), v = Q(i, q);
    Q(i, p) = c * u - s * v;
    Q(i, q) = s * u + c * v;
  }
}

/// By Cholesky's factor L of B, and Jacobi's rotations of L^-1 A L^-T
/// @param[in] A, B Symmetric, B positive
Eigenpairs eigenpairs(const Pencil& A, const Pencil& B)
{
  constexpr int sweeps = 12; // rounding is reached after 4
  const auto n = static_cast<int>(A.rows());
  Eigen::Matrix3d inverse = Eigen::Matrix3d::Zero(); // of L
  Eigen::Matrix3d L = Eigen::Matrix3d::Identity();
  for (int j = 0; j < n; ++j)
    for (int i = j; i < n; ++i)
    {
      double rest = B(i, j);
      for (int k = 0; k < j; ++k)
        rest -= L(i, k) * L(j, k);
      L(i, j) = i == j ? std::sqrt(rest) : rest / L(j, j);
    }
  for (int j = 0; j < n; ++j)
    for (int i = j; i < n; ++i)
    {
      double rest = i == j ? 1.0 : 0.0;
      for (int k = j; k < i; ++k)
        rest -= L(i, k) * inverse(k, j);
      inverse(i, j) = rest / L(i, i);
    }
  Eigen::Matrix3d whole = Eigen::Matrix3d::Zero();
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i)
      whole(i, j) = A(i, j);
  Eigen::Matrix3d C = inverse * whole * inverse.transpose();
  Eigen::Matrix3d Q = Eigen::Matrix3d::Identity();
  for (int k = 0; k < sweeps; ++k)
    for (int p = 0; p < n; ++p)
      for (int q = p + 1; q < n; ++q)
        rotate(C, Q, p, q);
  return {C.diagonal(), inverse.transpose() * Q};
}

/// @param[in] largest Degree of the displacement
PowersOnFacet powers_on_facet(Shape shape, int largest, int degree,
                              const std::vector<Vec<2>>& places)
{
  const bool is_product = shape == Shape::quadrilateral;
  const auto nodes = static_cast<Eigen::Index>(places.size());
  PowersOnFacet columns(nodes, 0);
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

namespace
{
/// Sum of columns, times factors
Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 9, 1>
combination(const PowersOnFacet& of, const Vec<3>& factors)
{
  Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 9, 1> sum =
      factors[0] * of.col(0);
  for (Eigen::Index k = 1; k < of.cols(); ++k)
    sum += factors[k] * of.col(k);
  return sum;
}
} // namespace

namespace
{
/// Polynomials on a part, and those of the last degree that are left out
struct Told
{
  FacetMatrix found;
  Eigen::Index whole = 0; ///< columns of degrees of which none is left out
  FacetMatrix left;       ///< of unit length at the nodes
  std::vector<double> share, left_share; ///< mean squares on the part
};

Told tell(Shape shape, int degree, const FacetMatrix& part)
{
  const std::vector<Vec<2>> places = node_places(shape, degree);
  // Share of a polynomial that is as large on the part as at the nodes
  const double equal = part.sum() / static_cast<double>(places.size());
  const int last = shape == Shape::interval ? degree : 2 * degree;
  Told told;
  FacetMatrix& found = told.found;
  found.resize(part.rows(), 0);
  told.left.resize(part.rows(), 0);
  const auto append = [](FacetMatrix& to, const auto& column)
  {
    to.conservativeResize(Eigen::NoChange, to.cols() + 1);
    to.col(to.cols() - 1) = column;
  };
  for (int total = 0; total <= last; ++total)
  {
    PowersOnFacet block = powers_on_facet(shape, degree, total, places);
    if (block.cols() == 0)
      break;
    const PowersOnFacet weighted = part.lazyProduct(block);
    block -= found.lazyProduct(found.transpose().lazyProduct(weighted));
    const Pencil on_part =
        block.transpose().lazyProduct(part.lazyProduct(block));
    const Pencil at_nodes = block.transpose().lazyProduct(block);
    const Eigenpairs pairs = eigenpairs(on_part, at_nodes);
    const auto wanted = found.cols() + block.cols();
    for (int k = 0; k < block.cols(); ++k)
    {
      const double share = pairs.values[k];
      const auto one = combination(block, column(pairs.vectors, k));
      if (share < smallest_share * equal)
      {
        append(told.left, one);
        told.left_share.push_back(share);
        continue;
      }
      append(found, one / std::sqrt(share));
      told.share.push_back(share);
    }
    if (found.cols() < wanted)
      break;
    told.whole = wanted;
  }
  return told;
}
} // namespace

FacetMatrix polynomials_on_part(Shape shape, int degree,
                                const FacetMatrix& part)
{
  return tell(shape, degree, part).found;
}

FacetMatrix projection_by_part(Shape shape, int degree, const FacetMatrix& part,
                               const FacetMatrix& W)
{
  const Told told = tell(shape, degree, part);
  const FacetMatrix whole = told.found.leftCols(told.whole);
  const FacetMatrix B = told.found * told.found.transpose();
  const FacetMatrix B_whole = whole * whole.transpose();
  const FacetMatrix both = W + W.transpose();
  FacetMatrix by = -(B * W * B);
  // Of a degree that is told in part, polynomials turn to those left out
  for (Eigen::Index j = told.whole; j < told.found.cols(); ++j)
    for (Eigen::Index i = 0; i < told.left.cols(); ++i)
    {
      const double s = told.share[static_cast<std::size_t>(j)];
      const double away = s - told.left_share[static_cast<std::size_t>(i)];
      const FacetMatrix u = told.found.col(j), v = told.left.col(i);
      const double turn = (v.transpose() * both * u)(0, 0) / away;
      by += turn * (v * u.transpose() + s * (v * (B_whole * u).transpose() +
                                             (B_whole * v) * u.transpose()));
    }
  return by;
}
} // namespace raymortar
