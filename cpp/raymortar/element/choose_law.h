// From method, friction and multiplier to a law's type: here alone they meet.
#pragma once

#include "raymortar/core/error.h"
#include "raymortar/element/assembler.h"
#include "raymortar/law/augmented.h"
#include "raymortar/law/frictional.h"
#include "raymortar/law/penalty.h"

namespace raymortar
{
/// @brief Call `fn.template operator()<Law>()` with the law of a zone.
/// @throw Error where friction meets a multiplier that is a number
template <class Fn>
decltype(auto) with_law(const ContactState& s, Fn&& fn)
{
  const bool frictional = s.friction.has_value();
  if (s.method == Method::penalty)
    return frictional ? fn.template operator()<FrictionalPenalty>()
                      : fn.template operator()<NormalPenalty>();
  if (s.multipliers.components == 1)
  {
    if (frictional)
      throw Error("friction takes a multiplier that is a vector");
    return fn.template operator()<NormalAugmentedLagrangian>();
  }
  return frictional ? fn.template operator()<FrictionalAugmentedLagrangian>()
                    : fn.template operator()<VectorAugmentedLagrangian>();
}
} // namespace raymortar
