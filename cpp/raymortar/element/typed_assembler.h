// Assemblers for facets whose type the compiler knows.
#pragma once

#include "raymortar/element/assembler.h"

namespace raymortar
{
/// @brief Assembler for facet type F and the law of `s`: the general one for a
/// multiplier of a lower degree than F allows, which is rare. Few units hold
/// all instances, so that the build is parallel and takes little memory.
/// @throws Error for a multiplier of another degree than 1, or 2 on quadratic
/// intervals
template <class F>
[[nodiscard]] std::unique_ptr<Assembler> assembler_for(const ContactState& s);
} // namespace raymortar
