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

/// A point inside all facets
template <class F>
typename F::RefPoint centre()
{
  return F::RefPoint::Constant(0.3);
}
} // namespace raymortar::test
