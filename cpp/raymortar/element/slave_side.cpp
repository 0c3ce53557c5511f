#include "raymortar/element/slave_side.h"
#include "raymortar/geometry/predicates.h"

namespace raymortar
{
template <int D>
SlaveSide<D>::SlaveSide(const ContactState& s, const Wanted& wanted,
                        const FacetTractions* tractions)
    : _state(s), _wanted(wanted), _tractions(tractions),
      _facet(s.slave, wanted.old), _dofs(s.slave.shape, s.slave.degree),
      _dofs_per_facet(static_cast<std::size_t>(_dofs.nodes())),
      _isoparametric(s.slave.degree == s.slave.node_degree)
{
  if (s.multipliers.components == 0)
    return;
  _multiplier.emplace(s.slave.shape, s.multipliers.degree);
  _multipliers = static_cast<std::size_t>(_multiplier->nodes());
  _lam.at.fill(Vec<D>::Zero());
}

template <int D>
void SlaveSide<D>::take(std::size_t element, TaylorData<D>& e,
                        PointShapes<D>& shapes)
{
  const ContactState& s = _state;
  const Index facet = s.elements.slave[element];
  double factor = 1.0;
  if (const Index m = s.master_of(element); m != no_index)
    factor = s.pair_factors.of(s.slave.body_of(facet), s.master.body_of(m));
  if (facet == _number and factor == _factor)
    return;
  _factor = factor;
  _number = facet;
  shapes.components = s.multipliers.components;
  shapes.scale = s.multipliers.scale;
  shapes.slave_nodes = static_cast<int>(_dofs_per_facet);
  shapes.multipliers = static_cast<int>(_multipliers);
  take_facet(facet, e);
}

template <int D>
void SlaveSide<D>::take_facet(Index facet, TaylorData<D>& e)
{
  const ContactState& s = _state;
  _facet.take(facet);
  if (_wanted.along)
    _reference.take(s.slave, s.slave.X, facet,
                    static_cast<std::size_t>(_facet.shapes().nodes()));
  take_scalars(s.gamma, facet, _gamma, e.gamma);
  e.gamma *= _factor;
  take_scalars(s.offset, facet, _offset, e.offset);
  take_multiplier(facet);
  e.touch = tolerance::touch * _facet.diameter();
  e.measure = s.measure;
  e.slave_bends = _facet.bends();
  if (not _wanted.old)
    return;
  e.history.friction = s.friction.value_or(Coulomb{});
  e.history.elastic_slip = elastic_slip_of(e.history.friction);
  e.history.has_coefficient = not s.friction_coefficient.empty();
  take_scalars(s.friction_coefficient, facet, _coefficient,
               e.history.coefficient);
  take_springs(facet, e);
  take_unfelt(facet, e);
}

template <int D>
void SlaveSide<D>::take_multiplier(Index facet)
{
  const Multipliers& m = _state.multipliers;
  const auto components = static_cast<std::size_t>(m.components);
  const std::size_t first = static_cast<std::size_t>(facet) * _multipliers;
  for (std::size_t k = 0; k < _multipliers; ++k)
  {
    const double* const value =
        _tractions
            ? _tractions->data() + (first + k) * components
            : m.value.data() +
                  static_cast<std::size_t>(m.facet[first + k]) * components;
    for (std::size_t i = 0; i < components; ++i)
      _lam.at[k][static_cast<int>(i)] = value[i];
  }
}

/// A law at nodes takes its own; elastic slip tells all tractions
template <int D>
void SlaveSide<D>::take_unfelt(Index facet, TaylorData<D>& e)
{
  using Rows = Eigen::Matrix<double, D, D, Eigen::RowMajor>;
  const Multipliers& m = _state.multipliers;
  e.history.has_kept = false;
  if (m.unfelt.empty() or _state.has_law_at_nodes() or
      e.history.elastic_slip > 0.0)
    return;
  const std::size_t first = static_cast<std::size_t>(facet) * _multipliers;
  for (std::size_t k = 0; k < _multipliers; ++k)
  {
    const auto node = static_cast<std::size_t>(m.facet[first + k]);
    e.unfelt[k] = Eigen::Map<const Rows>(m.unfelt.data() + node * D * D);
    const Eigen::Map<const Vec<D>> accepted(m.accepted.data() + node * D);
    _kept.at[k] = e.unfelt[k] * (accepted - _lam.at[k]);
    e.history.has_kept = e.history.has_kept or not e.unfelt[k].isZero(0.0);
  }
}

template <int D>
void SlaveSide<D>::take_scalars(const FacetField& field, Index facet,
                                Scalars& nodal, Vec<D>& coefficients) const
{
  nodal.is_constant = true;
  coefficients.setZero();
  if (field.empty())
    return;
  const double* const values =
      field.nodal.data() + static_cast<std::size_t>(facet) * _dofs_per_facet;
  for (std::size_t a = 0; a < _dofs_per_facet; ++a)
  {
    nodal.at[a] = values[a];
    nodal.is_constant = nodal.is_constant and values[a] == values[0];
  }
  coefficients[0] = values[0];
}

template <int D>
void SlaveSide<D>::take_springs(Index facet, TaylorData<D>& e)
{
  e.history.has_springs = _has_rest = false;
  e.history.rest.setZero();
  if (_state.traction_old.empty() or _state.has_law_at_nodes())
    return;
  const double* const values =
      _state.traction_old.nodal.data() +
      static_cast<std::size_t>(facet) * _dofs_per_facet * D;
  for (std::size_t a = 0; a < _dofs_per_facet; ++a)
  {
    _springs.at[a] = Eigen::Map<const Vec<D>>(values + a * D);
    e.history.has_springs =
        e.history.has_springs or not _springs.at[a].isZero(0.0);
  }
  const SpringPoints& points = _state.spring_points;
  const auto f = static_cast<std::size_t>(facet);
  _has_rest = not points.empty() and points.first[f] < points.first[f + 1];
  e.history.has_springs = e.history.has_springs or _has_rest;
}

template <int D>
void SlaveSide<D>::set(const Scalars& nodal, const ShapeRows<T>& N,
                       Vec<D>& c) const
{
  const std::size_t last = _wanted.along ? D : 1;
  for (std::size_t p = 0; p < last; ++p)
  {
    double sum = N[0][p] * nodal.at[0];
    for (std::size_t a = 1; a < _dofs_per_facet; ++a)
      sum += N[a][p] * nodal.at[a];
    c[static_cast<int>(p)] = sum;
  }
}

template <int D>
void SlaveSide<D>::set(const AnyNodes<D>& nodal, std::size_t count,
                       const ShapeRows<T>& N, Mat<D, D>& c) const
{
  c.col(0) = nodal.taylor(N, count, 0);
  if (not _wanted.along)
    return;
  for (int j = 1; j < D; ++j)
    c.col(j) = nodal.taylor(N, count, static_cast<std::size_t>(j));
}

template <int D>
bool SlaveSide<D>::place(std::size_t q, TaylorData<D>& e,
                         PointShapes<D>& shapes)
{
  const Vec<T> xi = _state.points.xi[q].template head<T>();
  const auto tabulate = [&](const ShapeFunctions<T>& of, ShapeRows<T>& rows)
  { _wanted.along ? of.second(xi, rows) : of.first(xi, rows); };
  tabulate(_dofs, shapes.slave);
  if (not _isoparametric)
    tabulate(_facet.shapes(), _nodes);
  const ShapeRows<T>& positions = _isoparametric ? shapes.slave : _nodes;
  if (_wanted.along)
  {
    const auto count = static_cast<std::size_t>(_facet.shapes().nodes());
    for (int p = 0; p < taylor_size<T>; ++p)
      e.reference.col(p) =
          _reference.taylor(positions, count, static_cast<std::size_t>(p));
  }
  place_fields(xi, shapes.slave, e);
  if (_multipliers > 0)
    place_multiplier(xi, e, shapes);
  return _facet.place(positions, _wanted.along, e.slave, e.history.slave_old,
                      e.slave_frames);
}

template <int D>
void SlaveSide<D>::place_fields(const Vec<T>& xi, const ShapeRows<T>& N,
                                TaylorData<D>& e) const
{
  if (not _gamma.is_constant)
  {
    set(_gamma, N, e.gamma);
    e.gamma *= _factor;
  }
  if (not _offset.is_constant)
    set(_offset, N, e.offset);
  // Tractions of dual functions act on several nodes  [theory (4.30)]
  e.has_arm = _multipliers == 0 or e.offset[0] != 0.0 or
              (_state.couples_over_gaps and _tractions == nullptr);
  if (not _wanted.old)
    return;
  if (not _coefficient.is_constant)
    set(_coefficient, N, e.history.coefficient);
  if (e.history.has_springs)
    set(_springs, _dofs_per_facet, N, e.history.traction_old);
  if (not _has_rest)
    return;
  const Mat<D, D> rest =
      rest_at<D>(_state.spring_points, _state.slave.shape,
                 static_cast<std::size_t>(_number), xi, _wanted.along);
  e.history.rest = rest.col(0);
  e.history.traction_old += rest;
}

template <int D>
void SlaveSide<D>::place_multiplier(const Vec<T>& xi, TaylorData<D>& e,
                                    PointShapes<D>& shapes) const
{
  const std::size_t last = _wanted.along ? D : 1;
  if (_state.multipliers.degree == _state.slave.degree)
    for (std::size_t k = 0; k < _multipliers; ++k)
      for (std::size_t p = 0; p < last; ++p)
        shapes.multiplier[k][p] = shapes.slave[k][p];
  else
    _multiplier->first(xi, shapes.multiplier);
  set(_lam, _multipliers, shapes.multiplier, e.lam);
  if (e.history.has_kept)
    set(_kept, _multipliers, shapes.multiplier, e.history.kept);
}

template class SlaveSide<2>;
template class SlaveSide<3>;
} // namespace raymortar
