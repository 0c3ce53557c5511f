// PETSc's objects under names of their own, and its errors as exceptions.
#pragma once

#include <petscmat.h>

namespace raymortar
{
/// PETSc's Vec and Mat are global names that core/types.h hides: in here they
/// are called so
using PetscVector = ::Vec;
using PetscMatrix = ::Mat;

/// @brief Throw if a PETSc call has failed.
void check(PetscErrorCode code, const char* call);
} // namespace raymortar
