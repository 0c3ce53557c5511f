// Blocks with all of their rows and columns into a matrix.
#pragma once

#include "raymortar/fem/petsc.h"
#include "raymortar/fem/zone.h"

namespace raymortar
{
/// @brief Adds blocks to a matrix, prescribed rows and columns too. Their
/// places are not kept; assembly is the caller's.
class WholeBlocks final : public MatrixSink
{
public:
  WholeBlocks(const Zone& zone, PetscMatrix A) : _zone(zone), _matrix(A) {}

  [[nodiscard]] bool wants(const Unknowns&) const override { return true; }
  void add(const Unknowns& rows, const Unknowns& columns,
           const double* block) override;

private:
  const Zone& _zone;
  PetscMatrix _matrix;
  std::vector<PetscInt> _rows, _columns;
};

/// @brief The same of blocks of a vector.
class WholeVector final : public VectorSink
{
public:
  WholeVector(const Zone& zone, PetscVector b) : _zone(zone), _vector(b) {}

  void add(const Unknowns& rows, std::span<const double> values) override;

private:
  const Zone& _zone;
  PetscVector _vector;
  std::vector<PetscInt> _rows;
};
} // namespace raymortar
