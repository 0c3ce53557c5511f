// The contact integrals with a multiplier of dual functions.
#pragma once

#include "raymortar/dual/dual_functions.h"
#include "raymortar/interface/mortar_term.h"
#include "raymortar/nodes/node_term.h"

namespace raymortar
{
/// @brief `MortarTerm` whose tractions are interpolated by dual functions,
/// which are shape functions with separate values on each facet  [theory
/// (4.27)-(4.29)].
///
/// Rows of slave nodes, combined to test functions B, have - d lam alone.
class DualTerm final : public Term
{
public:
  /// @param[in] has_moving_segments As of MortarTerm
  DualTerm(const ContactState& s, bool has_moving_segments);

  [[nodiscard]] const Assembler* assembler() const override
  {
    return _mortar.assembler();
  }

  /// @brief The dual functions of the present points, for derivatives.
  [[nodiscard]] const NodeFunctions& functions() const { return *_functions; }

  /// @brief Make the dual functions of the present points, and sum what points
  /// give to nodes: gaps and slips by these functions  [theory (4.38)].
  /// @param[in] held Of DampingTerm: these nodes take test functions (4.56)
  [[nodiscard]] NodeSums sum_nodes(const ContactState& s,
                                   std::span<const std::int8_t> held);
  /// Makes the tractions of these functions
  void take_sums(const ContactState& s) override;

  void add_needs(const ContactState& s, PatternNeeds& needs) const override;
  Work residual(const ContactState& s, VectorSink& sink) const override;
  Work tangent(const ContactState& s, MatrixSink& sink) const override;

private:
  std::shared_ptr<NodeFunctions> _functions; ///< that the kernel reads
  MortarTerm _mortar;
  DualBasis _basis;
  std::vector<DualFacet> _facets;
};

/// @brief Contact whose law holds at nodes, with a multiplier of dual
/// functions.
class DualTerms final : public NodeTerms
{
protected:
  [[nodiscard]] Law make_law(const ContactState& s, bool moves) const override
  {
    auto term = std::make_unique<DualTerm>(s, moves);
    DualTerm& dual = *term;
    return {std::move(term),
            [&dual](const ContactState& now, std::span<const std::int8_t> held)
            { return dual.sum_nodes(now, held); }};
  }
};
} // namespace raymortar
