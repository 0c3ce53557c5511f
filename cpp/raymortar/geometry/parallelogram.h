// Signed areas in the plane.
#pragma once

#include "raymortar/core/types.h"

namespace raymortar
{
/// @brief Area of the parallelogram of two vectors, > 0 if b is to the left of
/// a: as computed, where `orientation` is exact.
[[nodiscard]] inline double parallelogram(const Vec<2>& a, const Vec<2>& b)
{
  return a[0] * b[1] - a[1] * b[0];
}
} // namespace raymortar
