// Bodies of this rank assembled into PETSc: linear elasticity.
#pragma once

#include "elastic_block.h"
#include <petscmat.h>
#include <span>

/// @brief Cells, loads and supports in the rows that this rank owns.
class Volume
{
public:
  /// @param[in] begin First row of this rank
  /// @param[in] num_rows Rows of the bodies, which come first
  Volume(PetscInt begin, int num_rows)
      : _begin(begin), _load(static_cast<std::size_t>(num_rows), 0.0),
        _held(_load.size(), false)
  {
  }

  void add(const ElasticBlock& block, PetscInt first_row);
  void hold(PetscInt row) { _held[local(row)] = true; }
  void load(PetscInt row, double force) { _load[local(row)] += force; }

  /// Compressed rows of the stiffness, global columns
  void pattern(std::vector<std::int32_t>& offsets,
               std::vector<std::int32_t>& columns) const;

  /// Adds K u - load to b, and K to A; the identity in the held rows
  void assemble(std::span<const double> u, Mat A, Vec b) const;

private:
  using CellRows = std::array<PetscInt, 8>;
  [[nodiscard]] std::size_t local(PetscInt row) const
  {
    return static_cast<std::size_t>(row - _begin);
  }

  PetscInt _begin;
  std::vector<double> _load;
  std::vector<bool> _held;
  std::vector<CellRows> _cells;
  std::vector<Eigen::Matrix<double, 8, 8, Eigen::RowMajor>> _K; ///< per body
  std::vector<std::size_t> _body;                               ///< per cell
};
