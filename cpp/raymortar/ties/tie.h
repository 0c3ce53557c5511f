// Bilateral ties: blocks that never change, and what turns with the slave.
#pragma once

#include "raymortar/element/assembler.h"

namespace raymortar
{
/// @brief What becomes of the gap that the undeformed surfaces have.
enum class TieGap
{
  keep, ///< it stays, along the slave's deformed normal
  close ///< the surfaces are drawn together
};

/// @brief Kernel of a tie: x_m - x_s - g_0 n = 0 between points that are paired
/// once, where the bodies are undeformed [theory (4.17)].
///
/// A tie that keeps no gap is linear in the displacements: blocks are computed
/// once and kept.
class TieKernel : public Assembler
{
public:
  /// @brief Compute what does not change: points, hits and elements of the
  /// undeformed bodies, with a penalty also its coefficient.
  virtual void set_up(const ContactState& s) = 0;

  /// @brief Elements with points whose gap turns with the slave's normal.
  [[nodiscard]] virtual std::size_t turning_elements() const = 0;
};

/// @param[in] gdim 2 or 3
[[nodiscard]] std::unique_ptr<TieKernel> make_tie_kernel(TieGap gap, int gdim);

/// @brief Let the covered share of facets count what rays have hit: nothing is
/// tied where segments lie but rays miss.
void count_hits_as_cover(ContactState& s);
} // namespace raymortar
