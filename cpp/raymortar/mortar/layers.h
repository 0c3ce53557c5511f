// Layers: of two layers of master over one slave point, the nearer one wins.
#pragma once

#include "raymortar/mortar/overlap.h"
#include <cmath>
#include <functional>
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

/// @brief A master that has kept a place, and one that lay over it as well.
struct Rivalry
{
  Index winner;
  Index loser;
  auto operator<=>(const Rivalry&) const = default;
};

/// Order of two masters along the true ray from a point of the slave patch:
/// negative, keep the first; positive, keep the second; zero, neither
template <int D>
using LayerOrder =
    std::function<int(Index first, Index second, const Vec<D - 1>& at)>;

/// @brief Cut overlapping pieces so that every place keeps one master.
///
/// Neighbouring masters share an edge, which rules them out at once. Which
/// master is kept is decided at the middle of each overlap: by the order, and
/// where it has no opinion by |height| among the heights within
/// [-depth, reach].
/// @param[in,out] pieces Pieces of one slave patch
/// @param[in] whole Measure of the slave patch in plane coordinates
/// @return Who has lost places to whom, for points to try both; sorted
template <int D>
std::vector<Rivalry> keep_nearest(std::vector<Piece<D>>& pieces, double whole,
                                  double reach, double depth,
                                  const LayerOrder<D>& order = {});
} // namespace raymortar
