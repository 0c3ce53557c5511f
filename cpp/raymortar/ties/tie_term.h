// Slave and master tied to each other where they lay undeformed.
#pragma once

#include "raymortar/interface/term.h"
#include "raymortar/ties/tie.h"

namespace raymortar
{
class TieTerm final : public Term
{
public:
  explicit TieTerm(std::unique_ptr<TieKernel> kernel)
      : _kernel(std::move(kernel))
  {
  }

  [[nodiscard]] const Assembler* assembler() const override
  {
    return _kernel.get();
  }

  /// Takes the pairs of the undeformed bodies, which stay
  void set_up(ContactState& s) override;
  [[nodiscard]] bool keeps_pairs() const override { return _is_set_up; }

  /// Computes the blocks anew: the coefficient of a penalty is another
  void take_gamma(const ContactState& s) override;

  void add_needs(const ContactState& s, PatternNeeds& needs) const override;
  Work residual(const ContactState& s, VectorSink& sink) const override;
  Work tangent(const ContactState& s, MatrixSink& sink) const override;

private:
  std::unique_ptr<TieKernel> _kernel;
  bool _is_set_up = false;
};

/// @brief Surfaces that are tied to each other. A multiplier is a vector, and
/// friction, measure and moving segments are not used.
class TieTerms final : public TermFactory
{
public:
  explicit TieTerms(TieGap gap) : _gap(gap) {}

  /// It holds all components, as contact that sticks
  void prepare(ContactState& s) const override;
  [[nodiscard]] bool lets_segments_move() const override { return false; }
  [[nodiscard]] std::vector<std::unique_ptr<Term>>
  make(const ContactState& s, bool moves) const override;

private:
  TieGap _gap;
};
} // namespace raymortar
