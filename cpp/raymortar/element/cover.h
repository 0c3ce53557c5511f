// Equation (4) on slave facets that no master covers throughout.
#pragma once

#include "raymortar/element/assembler.h"
#include "raymortar/element/facet_block.h"

namespace raymortar
{
/// @brief How much of a slave facet is covered.
enum class Coverage
{
  nowhere,
  partly,
  throughout
};
[[nodiscard]] Coverage coverage_of(const ContactState& s, Index facet);

/// @brief What the multiplier's equation needs to know beyond the state.
struct CoverData
{
  /// Nonzero where a multiplier node has a facet that is covered, if only in
  /// part, on any rank, (nodes,)
  std::vector<std::int8_t> nodes;
  /// Nonzero where other zones have the node as well, and other normals,
  /// (nodes,)
  std::vector<std::int8_t> corners;
  /// Shear modulus of the softer body; 0: not known. Stress
  double shear_modulus = 0.0;
};

/// @brief Side of the rim where nodes of a partly covered facet are. It chooses
/// the weight of their tie: (5.10) beyond the rim, (4.34) within.
enum class RimSide
{
  beyond,
  within
};

/// @brief Those nodes, as far as this rank's facets tell.
[[nodiscard]] std::vector<std::int8_t> covered_nodes(const ContactState& s);

/// @brief What drives multipliers to zero where nothing is covered, and ties
/// those of partly covered facets to their mean [theory (5.9), (5.10)].
[[nodiscard]] std::vector<FacetBlock>
cover_blocks(const ContactState& s, const CoverData& cover,
             RimSide side = RimSide::beyond);

/// @brief What the vertices of one segment that move with one target change in
/// its facet's block.
struct ShareSlope
{
  Index slave;
  Index target;               ///< see SegmentTarget::number
  std::vector<double> change; ///< - d(B lam)/ds, (unknowns,). Length^(d-1)
  std::vector<double>
      share; ///< ds over the unknowns [slave | target], 1/length
};

/// @brief Of all segments of partly covered facets [theory (5.11)].
[[nodiscard]] std::vector<ShareSlope>
share_slopes(const ContactState& s, const CoverData& cover,
             RimSide side = RimSide::beyond);
} // namespace raymortar
