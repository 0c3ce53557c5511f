// Unknowns besides the slave that move the vertices of segments: the dofs of a
// master facet, or the unknowns of a rigid body.
#pragma once

#include "raymortar/element/free_tools.h"
#include "raymortar/element/target.h"
#include "raymortar/mortar/movers.h"

namespace raymortar
{
/// @brief A facet that vertices of a segment move with, and its unknowns.
template <int D>
class SegmentTarget
{
public:
  /// @param[in] master One that vertices of the segment move with
  SegmentTarget(const ContactState& s, const Segment& of, Index master)
      : _state(s), _segment(of), _master(master),
        _facet(s.master, s.master.x, master)
  {
    if (not s.has_tools())
      return;
    _tool = s.master.body_of(master);
    _freedom = freedom_of(s.tools[static_cast<std::size_t>(_tool)]);
  }

  /// @brief Master facet, or free tool; no_index: a tool that is held.
  [[nodiscard]] Index number() const
  {
    if (not _state.has_tools())
      return _master;
    return _freedom ? _tool : no_index;
  }

  [[nodiscard]] Eigen::Index unknowns() const
  {
    if (not _state.has_tools())
      return D * _state.master.dofs_per_facet();
    return _freedom ? _freedom->size() : 0;
  }

  /// @param[in] vertex Number in the segmentation
  [[nodiscard]] bool moves(std::size_t vertex) const
  {
    const Break& hangs_on = _state.segmentation.breaks[vertex];
    return hangs_on.moves() and hangs_on.master == _master;
  }

  /// @param[in] vertex One that it moves
  [[nodiscard]] AnyVertexMotion<D> motion(std::size_t vertex) const
  {
    return any_vertex_motion<D>(_state, _segment, _facet, vertex);
  }

  /// @brief Motion of a vertex over these unknowns, (gdim - 1, unknowns).
  [[nodiscard]] MotionColumns<D>
  columns(const AnyVertexMotion<D>& motion) const;

private:
  const ContactState& _state;
  const Segment& _segment;
  Index _master;
  AnyFacet<D> _facet;
  Index _tool = no_index;
  const Freedom* _freedom = nullptr;
};

/// @brief Call visit for each facet that vertices of a segment move with.
template <int D, class Visit>
void visit_targets(const ContactState& s, const Segment& of, Visit&& visit)
{
  visit_movers(s.segmentation, of,
               [&](Index master) { visit(SegmentTarget<D>(s, of, master)); });
}

/// @brief Whether segments of an element move on the slave: whole facets do
/// not.
[[nodiscard]] inline bool has_moving_vertices(const ContactState& s,
                                              std::size_t element)
{
  if (not s.has_tools())
    return true;
  Index last = no_index;
  for (const Index q : s.elements.points_of(element))
  {
    const Index number = s.points.segment[static_cast<std::size_t>(q)];
    if (number == last or number == no_index)
      continue;
    last = number;
    const Segment& segment =
        s.segmentation.segments[static_cast<std::size_t>(number)];
    const auto breaks = s.segmentation.breaks_of(segment);
    if (std::any_of(breaks.begin(), breaks.end(),
                    [](const Break& one) { return one.moves(); }))
      return true;
  }
  return false;
}
} // namespace raymortar
