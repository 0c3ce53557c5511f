#include "raymortar/interface/mortar_term.h"
#include "raymortar/element/free_tools.h"
#include "raymortar/element/law_gaps.h"
#include "raymortar/geometry/predicates.h"
#include "raymortar/mortar/movers.h"
#include <algorithm>

namespace raymortar
{
namespace
{
Unknowns unknowns_of(const ContactState& s, std::size_t e)
{
  return element_unknowns(s.elements.slave[e], s.master_of(e),
                          free_tool_of(s, e));
}

/// The same of a point's segment, if it has one
template <class Visit>
void visit_movers(const ContactState& s, std::size_t q, Visit&& visit)
{
  if (const Index segment = s.points.segment[q]; segment != no_index)
    visit_movers(s.segmentation,
                 s.segmentation.segments[static_cast<std::size_t>(segment)],
                 visit);
}

/// Unknowns of one of these masters, or free tools
Unknowns target_unknowns(const ContactState& s, Index target)
{
  Unknowns unknowns;
  (s.has_tools() ? unknowns.tool : unknowns.master) = target;
  return unknowns;
}

/// Elements whose tangent is not zero: without a multiplier, those with a
/// point that is closed
std::vector<std::size_t> working_elements(const ContactState& s)
{
  std::vector<std::size_t> working;
  working.reserve(s.elements.size());
  const bool all = s.multipliers.components > 0;
  // No facet's own tolerance is larger
  const double touch =
      all ? 0.0 : tolerance::touch * largest_diameter(s.slave, s.slave.x);
  const std::vector<double> gaps = all ? std::vector<double>() : law_gaps(s);
  // In the frame of the target gaps are shorter than rays
  const auto closed = [&](Index q)
  {
    const auto i = static_cast<std::size_t>(q);
    return gaps[i] <= touch or s.has_frame_of_target(i);
  };
  for (std::size_t e = 0; e < s.elements.size(); ++e)
  {
    const auto points = s.elements.points_of(e);
    if (all or (s.elements.master[e] != no_index and
                std::any_of(points.begin(), points.end(), closed)))
      working.push_back(e);
  }
  return working;
}

/// Whether the block of an element is used, or a block with another master that
/// moves its segments' vertices
bool is_wanted(const ContactState& s, std::size_t e, const MatrixSink& sink)
{
  if (sink.wants(unknowns_of(s, e)))
    return true;
  if (not s.moving_segments or s.has_tools())
    return false;
  const Index slave = s.elements.slave[e], hit = s.elements.master[e];
  const auto points = s.elements.points_of(e);
  bool wanted = false;
  for (const Index q : points)
    visit_movers(s, static_cast<std::size_t>(q),
                 [&](Index m) {
                   wanted = wanted or (m != hit and
                                       sink.wants(element_unknowns(slave, m)));
                 });
  return wanted;
}

/// A point of a segment may hit another master than those its vertices move
/// with, between the chord of an edge and the true edge, or beside a nearer
/// layer: the rows of the master that is hit have columns of the others
void add_couplings(const ContactState& s, PatternNeeds& needs)
{
  for (std::size_t q = 0; q < s.points.size(); ++q)
  {
    const Index hit = s.hits.master[q];
    if (hit == no_index)
      continue;
    visit_movers(s, q,
                 [&](Index m)
                 {
                   if (m != hit)
                     needs.couplings.push_back({s.points.slave[q], hit, m});
                 });
  }
}
} // namespace

void MortarTerm::add_needs(const ContactState& s, PatternNeeds& needs) const
{
  for (std::size_t e = 0; e < s.elements.size(); ++e)
    if (const Index m = s.master_of(e); m != no_index)
      needs.pairs.push_back({s.elements.slave[e], m});
  // All facets meet the free tools in the pattern anyway
  if (not _has_moving_segments or s.has_tools())
    return;
  // Wherever its points hit, vertices of a segment move with its master or with
  // a nearer one
  for (const Segment& segment : s.segmentation.segments)
  {
    needs.pairs.push_back({segment.slave, segment.master});
    visit_movers(s.segmentation, segment,
                 [&](Index m)
                 {
                   if (m != segment.master)
                     needs.pairs.push_back({segment.slave, m});
                 });
  }
  add_couplings(s, needs);
}

Work MortarTerm::residual(const ContactState& s, VectorSink& sink) const
{
  _assembler->residual(
      s,
      [&](std::size_t e, const double* block, int size) {
        sink.add(unknowns_of(s, e), {block, static_cast<std::size_t>(size)});
      });
  return {static_cast<std::int64_t>(s.elements.size()), 0};
}

Work MortarTerm::tangent(const ContactState& s, MatrixSink& sink) const
{
  std::vector<std::size_t> elements = working_elements(s);
  const auto skipped =
      static_cast<std::int64_t>(s.elements.size() - elements.size());
  std::erase_if(elements,
                [&](std::size_t e) { return not is_wanted(s, e, sink); });
  _assembler->tangent(
      s, elements,
      [&](std::size_t e, const double* block, int)
      { sink.add(unknowns_of(s, e), unknowns_of(s, e), block); },
      [&](std::size_t e, Index target, const double* block, int,
          const double* hit_rows)
      {
        const Unknowns columns = target_unknowns(s, target);
        const Unknowns both =
            element_unknowns(s.elements.slave[e], columns.master, columns.tool);
        sink.add(both, both, block);
        if (hit_rows)
          sink.add(target_unknowns(s, target_of(s, e)), columns, hit_rows);
      });
  return {static_cast<std::int64_t>(elements.size()), skipped};
}
} // namespace raymortar
