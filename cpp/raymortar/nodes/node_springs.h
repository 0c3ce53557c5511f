// Elastic slip of a law at nodes that the accepted step hands on: a vector for
// each node, which turns with the surface around it.
#pragma once

#include "raymortar/element/contact_point.h"
#include "raymortar/element/extension.h"

namespace raymortar
{
/// @brief The elastic slip of the nodes of one slave facet after the other.
template <int D>
class NodeSprings
{
public:
  explicit NodeSprings(const ContactState& s)
      : _state(s),
        _is_elastic(s.has_elastic_slip() and not s.spring_points.empty())
  {
    if (_is_elastic)
      _places = node_places(s.slave.shape, s.multipliers.degree);
  }

  /// Whether nodes hold any
  [[nodiscard]] bool are_there() const { return _is_elastic; }

  /// Another partition may have the nodes in another order: places tell
  void take(Index facet)
  {
    for (std::size_t k = 0; _is_elastic and k < _places.size(); ++k)
      _held[k] = rest_at<D>(_state.spring_points, _state.slave.shape,
                            static_cast<std::size_t>(facet),
                            _places[k].template head<D - 1>(), false)
                     .col(0);
  }

  /// @brief That of a node, turned with the surface at a point  [theory
  /// (4.53)].
  template <class Hit>
  [[nodiscard]] TurnedTraction<D> turned(const Hit& p, int k) const
  {
    return carry_traction<D>(p.old.slave.old, p.old.slave.old_dual, p.slave,
                             held(k), true);
  }

  [[nodiscard]] const Vec<D>& held(int k) const
  {
    return _held[static_cast<std::size_t>(k)];
  }

private:
  const ContactState& _state;
  bool _is_elastic;
  std::vector<Vec<2>> _places;
  std::array<Vec<D>, 9> _held;
};
} // namespace raymortar
