// Slave and master tied to each other where they lay undeformed.
#pragma once

#include "raymortar/element/tie.h"
#include "raymortar/interface/term.h"

namespace raymortar
{
class TieTerm final : public Term
{
public:
  explicit TieTerm(std::unique_ptr<TieKernel> kernel)
      : _kernel(std::move(kernel))
  {
  }

  [[nodiscard]] const TieKernel& kernel() const { return *_kernel; }

  /// @brief Take the pairs of the undeformed bodies, which stay.
  void set_up(ContactState& s);

  /// @brief Compute the blocks anew: the coefficient of a penalty is another.
  void renew(const ContactState& s);

  [[nodiscard]] bool is_set_up() const { return _is_set_up; }

  void add_needs(const ContactState& s, PatternNeeds& needs) const override;
  Work residual(const ContactState& s, VectorSink& sink) const override;
  Work tangent(const ContactState& s, MatrixSink& sink) const override;

private:
  std::unique_ptr<TieKernel> _kernel;
  bool _is_set_up = false;
};
} // namespace raymortar
