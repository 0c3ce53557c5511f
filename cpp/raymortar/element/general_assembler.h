// Element loops for slave and target of different kinds.
#pragma once

#include "raymortar/element/dual_functions.h"

namespace raymortar
{
/// @brief Assembler for slave facets and a target of any kind, as `s` has them.
///
/// Kernels work on Taylor polynomials at each point, with one indirect call
/// there; what they give is multiplied with the shape functions of both sides.
/// On facets of one kind it gives what the assembler for that kind gives, to
/// rounding, at several times the cost.
/// @param[in] dual In place of the shape functions of the multiplier, whenever
/// it assembles; null: those
/// @throws Error for multipliers of another degree than 1 or 2
[[nodiscard]] std::unique_ptr<Assembler>
make_general_assembler(const ContactState& s,
                       std::shared_ptr<const DualField> dual = nullptr);

/// @brief Assembler in dimension D; each has its own unit.
template <int D>
[[nodiscard]] std::unique_ptr<Assembler>
general_assembler_in(const ContactState& s,
                     const std::shared_ptr<const DualField>& dual);

/// @brief Slip T_n w of (2) at the points of a contact without friction, which
/// otherwise does not need it, (points, gdim). Length.
[[nodiscard]] std::vector<double> slips_without_friction(ContactState s);
} // namespace raymortar
