// A zone's input as Python has it: with names for what C++ takes as objects.
#pragma once

#include "raymortar/fem/zone.h"
#include "raymortar/ties/tie.h"
#include "strategy.h"

namespace raymortar::bindings
{
/// What a zone is made of, with the choice of its terms
struct ZoneArguments : ZoneInput
{
  Condition condition = Condition::points;
  bool dual_multiplier = false; ///< of a law at nodes: by dual functions
  std::optional<TieGap> tie;    ///< none: contact
  Strategy strategy = Strategy::bvh;
};

[[nodiscard]] std::shared_ptr<const TermFactory>
contact_terms(Condition condition, bool dual, const Multipliers& multipliers);

[[nodiscard]] ZoneInput with_terms(const ZoneArguments& given);
} // namespace raymortar::bindings
