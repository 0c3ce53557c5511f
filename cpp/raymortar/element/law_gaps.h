// Gaps as the law takes them.
#pragma once

#include "raymortar/element/assembler.h"

namespace raymortar
{
/// @brief Gap of (1) plus the offset there, of each point; where no master is
/// hit, of what the ray met. Lengths.
[[nodiscard]] std::vector<double> law_gaps(const ContactState& s);
} // namespace raymortar
