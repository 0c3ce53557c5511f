// Where two layers of master lie over one slave point, the nearer one wins.
#pragma once

#include "raymortar/mortar/overlap.h"
#include <cmath>
#include <vector>

namespace raymortar
{
/// @brief Overlap of a slave patch with one master patch, before mapping.
template <int D>
struct Piece
{
  Region<D> region;
  Index master;
  std::int8_t master_patch;
  ProjectedPatch<D> seen;
};

/// @brief Cut overlapping pieces so that every place keeps its nearest master.
///
/// Neighbouring masters share an edge, which rules them out at once. The nearer
/// master is decided at the middle of each overlap,
/// by |height| among the heights within [-depth, reach].
/// @param[in,out] pieces Pieces of one slave patch
/// @param[in] whole Measure of the slave patch in plane coordinates
template <int D>
void keep_nearest(std::vector<Piece<D>>& pieces, double whole, double reach,
                  double depth);
} // namespace raymortar
