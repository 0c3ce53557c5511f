// Tools whose surface is made of facets that belong to no mesh.
#pragma once

#include "raymortar/geometry/reference.h"
#include "raymortar/rigid/tool.h"

namespace raymortar
{
/// @brief Facets as arrays. Their normals point out of the tool.
struct ToolFacets
{
  Shape shape = Shape::triangle;
  int degree = 1;           ///< of the positions: 1 or 2
  std::vector<double> x;    ///< positions, (points, gdim). Length
  std::vector<Index> nodes; ///< (facets, nodes per facet), as Lagrange has them
};

/// @brief Tool with a surface of facets, closed or open.
///
/// What a ray has come through last is what tells whether a point is inside, as
/// of other tools. So an open surface is a solid that goes on behind its
/// facets.
/// @complexity A ray costs O(log facets) where few lie along it
/// @throws Error for facets of other degrees
[[nodiscard]] std::shared_ptr<const Tool> make_facet_tool(ToolFacets facets);
} // namespace raymortar
