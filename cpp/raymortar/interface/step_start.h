// The configuration that a step starts from.
#pragma once

#include "raymortar/interface/pipeline.h"
#include <functional>

namespace raymortar
{
/// @brief Master facets, and which of their displacement components are
/// prescribed.
struct Masters
{
  Surface surface;
  std::vector<double> fixed; ///< nonzero where prescribed, (dofs, gdim)
};

/// Gives the master facets that some slave facets may meet where both were at
/// the start of the step. All ranks call alike, with or without facets
using MastersNear =
    std::function<Masters(const Surface& slave, const FacetDistances&)>;

/// @brief What terms know when they decide for a step.
struct StepStart
{
  /// The zone; its present positions, points and hits are not to be used
  const ContactState& state;
  const PairingRules& rules;
  std::span<const double> fixed_slave; ///< nonzero: prescribed, (dofs, gdim)
  const MastersNear& masters_near;
  double extent; ///< no two points of the surfaces are farther apart. Length
};
} // namespace raymortar
