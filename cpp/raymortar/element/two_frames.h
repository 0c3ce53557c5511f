// A point of a facet at the present and at the accepted step.
#pragma once

#include "raymortar/geometry/frame.h"

namespace raymortar
{
/// @brief Frames of one material point of a facet.
template <int D>
struct TwoFrames
{
  Frame<D> now;
  Frame<D> old;
  Mat<D, D - 1> old_dual; ///< of the old tangents
};
} // namespace raymortar
