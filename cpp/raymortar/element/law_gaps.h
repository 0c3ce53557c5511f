// Gaps as the law takes them, and results of points that hit nothing.
#pragma once

#include "raymortar/element/assembler.h"

namespace raymortar
{
/// @brief Gap of (1) plus the offset there, of each point; where no master is
/// hit, of what the ray met. Lengths.
[[nodiscard]] std::vector<double> law_gaps(const ContactState& s);

/// @brief Results with the gaps of the law and no contact at any point: what
/// assemblers begin with.
[[nodiscard]] PointResults results_without_hits(const ContactState& s);
} // namespace raymortar
