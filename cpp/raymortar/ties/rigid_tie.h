// Ties of a slave surface to rigid bodies, which it follows.
#pragma once

#include "raymortar/ties/tie.h"

namespace raymortar
{
/// @brief Kernel of a tie to rigid bodies: R X + b - x_s = 0 at each point,
/// with the undeformed position X and the pose R, b of its body  [theory
/// (4.36)].
/// @param[in] gdim 2 or 3
[[nodiscard]] std::unique_ptr<TieKernel> make_rigid_tie_kernel(int gdim);
} // namespace raymortar
