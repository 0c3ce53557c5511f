#include "raymortar/fem/whole_blocks.h"
#include "raymortar/fem/rows.h"
#include <petscmat.h>

namespace raymortar
{
void WholeBlocks::add(const Unknowns& rows, const Unknowns& columns,
                      const double* block)
{
  global_rows(_zone, rows, Constrained::kept, _rows);
  global_rows(_zone, columns, Constrained::kept, _columns);
  check(MatSetValues(_matrix, static_cast<PetscInt>(_rows.size()), _rows.data(),
                     static_cast<PetscInt>(_columns.size()), _columns.data(),
                     block, ADD_VALUES),
        "MatSetValues");
}

void WholeVector::add(const Unknowns& rows, std::span<const double> values)
{
  global_rows(_zone, rows, Constrained::kept, _rows);
  check(VecSetValues(_vector, static_cast<PetscInt>(_rows.size()), _rows.data(),
                     values.data(), ADD_VALUES),
        "VecSetValues");
}
} // namespace raymortar
