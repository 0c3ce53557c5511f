// Slave facets with a node that is held: their multiplier is damped.
#pragma once

#include "raymortar/element/assembler.h"

namespace raymortar
{
/// @brief What smooths the multiplier of one slave facet [theory (5.5)].
struct HeldFacet
{
  Index slave;
  /// (unknowns, unknowns) row-major, the unknowns node after node:
  /// length^d / stress
  std::vector<double> block;
};

/// @brief Facets whose multiplier has more unknowns than displacements to
/// balance them: some nodes are held, and so is what lies opposite.
///
/// Facets that are held at every node are rigid slaves, balanced by their
/// master, and are not among them; nor are multipliers of a lower degree than
/// the displacement, which are stable without.
/// @param[in] s Points and hits tell what lies opposite; where nothing does, it
/// counts as held
/// @param[in] fixed_slave Nonzero where a component is held, (dofs, gdim)
/// @param[in] fixed_master Same for the dofs of s.master
/// @param[in] modulus Of the softer body. Stress
[[nodiscard]] std::vector<HeldFacet>
find_held_facets(const ContactState& s, LawKind law,
                 std::span<const double> fixed_slave,
                 std::span<const double> fixed_master, double modulus);
} // namespace raymortar
