// Sums over the ranks that share multiplier nodes.
#pragma once

#include "raymortar/core/types.h"
#include <mpi.h>
#include <petscsf.h>
#include <span>
#include <vector>

namespace raymortar
{
/// @brief Adds values of nodes that several ranks have: each gets the same sum.
class NodeExchange
{
public:
  /// @brief Collective.
  /// @param[in] rows First row of each local node; -1: it has none
  /// @param[in] owned Local nodes whose rows are on this rank, by row
  /// @param[in] components Rows of a node
  NodeExchange(MPI_Comm comm, std::span<const GlobalIndex> rows,
               std::span<const Index> owned, int components);
  ~NodeExchange();
  NodeExchange(NodeExchange&& other) noexcept;
  NodeExchange(const NodeExchange&) = delete;
  NodeExchange& operator=(const NodeExchange&) = delete;
  NodeExchange& operator=(NodeExchange&&) = delete;

  /// @brief Sum over ranks, in place. Collective.
  /// @param[in,out] values (local nodes, width); those without a row stay
  void sum(std::span<double> values, int width);

private:
  std::size_t _owned;
  bool _is_alone; ///< on one rank, which has each node once
  PetscSF _sf = nullptr;
  std::vector<double> _sums; ///< of the owned nodes
};
} // namespace raymortar
