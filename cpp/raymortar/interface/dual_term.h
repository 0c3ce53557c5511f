// The contact integrals with a multiplier of dual functions.
#pragma once

#include "raymortar/element/dual_functions.h"
#include "raymortar/interface/mortar_term.h"

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

  [[nodiscard]] const Assembler& assembler() const
  {
    return _mortar.assembler();
  }

  /// @brief Make the dual functions of the present points, and sum what points
  /// give to nodes: gaps and slips by these functions  [theory (4.38)].
  [[nodiscard]] NodeSums sum_nodes(const ContactState& s);
  /// @brief Make the tractions of these functions.
  void renew(const ContactState& s);

  void add_needs(const ContactState& s, PatternNeeds& needs) const override;
  Work residual(const ContactState& s, VectorSink& sink) const override;
  Work tangent(const ContactState& s, MatrixSink& sink) const override;
  /// Functions depend on undeformed areas too, which are not offered here
  void by_parameter(const ContactState& s, const Parameter& by,
                    MatrixSink& sink) const override
  {
    _mortar.by_parameter(s, by, sink);
  }

private:
  std::shared_ptr<DualField> _dual; ///< that the kernel reads
  MortarTerm _mortar;
};
} // namespace raymortar
