// PETSc and MPI for the tests of fem: the others start without.
#pragma once

#include <petscsys.h>

namespace raymortar::test
{
struct PetscSession
{
  PetscSession() { PetscInitializeNoArguments(); }
  ~PetscSession() { PetscFinalize(); }
  PetscSession(const PetscSession&) = delete;
  PetscSession& operator=(const PetscSession&) = delete;
};

/// One session for all suites
inline void start_petsc() { static const PetscSession session; }
} // namespace raymortar::test
