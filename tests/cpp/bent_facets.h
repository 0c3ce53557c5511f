// Facets near the reference one, bent at random.
#pragma once

#include "differences.h"
#include "facet_types.h"
#include "raymortar/element/convected.h"
#include "raymortar/element/transported.h"

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

/// Derivatives by the dofs of a facet from those by its tangents
template <class F, int R>
SideRows<F, R> by_dofs(const TangentSlopes<R, F::gdim>& tangents,
                       const Mat<F::dofs, F::tdim>& dN)
{
  const SideSlopes<R, F::gdim> by{SlopeRows<R, F::gdim>::Zero(), tangents};
  SideRows<F, R> rows;
  set_side<F, R>(by, Vec<F::dofs>::Zero(), dN, 0, rows);
  return rows;
}

template <class F, int R>
SideRows<F, R> vary_convected(const ConvectedVector<F::gdim>& c,
                              const Mat<R, F::gdim>& by_value,
                              const Frame<F::gdim>& now,
                              const Mat<F::gdim, F::tdim>& dual,
                              const Mat<F::dofs, F::tdim>& dN)
{
  return by_dofs<F, R>(
      raymortar::vary_convected<R, F::gdim>(c, by_value, now, dual), dN);
}

template <class F, int R>
SideRows<F, R> vary_transported(const TransportedTraction<F::gdim>& c,
                                const Mat<R, F::gdim>& by_value,
                                const PointGeometry<F>& p)
{
  TangentSlopes<R, F::gdim> tangents;
  tangents.fill(SlopeRows<R, F::gdim>::Zero());
  add_transported<R, F::gdim>(c, by_value, p.slave, p.dual, tangents);
  return by_dofs<F, R>(tangents, p.dN_s);
}
} // namespace raymortar::test
