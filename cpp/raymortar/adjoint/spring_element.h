// Derivative of what springs hold at a point by what it depends on.
#pragma once

#include "raymortar/adjoint/parameter_element.h"
#include "raymortar/adjoint/spring_fit.h"
#include "raymortar/element/taylor_gradient.h"
#include "raymortar/law/frictional.h"

namespace raymortar
{
/// @brief Sums, into the first row of an element's block, the derivatives of
/// weights times what springs hold at closed points  [theory (8.13)].
template <int D>
class SpringElement : public ParameterElement<D, FrictionalPenalty,
                                              AnyElement<D, FrictionalPenalty>>
{
public:
  using Base =
      ParameterElement<D, FrictionalPenalty, AnyElement<D, FrictionalPenalty>>;
  using Base::Base;
  static constexpr int T = D - 1;
  using typename Base::Columns;
  using typename Base::Hit;
  using typename Base::HitTangent;

  /// @brief Add the point that is placed.
  /// @param[in] target Of the element
  /// @param[out] along Its change along the facet, if it is asked for
  template <class Points>
  void add_held(const Points& points, Index target, const SpringWeights<D>& by,
                AnyIntegrand<D>* along)
  {
    using Kind = Parameter::Kind;
    if (_by.kind == Kind::tool and target != _by.tool)
      return;
    const auto& e = points.data;
    const Hit p(e, points.at);
    const typename Base::Point here{e, p, HitTangent(e, p)};
    auto rows = Base::template none<1>();
    if (_by.kind != Kind::reference)
      rows = held(here, by.held);
    const Vec<1> area(by.area * std::abs(p.weight));
    if (_by.kind == Kind::reference)
      Base::template add_undeformed_area<1>(e, area, rows);
    if (_by.kind == Kind::unknowns)
      Base::template add_area<1>(e, p, here.by.dual, area, rows);
    UnknownRows<1, D> row{};
    expand<1, D>(points.shapes, rows, Base::part_of(points.shapes), row);
    for (std::size_t k = 0; k < std::size_t(points.shapes.size()); ++k)
      this->A[k] += row[0][k];
    if (along)
      set_along(points, here, by, *along);
  }

private:
  using Base::_by;

  /// The part of the traction along the surface, times weights
  [[nodiscard]] TaylorRows<1, D> held(const typename Base::Point& here,
                                      const Vec<D>& weights) const
  {
    const Hit& p = here.p;
    const auto dh = Base::across_rows(
        p, Base::template vary<D>(traction_slopes(p), p.response.t, here),
        frame(here));
    TaylorRows<1, D> rows;
    for (std::size_t k = 0; k < D; ++k)
    {
      rows.slave[k] = weights.transpose() * dh.slave[k];
      rows.target[k] = weights.transpose() * dh.target[k];
    }
    return rows;
  }

  /// Derivative of the frame's normal
  [[nodiscard]] TaylorRows<D, D> frame(const typename Base::Point& here) const
  {
    const Hit& p = here.p;
    const bool moves = _by.kind == Parameter::Kind::unknowns;
    auto rows = Base::template none<D>();
    if (p.of_target)
    {
      rows = Base::vary_normal(p, here.by, Columns(p, here.by, true));
      return moves ? rows : Base::template moved<D>(rows, here);
    }
    for (int j = 0; j < T and moves; ++j)
      rows.slave[static_cast<std::size_t>(1 + j)] =
          -column(here.by.dual, j) * p.slave.n.transpose();
    return rows;
  }

  template <class Points>
  static void set_along(const Points& points, const typename Base::Point& here,
                        const SpringWeights<D>& by, AnyIntegrand<D>& out)
  {
    const Hit& p = here.p;
    const typename TaylorGradient<D, FrictionalPenalty>::Place place(
        here.e, p, here.by.dual);
    const FacetColumns<D, FrictionalPenalty> columns(
        here.e, points.at, p, here.by, place.bend, place.log_gamma,
        Mat<0, T>());
    const Mat<D, D>& by_ends = here.by.frame.by_ends;
    const Mat<D, T> nu = p.of_target
                             ? columns.template ray<D>(-p.g * by_ends, by_ends)
                             : place.bend.n;
    const Mat<D, T> t = chain<D>(traction_slopes(p), p, here.by, columns);
    const Mat<1, T> change =
        (by.held.transpose() * p.across_change(t, nu) + by.xi.transpose()) /
        points.at.weight;
    out.f[0] = std::copysign(by.area, by.area * p.weight) * place.area.jacobian;
    for (int j = 0; j < T; ++j)
      out.f_xi[static_cast<std::size_t>(j)][0] =
          change[j] + out.f[0] * place.area.log_jacobian[j];
  }
};
} // namespace raymortar
