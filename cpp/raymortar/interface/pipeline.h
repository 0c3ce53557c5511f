// From two surfaces to points and rays: the stages, and what need not be done
// again.
#pragma once

#include "raymortar/element/assembler.h"
#include "raymortar/interface/kept_boxes.h"
#include "raymortar/mortar/filtered.h"
#include "raymortar/mortar/tool_cutter.h"

namespace raymortar
{
/// @brief How partners are found, and where points lie.
struct PairingRules
{
  FacetDistances distances;
  FindPairs find_pairs = find_candidates;
  bool subdivide = false; ///< split quadratic facets before projection
  SegmentRules segment_rules;
  QuadratureRule facet_rule; ///< of whole facets
  Measure measure = Measure::reference;
  std::optional<PairFilter> filter; ///< none: the sides share no vertex
};

/// @brief Counts and seconds of the stages on this rank.
struct PipelineStatistics
{
  std::int64_t candidate_builds = 0; ///< since creation
  std::int64_t pairings = 0;         ///< since creation
  std::int64_t pairings_skipped = 0; ///< nothing had moved; since creation
  double seconds_candidates = 0.0;   ///< of the last time, as below
  double seconds_segments = 0.0;
  double seconds_rays = 0.0;
};

/// @brief Calls visit(name, value) for every field.
template <class Visit>
constexpr void for_each_field(const PipelineStatistics& s, Visit&& visit)
{
  visit("candidate_builds", s.candidate_builds);
  visit("pairings", s.pairings);
  visit("pairings_skipped", s.pairings_skipped);
  visit("seconds_candidates", s.seconds_candidates);
  visit("seconds_segments", s.seconds_segments);
  visit("seconds_rays", s.seconds_rays);
}

/// @brief Candidates, segments, points, rays and elements of a contact state.
///
/// Candidates are kept while facets stay within their skins, points and rays
/// until `forget_points` or `forget_candidates` is called.
class Pipeline
{
public:
  /// @param[in] facets Number of slave facets
  Pipeline(PairingRules rules, Index facets);

  /// @brief All stages that are out of date.
  /// @return Whether points were made anew
  bool pair(ContactState& s);

  /// @brief Rays only: points stay where they are on the slave.
  void cast(ContactState& s);

  /// @brief More reach and depth than the rules had at first, (facets,) each.
  void widen(std::span<const double> reach, std::span<const double> depth);

  /// @brief Positions have changed, or what layers were chosen by.
  void forget_points() { _points_are_present = _rays_are_present = false; }

  /// @brief The master's facets are others.
  void forget_candidates();

  /// @brief With distances as they are widened.
  [[nodiscard]] const PairingRules& rules() const { return _rules; }
  [[nodiscard]] const PairFilter* filter() const
  {
    return _rules.filter ? &*_rules.filter : nullptr;
  }
  [[nodiscard]] const Candidates& candidates() const { return _candidates; }
  [[nodiscard]] const PipelineStatistics& statistics() const
  {
    return _statistics;
  }

private:
  template <int D>
  void update_candidates(const ContactState& s);
  void make_points_anew(ContactState& s);
  void make_points_below_tools(ContactState& s);
  void make_whole_points(ContactState& s);
  void make_points_at_rims(ContactState& s, const ToolCutter& cutter);
  void renew_rays(ContactState& s);

  PairingRules _rules;
  FacetDistances _given; ///< distances without what widens them
  FacetDistances _bare;  ///< distances without skin
  double _smallest_skin; ///< of this rank's slave facets
  Candidates _candidates;
  KeptBoxes _slave_boxes, _master_boxes; ///< candidates hold within
  std::vector<Above> _above; ///< what points were made for, of tools with rims
  PipelineStatistics _statistics;
  bool _points_are_present = false; ///< made at the present positions
  bool _rays_are_present = false;
};
} // namespace raymortar
