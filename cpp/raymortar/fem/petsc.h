// Errors of PETSc as exceptions.
#pragma once

#include <petscsystypes.h>

namespace raymortar
{
/// @brief Throw if a PETSc call has failed.
void check(PetscErrorCode code, const char* call);
} // namespace raymortar
