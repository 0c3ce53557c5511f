// Tools whose surface is made of facets that belong to no mesh.
#pragma once

#include "raymortar/geometry/aabb_tree.h"
#include "raymortar/geometry/reference.h"
#include "raymortar/target/tool.h"

namespace raymortar
{
/// @brief Facets as arrays. Their normals point out of the tool.
struct ToolFacets
{
  Shape shape = Shape::triangle;
  int degree = 1;           ///< of the positions: 1 or 2
  std::vector<double> x;    ///< positions, (points, gdim). Length
  std::vector<Index> nodes; ///< (facets, nodes per facet), as Lagrange has them

  /// Nodes of a facet as columns
  template <class F>
  [[nodiscard]] typename F::NodeMatrix nodes_of(Index facet) const
  {
    typename F::NodeMatrix m;
    for (int a = 0; a < F::nodes; ++a)
    {
      const auto node = static_cast<std::size_t>(
          nodes[static_cast<std::size_t>(facet) * F::nodes +
                static_cast<std::size_t>(a)]);
      m.col(a) = Eigen::Map<const Vec<F::gdim>>(x.data() + F::gdim * node);
    }
    return m;
  }
};

/// @brief A tool as those see it who cut slave facets at its rim. Boxes are in
/// the coordinates it was made in; in 2D their third components do not count.
class FacetedTool : public Tool
{
public:
  [[nodiscard]] virtual const ToolFacets& facets() const = 0;

  /// @brief See rim_segments.cpp.
  [[nodiscard]] const ToolCutter* cutter() const override;

  /// @brief Whether it has edges across which what rays meet may jump: see
  /// rim_boxes.
  [[nodiscard]] virtual bool has_rim() const = 0;
  [[nodiscard]] virtual bool has_rim_in(const Box<3>& box) const = 0;

  /// @brief Append the facets near a box.
  virtual void find_facets(const Box<3>& box,
                           std::vector<Index>& near) const = 0;
};

/// @brief Tool with a surface of facets, closed or open.
///
/// The last crossing of a ray tells whether a point is inside. So an open
/// surface is a solid that continues behind its facets.
/// @complexity A ray costs O(log facets) where few lie along it
/// @throws Error for facets of other degrees
[[nodiscard]] std::shared_ptr<const Tool> make_facet_tool(ToolFacets facets);
} // namespace raymortar
