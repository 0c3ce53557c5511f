// Vectors of 2D and 3D problems as tools take them.
#pragma once

#include "raymortar/target/tool.h"

namespace raymortar
{
/// @brief A vector whose third component is 0 in 2D.
template <int D>
[[nodiscard]] Vec<3> in_space(const Vec<D>& v)
{
  Vec<3> in = Vec<3>::Zero();
  in.template head<D>() = v;
  return in;
}

/// @brief A ray in the coordinates that a tool was made in.
[[nodiscard]] inline ToolRay ray_from(const PlacedTool& placed,
                                      const ToolRay& ray)
{
  return {placed.now.origin(ray.x), placed.now.rotation.transpose() * ray.n};
}
} // namespace raymortar
