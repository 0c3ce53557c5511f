// Linear patches of a facet: what is projected and clipped.
#pragma once

#include "raymortar/geometry/reference.h"
#include <span>

namespace raymortar
{
/// @brief Corner nodes of one linear patch, counter-clockwise.
struct Patch
{
  int size;                ///< corners: 2, 3 or 4
  std::array<int, 4> node; ///< node numbers of the facet
};

/// @brief The linear patches that tile a facet.
///
/// A facet is one patch through its corners; a quadratic one may be split at
/// its mid nodes, which follows its curvature more closely.
template <class F>
[[nodiscard]] std::span<const Patch> patches(bool subdivide)
{
  if constexpr (F::shape == Shape::interval)
  {
    static constexpr std::array<Patch, 1> whole = {{{2, {0, 1, -1, -1}}}};
    static constexpr std::array<Patch, 2> split = {
        {{2, {0, 2, -1, -1}}, {2, {2, 1, -1, -1}}}};
    if (F::node_degree == 2 and subdivide)
      return split;
    return whole;
  }
  else if constexpr (F::shape == Shape::triangle)
  {
    static constexpr std::array<Patch, 1> whole = {{{3, {0, 1, 2, -1}}}};
    static constexpr std::array<Patch, 4> split = {{{3, {0, 5, 4, -1}},
                                                    {3, {5, 1, 3, -1}},
                                                    {3, {4, 3, 2, -1}},
                                                    {3, {3, 4, 5, -1}}}};
    if (F::node_degree == 2 and subdivide)
      return split;
    return whole;
  }
  else
  {
    static constexpr std::array<Patch, 1> whole = {{{4, {0, 1, 3, 2}}}};
    static constexpr std::array<Patch, 4> split = {{{4, {0, 4, 8, 5}},
                                                    {4, {4, 1, 6, 8}},
                                                    {4, {8, 6, 3, 7}},
                                                    {4, {5, 8, 7, 2}}}};
    if (F::node_degree == 2 and subdivide)
      return split;
    return whole;
  }
}

/// @brief Corner positions of a patch, (patch.size, gdim).
template <class F>
[[nodiscard]] std::array<typename F::Point, 4>
patch_corners(const typename F::NodeMatrix& nodes, const Patch& patch)
{
  std::array<typename F::Point, 4> corners;
  for (int i = 0; i < patch.size; ++i)
    corners[i] = nodes.col(patch.node[i]);
  return corners;
}

/// @brief Reference coordinates of a patch's corners on its facet.
template <class F>
[[nodiscard]] std::array<typename F::RefPoint, 4>
patch_reference(const Patch& patch)
{
  std::array<typename F::RefPoint, 4> xi;
  for (int i = 0; i < patch.size; ++i)
    xi[i] = typename F::RefPoint(F::Node::points[patch.node[i]].data());
  return xi;
}
} // namespace raymortar
