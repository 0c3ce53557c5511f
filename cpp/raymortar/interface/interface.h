// Contact of one slave surface with a master, on the facets that are here.
#pragma once

#include "raymortar/interface/cover_term.h"
#include "raymortar/interface/damping_term.h"
#include "raymortar/interface/pipeline.h"
#include "raymortar/target/freedom.h"
#include <string_view>

namespace raymortar
{
/// @brief What an interface is made of.
struct InterfaceInput : PairingRules
{
  Surface slave;
  std::optional<FacetKind> master_kind; ///< none: the slave's
  /// Rigid bodies in place of a master's facets; empty: facets
  std::vector<std::shared_ptr<const Tool>> tools;
  Multipliers multipliers;
  Method method = Method::augmented_lagrangian;
  std::optional<FrictionLaw> friction; ///< none: frictionless
  LawFrame frame = LawFrame::automatic;
  bool keeps_springs = true; ///< see ContactState
  bool moving_segments = true;
  /// Makes the terms; null: contact whose law holds at points
  std::shared_ptr<const TermFactory> terms;
};

/// @brief Contact whose law holds at points: the law's integrals and what
/// smooths its multiplier.
class PointTerms final : public TermFactory
{
public:
  [[nodiscard]] std::vector<std::unique_ptr<Term>>
  make(const ContactState& s, bool moves) const override;
};

/// @brief State and terms of contact, and the stages that pair its surfaces.
///
/// It knows the slave facets of one rank and the master facets that they may
/// meet. It sends nothing: ranks are the zone's. Nothing in `terms()` changes
/// it.
class Interface
{
public:
  explicit Interface(const InterfaceInput& input);

  /// @brief Other master facets, where they are and where they were.
  void set_master(Surface master);

  /// @brief Other terms than those of the input, before the first step: where
  /// the law holds. What is sent for a step is to be sent anew.
  void set_terms(const TermFactory& factory);

  /// @brief Present displacement of the slave's and the master's dofs,
  /// (dofs, gdim).
  /// @return Whether anything has moved
  bool move_slave(std::span<const double> u);
  bool move_master(std::span<const double> u);

  /// @brief Displacement at which the step starts; see `begin_step`.
  void set_old_slave(std::span<const double> u);
  void set_old_master(std::span<const double> u);

  /// @brief Where the tools are, or were at the accepted step.
  /// @return Whether any has moved
  bool move_tools(std::span<const Pose> poses);
  void set_old_tools(std::span<const Pose> poses);

  /// @brief Set the motions of the tools at their present place, one each.
  void set_freedoms(std::vector<Freedom> freedoms);

  /// @brief Rows of the coupled system, (dofs, gdim); of the multipliers the
  /// first of each node, (nodes,).
  void set_rows(std::span<const GlobalIndex> slave,
                std::span<const GlobalIndex> multiplier);
  void set_master_rows(std::vector<GlobalIndex> rows);

  /// @brief Let the terms decide for the step from the old displacements.
  /// @param[in] fixed_slave Nonzero where a component is prescribed,
  /// (dofs, gdim)
  /// @param[in] extent No two points of the surfaces are farther apart. Length
  void begin_step(std::span<const double> fixed_slave,
                  const MastersNear& masters_near, double extent);

  /// @brief Nodal tractions, (multiplier nodes, components).
  void set_multiplier(std::span<const double> values);

  /// @brief See Zone::set_unfelt.
  void set_unfelt(std::span<const double> parts,
                  std::span<const double> accepted,
                  std::span<const std::int8_t> kept);

  /// @brief See Zone::set_gamma.
  void set_gamma(std::span<const double> gamma, double scale,
                 PairFactors factors);

  /// @brief See Zone::set_offset.
  /// @return Whether it is another than before
  bool set_offset(std::span<const double> offset);

  /// @brief Set a field on the slave that needs nothing else: see `fields` in
  /// the source.
  /// @param[in] values At the slave facets' dofs, (facets, dofs per facet,
  /// width); empty: none
  /// @throws Error for a name that is none of theirs
  void set_field(std::string_view name, std::span<const double> values);
  void set_friction_bounds(std::vector<PointBound> bounds);
  /// @brief Whether friction makes couples over gaps, see ContactState.
  void set_couples_over_gaps(bool set) { _state.couples_over_gaps = set; }
  /// @brief What springs hold at points, with the field "traction_old".
  void set_spring_points(SpringPoints points)
  {
    _state.spring_points = std::move(points);
  }

  /// @brief Cross points of a tie: slave dofs that take part in other ties or
  /// contacts too, nonzero, (dofs,). From the next step on.
  void set_crossing(std::span<const std::int8_t> dofs);

  /// @brief All stages that are out of date; of a tie once, before anything
  /// moves.
  void pair();

  /// @brief Whether nothing that moves changes the pairs.
  [[nodiscard]] bool has_tied() const;

  /// @brief Rays only; the tangent is that at fixed points until `pair`.
  void cast();

  /// @brief See Term::sums_per_node.
  [[nodiscard]] std::size_t sums_per_node() const;
  /// @brief See Term::own_sums.
  [[nodiscard]] std::vector<double> own_node_sums() const;
  /// @brief The same of all zones and ranks, which the law takes.
  void set_node_sums(std::span<const double> sums);
  void set_node_bounds(std::vector<PointBound> bounds)
  {
    _state.node_bounds = std::move(bounds);
  }
  void set_point_changes(std::vector<double> changes)
  {
    _state.point_changes = std::move(changes);
  }
  void set_node_changes(NodeChanges changes)
  {
    _state.node_changes = std::move(changes);
  }

  /// @brief What the terms' blocks couple at present.
  [[nodiscard]] PatternNeeds needs() const;

  /// @brief What contact adds to the equations, term by term.
  [[nodiscard]] const std::vector<std::unique_ptr<Term>>& terms() const
  {
    return _terms;
  }

  [[nodiscard]] const ContactState& state() const { return _state; }
  [[nodiscard]] const Pipeline& pipeline() const { return _pipeline; }
  /// @brief Kernel of the law.
  [[nodiscard]] const Assembler& assembler() const;
  [[nodiscard]] DampingTerm& damping() const;
  [[nodiscard]] CoverTerm& cover() const;
  /// @brief See Zone::accepted_springs.
  [[nodiscard]] Springs accepted_springs() const;

private:
  template <class Get>
  [[nodiscard]] auto& first(Get&& get) const;
  void forget_what_hangs_on_past();

  bool _has_moving_segments;
  ContactState _state;
  Pipeline _pipeline;
  std::vector<std::unique_ptr<Term>> _terms;
};
} // namespace raymortar
