// Law at nodes: the rows of each multiplier come from its node.
#pragma once

#include "raymortar/interface/cover_term.h"
#include "raymortar/interface/damping_term.h"

namespace raymortar
{
/// @brief Rows of nodes whose law holds there  [theory (4.23)-(4.26)]. Elements
/// give the derivatives by displacements.
///
/// The smoothing of the multiplier on held and on partly covered facets is a
/// length that the law adds to gap and slip: its cone and its sign hold.
class NodeTerm final : public Term
{
public:
  explicit NodeTerm(const ContactState& s) : _cover(s) {}

  [[nodiscard]] DampingTerm& damping() { return _damping; }
  [[nodiscard]] CoverTerm& cover() { return _cover; }

  /// @brief Add what whole facets and ties give to the sums of points.
  void add_sums(const ContactState& s, NodeSums& sums) const;

  void begin_step(const StepStart& start) override
  {
    _damping.begin_step(start);
  }
  Work residual(const ContactState& s, VectorSink& sink) const override;
  Work tangent(const ContactState& s, MatrixSink& sink) const override;

private:
  [[nodiscard]] std::vector<FacetBlock> held_ties() const;
  [[nodiscard]] std::vector<FacetBlock> rim_ties(const ContactState& s,
                                                 RimSide side) const;
  void add_rim(const ContactState& s, RimSide side,
               const std::vector<double>& by_tie, MatrixSink& sink) const;
  void add_shares(const ContactState& s, RimSide side,
                  const std::vector<double>& by_tie, MatrixSink& sink) const;

  DampingTerm _damping;
  CoverTerm _cover;
};
} // namespace raymortar
