// Values of Functions, multipliers and free bodies among the coupled unknowns.
#pragma once

#include "raymortar/fem/petsc.h"
#include "raymortar/target/moved_body.h"
#include <mpi.h>
#include <petscvec.h>
#include <span>
#include <vector>

namespace raymortar
{
/// @brief A Function that is solved for: its local values, ghosts last.
struct FunctionValues
{
  std::span<double> local;
  std::size_t owned = 0; ///< number of owned values
};

/// @brief The multiplier of a contact, (nodes, components).
struct MultiplierValues
{
  std::span<double> local;
  std::vector<Index> owned;      ///< nodes whose rows are here, by row
  std::vector<GlobalIndex> rows; ///< first row of each local node; -1: none
  int components = 1;
};

/// @brief A free body and its rows, which the first rank owns.
struct BodyValues
{
  MovedBody* body = nullptr;
  std::vector<GlobalIndex> rows;
};

/// @brief Moves values between Functions and the vector of coupled unknowns:
/// [Functions | multipliers | free bodies], rank by rank.
///
/// A multiplier is divided by its scale among the unknowns.
class CoupledValues
{
public:
  /// @param[in] rows Global row of every local value of the functions
  CoupledValues(MPI_Comm comm, std::vector<FunctionValues> functions,
                std::span<const GlobalIndex> rows,
                std::vector<MultiplierValues> multipliers,
                std::vector<BodyValues> bodies);
  ~CoupledValues();
  CoupledValues(const CoupledValues&) = delete;
  CoupledValues& operator=(const CoupledValues&) = delete;

  /// @brief Copy values to the unknowns.
  void to_vector(PetscVector x, std::span<const double> scales) const;

  /// @brief Copy the unknowns to all values, ghosts included. Collective.
  void from_vector(PetscVector x, std::span<const double> scales);

  /// @brief Whether Functions and bodies of this rank have the values of an
  /// array over its rows.
  [[nodiscard]] bool match(std::span<const double> x) const;

  [[nodiscard]] const std::vector<MultiplierValues>& multipliers() const
  {
    return _multipliers;
  }
  [[nodiscard]] const std::vector<BodyValues>& bodies() const
  {
    return _bodies;
  }
  [[nodiscard]] MPI_Comm comm() const { return _comm; }

private:
  void make_scatter(PetscVector x);

  MPI_Comm _comm;
  std::vector<FunctionValues> _functions;
  std::vector<MultiplierValues> _multipliers;
  std::vector<BodyValues> _bodies;
  std::vector<PetscInt> _rows; ///< of all local values
  VecScatter _scatter = nullptr;
  PetscVector _local = nullptr; ///< the unknowns of these rows
};

/// @brief Values of this rank of a vector that are only read.
class ReadArray
{
public:
  explicit ReadArray(PetscVector x);
  ~ReadArray() { VecRestoreArrayRead(_vector, &_array); }
  ReadArray(const ReadArray&) = delete;
  ReadArray& operator=(const ReadArray&) = delete;

  [[nodiscard]] std::span<const double> values() const
  {
    return {_array, _size};
  }

private:
  PetscVector _vector;
  const PetscScalar* _array = nullptr;
  std::size_t _size = 0;
};
} // namespace raymortar
