// From friction and multiplier to the type of a law at nodes.
#pragma once

#include "raymortar/core/error.h"
#include "raymortar/element/assembler.h"
#include "raymortar/nodes/nodal.h"

namespace raymortar
{
/// @brief As with_law, of a law at nodes: `Nodal` of it.
template <class Fn>
decltype(auto) with_nodal_law(const ContactState& s, Fn&& fn)
{
  if (s.multipliers.components > 1)
    return s.friction
               ? fn.template operator()<Nodal<FrictionalAugmentedLagrangian>>()
               : fn.template operator()<Nodal<VectorAugmentedLagrangian>>();
  if (s.friction)
    throw Error("friction takes a multiplier that is a vector");
  return fn.template operator()<Nodal<NormalAugmentedLagrangian>>();
}
} // namespace raymortar
