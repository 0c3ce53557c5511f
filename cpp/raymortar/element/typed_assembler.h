// Assemblers for facets whose type the compiler knows.
#pragma once

#include "raymortar/element/assembler.h"

namespace raymortar
{
/// @brief Assembler for facet type F and the law of `s`. The multiplier's
/// degree is 1, or 2 on quadratic intervals. Few units hold all instances, so
/// that the build is parallel and takes little memory.
/// @throws Error for a multiplier of another degree
template <class F>
[[nodiscard]] std::unique_ptr<Assembler> assembler_for(const ContactState& s);
} // namespace raymortar
