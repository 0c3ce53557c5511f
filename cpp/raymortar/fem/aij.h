// The arrays behind an AIJ matrix, to add to entries without looking for them.
#pragma once

#include "raymortar/core/types.h"
#include "raymortar/fem/petsc.h"
#include <limits>

namespace raymortar
{
/// @brief Compressed rows of this rank in one part of an AIJ matrix.
struct AijPart
{
  PetscMatrix matrix = nullptr;      ///< borrowed
  const PetscInt* offsets = nullptr; ///< (owned rows + 1,)
  const PetscInt* columns = nullptr; ///< local to the part, ascending in a row
  PetscScalar* values = nullptr;
};

/// @brief Holds the arrays of a matrix of type seqaij or mpiaij while it lives.
///
/// Values may be added while the matrix is being assembled. Its pattern must
/// have been assembled before, as `preallocate` does. Otherwise, and with any
/// other type of matrix, there are no arrays and `available` is false.
class AijArrays
{
public:
  explicit AijArrays(PetscMatrix A);
  AijArrays(const AijArrays&) = delete;
  AijArrays& operator=(const AijArrays&) = delete;
  ~AijArrays();

  static constexpr std::int32_t no_entry =
      std::numeric_limits<std::int32_t>::max();

  [[nodiscard]] bool available() const { return _diagonal.values != nullptr; }
  [[nodiscard]] bool owns(PetscInt row) const
  {
    return row >= _begin and row < _end;
  }

  /// @brief Place of a column in an owned row.
  /// @return k >= 0: k-th entry of the row among the columns of this rank; k <
  /// 0: entry -k - 1 among those of other ranks; or no_entry
  [[nodiscard]] std::int32_t find(PetscInt row, PetscInt column) const;

  /// @brief First value of an owned row among the columns of this rank.
  [[nodiscard]] PetscScalar* own_columns(PetscInt row) const
  {
    return _diagonal.values + _diagonal.offsets[row - _begin];
  }

  /// @brief The same among the columns of other ranks; nullptr on one rank.
  [[nodiscard]] PetscScalar* other_columns(PetscInt row) const
  {
    return _others.values ? _others.values + _others.offsets[row - _begin]
                          : nullptr;
  }

private:
  AijPart _diagonal;
  AijPart _others;
  const PetscInt* _other_columns = nullptr; ///< global numbers, ascending
  PetscInt _begin = 0, _end = 0;            ///< owned rows
  PetscInt _first = 0, _last = 0;           ///< columns of this rank
  PetscInt _num_others = 0;
};
} // namespace raymortar
