// Fields on slave facets that are fitted to what closed points hold.
#pragma once

#include "raymortar/element/assembler.h"
#include "raymortar/element/extension.h"

namespace raymortar
{
/// @brief Base of fits on the facets of a slave: their closed points, and shape
/// functions of the displacement there.
template <int D>
class FacetFit
{
protected:
  static constexpr int T = D - 1;
  /// Nodal field of one facet
  using Nodal = Eigen::Matrix<double, D, Eigen::Dynamic, 0, D, 9>;
  /// Shape functions of the displacement
  using Shapes = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 9, 1>;

  FacetFit(const ContactState& state, const PointResults& results)
      : _state(state), _results(results),
        _shapes(state.slave.shape, state.slave.degree),
        _width(static_cast<std::size_t>(_shapes.nodes()) * D)
  {
  }

  [[nodiscard]] std::size_t facets() const
  {
    return static_cast<std::size_t>(_state.slave.num_facets());
  }

  /// Call with the number of each closed point that stands for an area, and of
  /// its facet. Slivers that are turned have a negative one
  template <class Call>
  void for_closed_points(Call&& call) const
  {
    for (std::size_t q = 0; q < _state.points.size(); ++q)
      if (_results.status[q] >= ContactStatus::stick and
          _state.points.area[q] != 0.0)
        call(q, static_cast<std::size_t>(_state.points.slave[q]));
  }

  [[nodiscard]] Shapes shapes_at(const Vec<2>& xi) const
  {
    ShapeRows<T> rows;
    _shapes.first(xi.template head<T>(), rows);
    Shapes N(_shapes.nodes());
    for (int a = 0; a < _shapes.nodes(); ++a)
      N[a] = rows[static_cast<std::size_t>(a)][0];
    return N;
  }

  const ContactState& _state;
  const PointResults& _results;
  ShapeFunctions<T> _shapes; ///< of the displacement
  std::size_t _width;        ///< numbers of a nodal field, per facet
};
} // namespace raymortar
