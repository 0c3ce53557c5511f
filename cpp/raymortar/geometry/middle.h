// The middle of a reference facet.
#pragma once

#include "raymortar/geometry/reference.h"

namespace raymortar
{
/// @brief Mean of the corners of a facet type's reference facet.
template <class F>
[[nodiscard]] typename F::RefPoint middle_of_reference()
{
  return F::RefPoint::Constant(F::shape == Shape::triangle ? 1.0 / 3.0 : 0.5);
}
} // namespace raymortar
