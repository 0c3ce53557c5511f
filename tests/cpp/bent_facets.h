// Facets near the reference one, bent at random.
#pragma once

#include "differences.h"
#include "facet_types.h"

namespace raymortar::test
{
/// A facet near the reference one, in the plane of the first coordinates
template <class F>
typename F::NodeMatrix bent_facet(Random& random, double bend = 0.1)
{
  typename F::NodeMatrix x;
  for (std::size_t a = 0; a < F::nodes; ++a)
  {
    Vec<F::gdim> at = bend * random.vector<F::gdim>();
    for (std::size_t i = 0; i < F::tdim; ++i)
      at[static_cast<int>(i)] += F::Node::points[a][i];
    x.col(static_cast<int>(a)) = at;
  }
  return x;
}

/// Rows over the displacement dofs of a facet from rows over its position and
/// tangents at xi
template <class F, int R>
Mat<R, F::gdim * F::dofs>
by_dofs(const std::array<Mat<R, F::gdim>, F::gdim>& rows,
        const typename F::RefPoint& xi)
{
  constexpr int D = F::gdim;
  const Vec<F::dofs> N = F::Disp::values(xi);
  const Mat<F::dofs, F::tdim> dN = F::Disp::gradients(xi);
  Mat<R, D * F::dofs> all;
  for (int a = 0; a < F::dofs; ++a)
  {
    Mat<R, D> sum = N[a] * rows[0];
    for (int j = 0; j < F::tdim; ++j)
      sum += dN(a, j) * rows[static_cast<std::size_t>(1 + j)];
    all.template middleCols<D>(D * a) = sum;
  }
  return all;
}

/// No derivatives
template <int R, int D>
std::array<Mat<R, D>, D> no_rows()
{
  std::array<Mat<R, D>, D> rows;
  rows.fill(Mat<R, D>::Zero());
  return rows;
}

/// A point inside all facets
template <class F>
typename F::RefPoint centre()
{
  return F::RefPoint::Constant(0.3);
}
} // namespace raymortar::test
