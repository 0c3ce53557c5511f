#include "raymortar/fem/petsc.h"
#include "raymortar/core/error.h"

namespace raymortar
{
void check(PetscErrorCode code, const char* call)
{
  if (code != 0)
  {
    const char* text = nullptr;
    PetscErrorMessage(code, &text, nullptr);
    throw Error(std::string(call) + " failed: " + (text ? text : "") +
                " (PETSc error " + std::to_string(code) + ")");
  }
}
} // namespace raymortar
