// Damping of the multiplier next to held nodes.
#pragma once

#include "raymortar/interface/held_facets.h"
#include "raymortar/interface/term.h"

namespace raymortar
{
/// @brief The damping of (5.5). Which facets are damped, and how much in which
/// direction, is decided where a step starts.
///
/// Facets that face no master there within their reach are looked at again
/// without a bound on the reach: they may meet one in the step. What faces none
/// even so is not damped in the step.
class DampingTerm final : public Term
{
public:
  /// @brief Of the softer body. Stress.
  void set_modulus(double modulus) { _modulus = modulus; }
  /// @brief By which the blocks of `facets` are multiplied. 1 / stress
  [[nodiscard]] double compliance() const { return 1.0 / _modulus; }

  /// @brief Facets that are damped whatever is held, of modulus 1; from the
  /// next step on.
  void set_crossing(std::vector<FacetBlock> facets)
  {
    _crossing = std::move(facets);
  }

  /// @brief Set the nodes at which friction keeps what nothing feels, in this
  /// step: facets with no other nodes leave it alone  [theory (5.23)].
  /// @param[in] kept Nonzero where nothing is free, (multiplier nodes, gdim);
  /// empty: nowhere
  void set_kept(const Multipliers& m, std::span<const std::int8_t> kept);

  [[nodiscard]] DampingTerm* damping() override { return this; }

  void begin_step(const StepStart& start) override;
  Work residual(const ContactState& s, VectorSink& sink) const override;
  Work tangent(const ContactState& s, MatrixSink& sink) const override;

  [[nodiscard]] const std::vector<FacetBlock>& facets() const
  {
    return _facets;
  }

  /// @brief Of the same facets, the blocks that are assembled in this step,
  /// without what the law keeps.
  [[nodiscard]] const std::vector<FacetBlock>& acting() const
  {
    return _acting;
  }

  /// @brief Nonzero where neither a slave facet nor what it faces at the start
  /// of the step is free to move in a component, (facets, gdim).
  [[nodiscard]] const std::vector<std::int8_t>& unfelt() const
  {
    return _unfelt;
  }

  /// @brief Nonzero for nodes that are held along the facet's normal, as is
  /// some of what they face at the start of the step, (facets, dofs per facet).
  [[nodiscard]] std::span<const std::int8_t> held_nodes() const
  {
    return _held_nodes;
  }

private:
  double _modulus = 1.0;
  int _gdim = 0;
  std::vector<FacetBlock> _crossing; ///< at cross points, of modulus 1
  std::vector<FacetBlock> _facets;   ///< all of them, of modulus 1
  std::vector<FacetBlock> _rest;     ///< of the same, (5.23)
  std::vector<FacetBlock> _acting;   ///< one or the other of each
  std::vector<std::int8_t> _unfelt;
  std::vector<std::int8_t> _held_nodes;
};
} // namespace raymortar
