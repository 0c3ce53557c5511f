// Slave facets with a node that is held: their multiplier is damped.
#pragma once

#include "raymortar/element/assembler.h"
#include "raymortar/element/facet_block.h"

namespace raymortar
{
/// @brief The damped facets of a zone, as far as they are known
/// [theory (5.5)].
struct HeldFacets
{
  std::vector<FacetBlock> facets;
  /// Blocks of the same facets that stay where friction keeps what nothing
  /// feels [theory (5.23)]
  std::vector<FacetBlock> rest;
  /// Facets that have no held node or have met a master, (facets,)
  std::vector<std::int8_t> known;
  /// Nonzero where neither the facet nor what it faces is free to move in a
  /// component, (facets, gdim)
  std::vector<std::int8_t> unfelt;
  /// Nonzero for nodes that are held along the facet's normal, as is some of
  /// what they face, (facets, dofs per facet)  [theory (4.56)]
  std::vector<std::int8_t> nodes;
};

/// @brief Slave facets that are damped where what lies opposite is held too, or
/// do not feel some component then: some of their nodes are held, ascending.
///
/// None without a multiplier.
/// @param[in] fixed_slave Nonzero where a component is held, (dofs, gdim)
[[nodiscard]] std::vector<Index>
facets_with_held_nodes(const ContactState& s,
                       std::span<const double> fixed_slave);

/// @brief Facets whose multiplier has more unknowns than displacements to
/// balance them: some nodes are held, and so is what lies opposite.
/// @param[in] s Points and hits tell what lies opposite
/// @param[in] fixed_slave Nonzero where a component is held, (dofs, gdim)
/// @param[in] fixed_master Same for the dofs of s.master
/// @param[in] modulus Of the softer body. Stress
/// @param[in,out] held Facets that have met a master before stay as they are
void find_held_facets(const ContactState& s,
                      std::span<const double> fixed_slave,
                      std::span<const double> fixed_master, double modulus,
                      HeldFacets& held);

/// @brief Facets at cross points, where their nodes take part in other ties or
/// contacts too: what all of these ask of a node is more than it can give.
/// All components are damped in full.
/// @param[in] s Paired: its points tell how large facets are
/// @param[in] crossing Nonzero at cross points, (dofs,)
[[nodiscard]] std::vector<FacetBlock>
find_crossing_facets(const ContactState& s,
                     std::span<const std::int8_t> crossing, double modulus);
} // namespace raymortar
