// Terms of the multiplier's equation that belong to whole slave facets: what
// damps it next to held nodes, and what stands for the part without a master.
#pragma once

#include "raymortar/fem/petsc.h"
#include "raymortar/fem/zone.h"

namespace raymortar
{
/// @brief Add their residual to a vector over the coupled rows.
void add_facet_residuals(Zone& zone, PetscVector b);

/// @brief Add their tangent, through the segments that move also.
void add_facet_tangents(Zone& zone, PetscMatrix A);

/// @brief b <- b - alpha * (their tangent's columns) * increment, with the
/// arguments of apply_lifting.
void lift_facet_tangents(const Zone& zone, PetscVector b,
                         std::span<const double> slave,
                         std::span<const double> master, double alpha);
} // namespace raymortar
