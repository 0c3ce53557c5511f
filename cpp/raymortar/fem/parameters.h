// Derivatives of contact's residual for sensitivities, into PETSc.
#pragma once

#include "raymortar/element/parameter.h"
#include "raymortar/fem/petsc.h"
#include "raymortar/fem/zone.h"

namespace raymortar
{
/// @brief Add the derivative of a zone's residual by a parameter, all rows and
/// columns: conditions prescribe unknowns, and not undeformed positions.
/// Assembly is the caller's.
void add_by_parameter(const Zone& zone, PetscMatrix A, const Parameter& by);
} // namespace raymortar
