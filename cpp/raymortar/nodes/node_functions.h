// Functions of each facet that a law at nodes takes in place of the shape
// functions of its multiplier.
#pragma once

#include "raymortar/element/assembler.h"

namespace raymortar
{
/// Matrix over the multiplier nodes of one facet
using NodeMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic,
                                 Eigen::RowMajor, 4, 4>;

/// @brief Integrals of gap and slip with the test function of each node of a
/// facet, (facets, nodes, 1 + gdim).
using FacetIntegrals = std::vector<double>;

/// @brief Functions of one facet that test its gaps and slips, sums of the
/// nodes' test functions, and the projections that they make
/// [theory (4.38), (4.41)].
struct GapTests
{
  /// Gap and slip of each node, (1 + gdim, nodes)
  using Gaps = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 4, 4>;
  NodeMatrix from_nodal; ///< coefficients of test functions, for each node
  Gaps gaps;             ///< those of gap and slip; empty: nothing is covered
  Gaps tested;           ///< integrals of these with each node's function
  Gaps spread;           ///< of these, what each node has
  double slack = 0.0;    ///< share of the latter in a node's row
  double by_share = 0.0; ///< its change per covered reference coordinates
  /// Nodes that take their own test functions instead  [theory (4.56)]
  std::array<bool, 4> is_plain{};
};

/// @brief The functions of all facets.
struct NodeFunctions
{
  FacetTractions tractions;        ///< at the nodes of each facet
  std::vector<GapTests> gap_tests; ///< empty: points are not known yet
};
} // namespace raymortar
