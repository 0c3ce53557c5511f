// Dual functions of a multiplier: on each slave facet those whose products with
// the nodes' test functions are diagonal on what is covered.
#pragma once

#include "raymortar/element/slave_side.h"
#include "raymortar/nodes/node_functions.h"
#include "raymortar/nodes/node_sums.h"

namespace raymortar
{
/// @brief What does not depend on the facet: test functions, and products over
/// a facet of area 1.
struct DualBasis
{
  /// Test functions from shape functions, B = Q^T N; coefficients of B to
  /// values at nodes, Q
  NodeMatrix to_nodes;
  /// Rows of the displacement's nodes that stand for B, (nodes of the
  /// displacement, multipliers): test functions of the displacement combine to
  /// B, and these rows combine to one each
  Eigen::MatrixXd rows;
  /// diag(int B) - int B B^T
  NodeMatrix spread;

  explicit DualBasis(const ContactState& s);
};

/// @brief Dual functions of one facet  [theory (4.27), (4.28)].
struct DualFacet
{
  bool is_covered = false;
  /// Whether the functions change with what is covered or with the area
  bool varies = false;
  double area = 0.0;      ///< covered, in the measure of integration
  double share = 0.0;     ///< covered, of the reference coordinates
  NodeMatrix inverse;     ///< of m
  Eigen::VectorXd weight; ///< d, integrals of the test functions

  /// @brief (1 - s)^2, by which `spread` times the area is in m.
  [[nodiscard]] double slack() const { return (1.0 - share) * (1.0 - share); }

  /// @brief Coefficients of test functions from nodal tractions, m^-1 diag(d).
  [[nodiscard]] NodeMatrix from_nodal() const
  {
    return inverse * weight.asDiagonal();
  }
};

/// @brief Of all slave facets, for the present hits.
[[nodiscard]] std::vector<DualFacet> dual_facets(const ContactState& s,
                                                 const DualBasis& basis);

/// @brief Project gaps and slips  [theory (4.38)].
/// @param[in] tested Their integrals with the test functions B
/// @param[in] held Nonzero for nodes that take B, (facets, dofs per facet);
/// empty: none  [theory (4.56)]
[[nodiscard]] std::vector<GapTests>
dual_gap_tests(const ContactState& s, const DualBasis& basis,
               const std::vector<DualFacet>& facets,
               const FacetIntegrals& tested, std::span<const std::int8_t> held);

/// @brief Add what the dual functions test of these to the sums of nodes.
void add_tested_gaps(const ContactState& s, const std::vector<GapTests>& tests,
                     NodeSums& sums);

/// @brief Change of a facet's slack times its area per covered reference
/// coordinates, for fixed area.
[[nodiscard]] double slack_by_share(const ContactState& s, const DualFacet& f);

/// @brief Tractions of the dual functions at the nodes of each facet.
[[nodiscard]] FacetTractions
dual_tractions(const ContactState& s, const DualBasis& basis,
               const std::vector<DualFacet>& facets);

/// @brief Coefficients of test functions of that traction on one facet, (nodes,
/// components).
[[nodiscard]] Eigen::MatrixXd
dual_coefficients(const ContactState& s, const DualFacet& of, Index facet);

/// @brief How the products of one facet vary through the points of one element.
struct DualRate
{
  Index slave;
  Index target; ///< master facet, or free tool; no_index: neither
  /// Over the unknowns [slave | multiplier | target], or [slave | multiplier]
  /// where points stay on it: of each node and component what m times the
  /// coefficients' change is, then the change of
  /// - slack times area, for fixed share, plus that by the share
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> rows;
};

/// @brief Of all facets whose functions vary  [theory (4.29)].
/// @param[in] tractions Of `dual_tractions`
[[nodiscard]] std::vector<DualRate>
dual_rates(const ContactState& s, const DualBasis& basis,
           const std::vector<DualFacet>& facets,
           const FacetTractions& tractions);
} // namespace raymortar
