// Parameters of the residual of contact, which are no unknowns: for
// sensitivities.
#pragma once

#include "raymortar/core/types.h"
#include <vector>

namespace raymortar
{
/// @brief A motion of space: x moves with shift + slope x.
struct AffineRate
{
  Vec<3> shift = Vec<3>::Zero();
  Mat<3, 3> slope = Mat<3, 3>::Zero();
};

/// @brief By what a residual is differentiated, at fixed unknowns  [theory
/// (8.6)].
///
/// Derivatives come as blocks of a tangent: in the columns of the displacement
/// of slave and master there is the derivative by a field with values at these
/// nodes.
struct Parameter
{
  enum class Kind : std::int8_t
  {
    fields,    ///< first component: the offset; second: friction coefficient
    gamma,     ///< first component: logarithm of a penalty's coefficient
    old,       ///< positions at the accepted step
    springs,   ///< what springs hold at the point, in place of the slave's
    unknowns,  ///< the displacements; of what springs hold alone
    reference, ///< undeformed positions, of which areas are made
    tool       ///< one component for each motion of a tool, (gdim) at most
  };
  Kind kind = Kind::fields;
  Index tool = no_index;
  /// Motions of the tool at its present place, and at the accepted step
  std::vector<AffineRate> now, old;
};
} // namespace raymortar
