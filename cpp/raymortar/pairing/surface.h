// A contact surface as plain arrays: what every stage reads.
#pragma once

#include "raymortar/geometry/reference.h"
#include <limits>
#include <span>
#include <vector>

namespace raymortar
{
/// @brief Type of the facets of a surface.
struct FacetKind
{
  Shape shape = Shape::interval;
  int degree = 1;      ///< of the displacement
  int node_degree = 1; ///< of the positions
  auto operator<=>(const FacetKind&) const = default;
};

/// @brief Facets of one side of a contact zone, as seen by one rank.
///
/// Nodes carry positions (degree `node_degree`), dofs carry displacements
/// (degree `degree` <= `node_degree`); where the degrees agree they are the
/// same. Facets are oriented with their normal out of the body.
struct Surface
{
  Shape shape = Shape::interval;
  int degree = 1;
  int node_degree = 1;
  int gdim = 2;

  std::vector<double> X;     ///< reference positions, (nodes, gdim)
  std::vector<double> x;     ///< deformed positions, (nodes, gdim)
  std::vector<double> x_old; ///< positions of the accepted step, (nodes, gdim)
  std::vector<Index> facet_nodes;    ///< (facets, nodes per facet)
  std::vector<Index> facet_dofs;     ///< (facets, dofs per facet)
  std::vector<Index> neighbours;     ///< (facets, edges), no_index at the rim
  std::vector<GlobalIndex> rows;     ///< of each component, (dofs, gdim)
  std::vector<GlobalIndex> facet_id; ///< global identification, (facets,)
  /// Thickness of the undeformed body behind each facet, (facets,). Infinite,
  /// or no array at all: not known. Length
  std::vector<double> thickness = {};
  /// Body of each facet, numbered alike on all ranks, (facets,). No array at
  /// all: all are of one
  std::vector<Index> body = {};

  [[nodiscard]] int nodes_per_facet() const;
  [[nodiscard]] int dofs_per_facet() const;
  [[nodiscard]] int corners() const;
  [[nodiscard]] FacetKind kind() const { return {shape, degree, node_degree}; }
  [[nodiscard]] Index num_facets() const
  {
    return static_cast<Index>(facet_id.size());
  }
  [[nodiscard]] Index num_dofs() const
  {
    return static_cast<Index>(rows.size() / static_cast<std::size_t>(gdim));
  }

  /// @brief Nodes of a facet as columns, from one of the position arrays.
  template <class F>
  [[nodiscard]] typename F::NodeMatrix
  nodes(const std::vector<double>& positions, Index facet) const
  {
    typename F::NodeMatrix m;
    for (int a = 0; a < F::nodes; ++a)
      m.col(a) = Eigen::Map<const Vec<F::gdim>>(
          positions.data() +
          F::gdim * facet_nodes[node_at(facet, a, F::nodes)]);
    return m;
  }

  [[nodiscard]] double thickness_behind(Index facet) const
  {
    return thickness.empty() ? std::numeric_limits<double>::infinity()
                             : thickness[static_cast<std::size_t>(facet)];
  }

  [[nodiscard]] Index body_of(Index facet) const
  {
    return body.empty() ? 0 : body[static_cast<std::size_t>(facet)];
  }

  /// @brief Local dofs of a facet, (dofs per facet,).
  template <class F>
  [[nodiscard]] std::span<const Index, F::dofs> dofs_of(Index facet) const
  {
    return std::span<const Index, F::dofs>(
        facet_dofs.data() + static_cast<std::size_t>(facet) * F::dofs, F::dofs);
  }

private:
  static std::size_t node_at(Index facet, int a, int n)
  {
    return static_cast<std::size_t>(facet) * static_cast<std::size_t>(n) +
           static_cast<std::size_t>(a);
  }
};

/// @brief Positions X + u at the nodes from displacement dofs.
/// @param[in] s Surface
/// @param[in] u Displacement, (dofs, gdim), length
/// @return positions, (nodes, gdim)
[[nodiscard]] std::vector<double> displaced(const Surface& s,
                                            std::span<const double> u);

/// @brief Facet neighbours across edges, from the corner nodes.
///
/// An edge shared by more than two facets is left without a neighbour: the
/// ray has no unique way on there.
/// @return (facets, edges) in the edge order of Reference
[[nodiscard]] std::vector<Index> find_neighbours(const Surface& s);

/// @brief Facet diameters of a position array, (facets,). Lengths.
[[nodiscard]] std::vector<double>
diameters(const Surface& s, const std::vector<double>& positions);

/// @brief Largest facet diameter of a position array; 0 for an empty surface.
[[nodiscard]] double largest_diameter(const Surface& s,
                                      const std::vector<double>& positions);
} // namespace raymortar
