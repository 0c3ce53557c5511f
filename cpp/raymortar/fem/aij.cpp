#include "raymortar/fem/aij.h"
#include "raymortar/fem/rows.h"
#include <algorithm>

namespace raymortar
{
namespace
{
bool is_type(PetscMatrix A, const char* type)
{
  PetscBool same = PETSC_FALSE;
  check(
      PetscObjectBaseTypeCompare(reinterpret_cast<PetscObject>(A), type, &same),
      "PetscObjectBaseTypeCompare");
  return same == PETSC_TRUE;
}

AijPart open_part(PetscMatrix A)
{
  AijPart part;
  PetscInt rows = 0;
  PetscBool done = PETSC_FALSE;
  check(MatGetRowIJ(A, 0, PETSC_FALSE, PETSC_FALSE, &rows, &part.offsets,
                    &part.columns, &done),
        "MatGetRowIJ");
  if (done == PETSC_FALSE)
    return {};
  check(MatSeqAIJGetArray(A, &part.values), "MatSeqAIJGetArray");
  part.matrix = A;
  return part;
}

/// Errors cannot be raised from a destructor, and none is to be expected where
/// opening succeeded
void close_part(AijPart& part)
{
  if (not part.matrix)
    return;
  PetscInt rows = 0;
  PetscBool done = PETSC_FALSE;
  static_cast<void>(MatSeqAIJRestoreArray(part.matrix, &part.values));
  static_cast<void>(MatRestoreRowIJ(part.matrix, 0, PETSC_FALSE, PETSC_FALSE,
                                    &rows, &part.offsets, &part.columns,
                                    &done));
}

std::int32_t place_in(const AijPart& part, PetscInt row, PetscInt column)
{
  const PetscInt* begin = part.columns + part.offsets[row];
  const PetscInt* end = part.columns + part.offsets[row + 1];
  const PetscInt* at = std::lower_bound(begin, end, column);
  return at == end or *at != column ? AijArrays::no_entry
                                    : static_cast<std::int32_t>(at - begin);
}
} // namespace

AijArrays::AijArrays(PetscMatrix A)
{
  const bool parallel = is_type(A, MATMPIAIJ);
  if (not parallel and not is_type(A, MATSEQAIJ))
    return;
  check(MatGetOwnershipRange(A, &_begin, &_end), "MatGetOwnershipRange");
  check(MatGetOwnershipRangeColumn(A, &_first, &_last),
        "MatGetOwnershipRangeColumn");
  if (not parallel)
  {
    _diagonal = open_part(A);
    return;
  }
  PetscMatrix own = nullptr, others = nullptr;
  check(MatMPIAIJGetSeqAIJ(A, &own, &others, &_other_columns),
        "MatMPIAIJGetSeqAIJ");
  check(MatGetSize(others, nullptr, &_num_others), "MatGetSize");
  // Before its first assembly columns are not yet numbered among the others
  if (_num_others > 0 and not _other_columns)
    return;
  _diagonal = open_part(own);
  _others = open_part(others);
}

AijArrays::~AijArrays()
{
  close_part(_others);
  close_part(_diagonal);
}

std::int32_t AijArrays::find(PetscInt row, PetscInt column) const
{
  if (column >= _first and column < _last)
    return place_in(_diagonal, row - _begin, column - _first);
  const PetscInt* end = _other_columns + _num_others;
  const PetscInt* at = std::lower_bound(_other_columns, end, column);
  if (not _others.values or at == end or *at != column)
    return no_entry;
  const std::int32_t k = place_in(_others, row - _begin,
                                  static_cast<PetscInt>(at - _other_columns));
  return k == no_entry ? no_entry : -k - 1;
}
} // namespace raymortar
