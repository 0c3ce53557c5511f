// A cube as a tool of facets.
#pragma once

#include "raymortar/rigid/facet_tool.h"

namespace raymortar
{
/// The unit cube of twelve triangles
inline ToolFacets cube()
{
  ToolFacets f{Shape::triangle, 1, {}, {}};
  for (int k = 0; k < 8; ++k)
    for (int i = 0; i < 3; ++i)
      f.x.push_back(k >> i & 1);
  f.nodes = {0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4,
             2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5};
  return f;
}
} // namespace raymortar
