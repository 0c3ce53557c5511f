#include "raymortar/interface/pipeline.h"
#include "raymortar/core/stopwatch.h"
#include "raymortar/mortar/tool_rays.h"
#include "raymortar/mortar/whole_facets.h"
#include <algorithm>
#include <limits>

namespace raymortar
{
Pipeline::Pipeline(PairingRules rules, Index facets)
    : _rules(std::move(rules)), _given(_rules.distances),
      _bare(_rules.distances.bare()),
      _smallest_skin(std::numeric_limits<double>::infinity())
{
  for (Index f = 0; f < facets; ++f)
    _smallest_skin = std::min(_smallest_skin, _given[f].skin);
}

void Pipeline::widen(std::span<const double> reach,
                     std::span<const double> depth)
{
  _rules.distances = _given.widened(reach, depth);
  _bare = _rules.distances.bare();
  forget_points();
}

void Pipeline::forget_candidates()
{
  // Both: if the new master has no facets, its boxes alone would still hold,
  // and candidates that are gone would stay
  _slave_boxes.forget();
  _master_boxes.forget();
  forget_points();
}

template <int D>
void Pipeline::update_candidates(const ContactState& s)
{
  const Stopwatch watch(_statistics.seconds_candidates);
  const auto slave = ray_boxes<D>(s.slave, _bare);
  const auto master = facet_boxes<D>(s.master);
  if (_slave_boxes.hold<D>(slave) and _master_boxes.hold<D>(master))
    return;
  _slave_boxes.keep<D>(
      slave, [this](std::size_t f)
      { return 0.5 * _rules.distances[static_cast<Index>(f)].skin; });
  _master_boxes.keep<D>(master,
                        [this](std::size_t) { return 0.5 * _smallest_skin; });
  _candidates = _rules.find_pairs(s.slave, s.master, _rules.distances);
  if (_rules.filter)
    erase_neighbours(_candidates, s.master, *_rules.filter);
  ++_statistics.candidate_builds;
}

bool Pipeline::pair(ContactState& s)
{
  if (_points_are_present and _rays_are_present)
  {
    ++_statistics.pairings_skipped;
    return false;
  }
  if (s.has_tools())
    make_points_below_tools(s);
  else
  {
    s.slave.gdim == 2 ? update_candidates<2>(s) : update_candidates<3>(s);
    make_points_anew(s);
  }
  renew_rays(s);
  ++_statistics.pairings;
  return true;
}

void Pipeline::make_points_below_tools(ContactState& s)
{
  const Stopwatch watch(_statistics.seconds_segments);
  const ToolCutter* const cutter = cutter_of(s.tools);
  cutter and cutter->is_near(s.slave, s.tools, _bare)
      ? make_points_at_rims(s, *cutter)
      : make_whole_points(s);
  s.friction_bounds.clear(); // of rays that are gone
  _points_are_present = true;
  _rays_are_present = false;
}

/// They stay: nothing that moves cuts the facets
void Pipeline::make_whole_points(ContactState& s)
{
  if (not s.points.whole.empty() and _above.empty())
    return;
  _above.clear();
  s.master.facet_id.clear();
  s.segmentation = whole_facets(s.slave);
  s.points = make_points(s.slave, s.segmentation, _rules.segment_rules,
                         _rules.facet_rule, false, revolves(_rules.measure));
}

/// They stay as long as no rims are above, and the same facets are below tools
void Pipeline::make_points_at_rims(ContactState& s, const ToolCutter& cutter)
{
  ToolSegments made = cutter.cut(s.slave, s.tools, _bare, _rules.subdivide,
                                 s.multipliers.components > 0);
  const bool are_cut = std::find(made.above.begin(), made.above.end(),
                                 Above::rim) != made.above.end();
  const bool stay = not are_cut and made.above == _above;
  _above = std::move(made.above);
  if (stay)
    return;
  s.master = std::move(made.facets);
  s.segmentation = std::move(made.segmentation);
  s.points = make_points(s.slave, s.segmentation, _rules.segment_rules,
                         _rules.facet_rule, true, revolves(_rules.measure));
}

void Pipeline::make_points_anew(ContactState& s)
{
  const Stopwatch watch(_statistics.seconds_segments);
  s.segmentation =
      make_segments(s.slave, s.master, _candidates,
                    {_rules.distances, _rules.subdivide}, filter());
  s.points = make_points(s.slave, s.segmentation, _rules.segment_rules,
                         _rules.facet_rule, s.multipliers.components > 0,
                         revolves(_rules.measure));
  s.friction_bounds.clear(); // of points that are gone
  _points_are_present = true;
  _rays_are_present = false;
}

void Pipeline::cast(ContactState& s) { renew_rays(s); }

void Pipeline::renew_rays(ContactState& s)
{
  if (_rays_are_present)
    return;
  const Stopwatch watch(_statistics.seconds_rays);
  s.hits =
      s.has_tools()
          ? cast_on_tools(s.slave, s.tools, s.points, _rules.distances)
          : cast_rays(s.slave, s.master, s.points, _rules.distances, filter());
  s.elements = group_points(s.points, s.hits);
  _rays_are_present = true;
}
} // namespace raymortar
