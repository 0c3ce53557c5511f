// Law at nodes: the rows of each multiplier come from its node.
#pragma once

#include "raymortar/interface/cover_term.h"
#include "raymortar/interface/damping_term.h"
#include "raymortar/nodes/nodal_assembler.h"
#include <functional>

namespace raymortar
{
/// Gives what points give to the nodes, with those that are held
using PointSums =
    std::function<NodeSums(const ContactState&, std::span<const std::int8_t>)>;

/// @brief Rows of nodes whose law holds there  [theory (4.23)-(4.26)]. Elements
/// give the derivatives by displacements.
///
/// The smoothing of the multiplier on held and on partly covered facets is a
/// length that the law adds to gap and slip: its cone and its sign hold.
class NodeTerm final : public Term
{
public:
  NodeTerm(const ContactState& s, PointSums points)
      : _points(std::move(points)), _cover(s)
  {
  }

  [[nodiscard]] DampingTerm* damping() override { return &_damping; }
  [[nodiscard]] CoverTerm* cover() override { return &_cover; }
  void set_up(ContactState& s) override { _cover.set_up(s); }

  [[nodiscard]] std::size_t sums_per_node(const ContactState& s) const override
  {
    return NodeSums::width_in(s.slave.gdim);
  }
  /// Of points, whole facets and ties
  [[nodiscard]] std::vector<double>
  own_sums(const ContactState& s) const override;
  void put_sums(std::span<const double> sums, ContactState& s) const override;
  [[nodiscard]] std::optional<Springs>
  accepted_springs(const ContactState& s) const override;

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

  PointSums _points;
  DampingTerm _damping;
  CoverTerm _cover;
};

/// @brief Contact whose law holds at nodes.
class NodeTerms : public TermFactory
{
public:
  void prepare(ContactState& s) const override;
  [[nodiscard]] std::vector<std::unique_ptr<Term>>
  make(const ContactState& s, bool moves) const override;

protected:
  /// The law's integrals: the first of the terms
  struct Law
  {
    std::unique_ptr<Term> term;
    PointSums sums;
  };
  [[nodiscard]] virtual Law make_law(const ContactState& s, bool moves) const;
};
} // namespace raymortar
