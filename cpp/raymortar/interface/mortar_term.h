// The contact integrals: the law at the points of slave and master facets.
#pragma once

#include "raymortar/interface/term.h"

namespace raymortar
{
class MortarTerm final : public Term
{
public:
  /// @param[in] has_moving_segments Whether tangents include the motion of
  /// segments, except in states whose rays alone were cast anew
  MortarTerm(std::unique_ptr<Assembler> assembler, bool has_moving_segments)
      : _assembler(std::move(assembler)),
        _has_moving_segments(has_moving_segments)
  {
  }

  [[nodiscard]] const Assembler& assembler() const { return *_assembler; }

  void add_needs(const ContactState& s, PatternNeeds& needs) const override;
  Work residual(const ContactState& s, VectorSink& sink) const override;

  /// Blocks that are zero are not computed: those of points without contact
  /// where there is no multiplier
  Work tangent(const ContactState& s, MatrixSink& sink) const override;
  void by_parameter(const ContactState& s, const Parameter& by,
                    MatrixSink& sink) const override;

private:
  std::unique_ptr<Assembler> _assembler;
  bool _has_moving_segments;
};
} // namespace raymortar
