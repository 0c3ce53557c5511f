// The points of one element after the other, of facets of any kind.
#pragma once

#include "raymortar/element/any_element.h"
#include "raymortar/element/slave_side.h"
#include "raymortar/element/target_side.h"

namespace raymortar
{
/// @brief Data and test functions of one point after the other: what is alike
/// at all points of a facet is kept.
template <int D, class Law>
struct AnyPoints
{
  const ContactState& state;
  SlaveSide<D> slave;
  TargetSide<D> target;
  TaylorData<D> data;
  PointShapes<D> shapes;
  ElementPoint at{};
  bool has_target = false;
  bool knows_spin = false; ///< of the facets in `data`

  /// @param[in] tractions See `SlaveSide`
  AnyPoints(const ContactState& s, Wanted wanted,
            const FacetTractions* tractions = nullptr)
      : state(s), slave(s, wanted, tractions), target(s, wanted)
  {
  }

  /// @brief Go to an element.
  void take(std::size_t element)
  {
    slave.take(element, data, shapes);
    has_target = target.take(element, shapes);
  }

  /// @brief Go to a point of that element.
  void place(std::size_t q)
  {
    const bool slave_turned = slave.place(q, data, shapes);
    at.weight = state.points.weight[q];
    at.area = state.points.area[q];
    at.g = state.hits.gap[q];
    if (not state.friction_bounds.empty())
      at.bound = state.friction_bounds[q];
    if (not state.point_changes.empty())
      at.changes = state.point_changes.data() + q * 2 * D;
    if (not has_target)
    {
      knows_spin = knows_spin and not slave_turned;
      return;
    }
    const bool turned = target.place(q, data, shapes) or slave_turned;
    if constexpr (is_frictional<Law>)
      if (turned or not knows_spin)
        data.spin.set(data.slave_frames, data.master_frames);
    knows_spin = true;
  }
};

/// @brief Go to the points of an element in segments, one after the other:
/// calls visit(q) at each, with its data in place.
/// @tparam Points AnyPoints, or what has its members
template <class Points, class Visit>
void for_points(Points& points, std::size_t element, Visit&& visit)
{
  const ContactState& s = points.state;
  for (const Index i : s.elements.points_of(element))
  {
    const auto q = static_cast<std::size_t>(i);
    if (s.points.seed[q] == no_index)
      continue;
    points.place(q);
    visit(q);
  }
}
} // namespace raymortar
