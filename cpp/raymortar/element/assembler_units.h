// Assemblers whose kernels are compiled in units of their own.
#pragma once

#include "raymortar/element/assembler.h"

namespace raymortar
{
/// @brief Degree of the multiplier that goes with the displacement by default.
template <class F>
inline constexpr int usual_multiplier_degree = F::tdim == 1 ? F::degree : 1;

/// @brief Whether there are typed assemblers of facets F with friction: where
/// it costs more than sums over nodes, in 3D of degree 2, sizes gain little.
template <class F>
inline constexpr bool has_typed_friction = F::tdim == 1 or F::degree == 1;

/// @brief That of compile-time sizes where slave and master have facets F, for
/// the laws with friction or for those without.
/// @return Null where the law or the multiplier of `s` is too rare to have one:
/// a vector without friction, a multiplier of another degree
template <class F, bool Frictional>
[[nodiscard]] std::unique_ptr<Assembler> typed_assembler(const ContactState& s);
} // namespace raymortar
