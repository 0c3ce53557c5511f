// Assemblers for facets whose type the compiler knows.
#pragma once

#include "raymortar/element/assembler.h"

namespace raymortar
{
/// @brief Whether facets of type F have kernels of their own. Quadrilaterals of
/// degree 2 are rare, and those of any facets take 1.0 to 1.6 of the time
/// there.
template <class F>
inline constexpr bool has_own_kernels =
    F::shape != Shape::quadrilateral or F::degree == 1;

/// @brief Assembler for facet type F and the law of `s`: the general one for a
/// multiplier of a lower degree than F allows, which is rare. Few units hold
/// all instances, so that the build is parallel and takes little memory.
/// @throws Error for a multiplier of another degree than 1, or 2 on quadratic
/// intervals
template <class F>
[[nodiscard]] std::unique_ptr<Assembler> assembler_for(const ContactState& s);
} // namespace raymortar
