#include "raymortar/rigid/facet_tool.h"
#include "raymortar/core/error.h"
#include "raymortar/geometry/aabb_tree.h"
#include "raymortar/geometry/curvature.h"
#include "raymortar/geometry/dispatch.h"
#include "raymortar/geometry/middle.h"
#include "raymortar/geometry/ray.h"
#include "raymortar/rigid/rims.h"

namespace raymortar
{
namespace
{
/// A facet that bends leaves the box around its nodes by no more than this
/// share of the box
constexpr double bulge = 0.5;

/// So that no ray passes between two boxes that touch
constexpr double box_margin = 1e-9;

template <class F>
class FacetTool final : public FacetedTool
{
public:
  static constexpr int D = F::gdim;

  explicit FacetTool(ToolFacets facets) : _facets(std::move(facets))
  {
    std::vector<Box<D>> boxes;
    boxes.reserve(count());
    for (std::size_t f = 0; f < count(); ++f)
    {
      const auto nodes = nodes_of(static_cast<Index>(f));
      const Box<D> box{nodes.rowwise().minCoeff(), nodes.rowwise().maxCoeff()};
      const double size = (box.upper - box.lower).maxCoeff();
      boxes.push_back(
          box.inflated((F::node_degree == 1 ? box_margin : bulge) * size));
    }
    _tree = AabbTree<D>(boxes);
    _rim = AabbTree<D>(rim_boxes<D>(_facets));
    _open_towards = open_direction();
  }

  [[nodiscard]] const ToolFacets& facets() const override { return _facets; }
  [[nodiscard]] bool has_rim() const override { return _rim.size() > 0; }

  [[nodiscard]] bool has_rim_in(const Box<3>& box) const override
  {
    std::vector<Index> near;
    _rim.query(in_own_space(box), near);
    return not near.empty();
  }

  void find_facets(const Box<3>& box, std::vector<Index>& near) const override
  {
    _tree.query(in_own_space(box), near);
  }

  void cast(std::span<const ToolRay> rays,
            std::span<ToolHit> hits) const override
  {
    std::vector<Index> near;
    for (std::size_t k = 0; k < rays.size(); ++k)
      hits[k] = hit_of(rays[k], near);
  }

  /// That along a line to a facet in the middle of all, whose sign is right. Of
  /// an open surface along its mean normal, infinite where that misses it: what
  /// is beside the surface is not behind it
  [[nodiscard]] double distance(const Vec<3>& x) const override
  {
    const Vec<D> at = x.head<D>();
    const Vec<D> middle =
        nodes_of(static_cast<Index>(count() / 2)).rowwise().mean();
    const bool is_open = not _open_towards.isZero(0.0);
    const double length = (middle - at).norm();
    if (length == 0.0)
      return 0.0;
    std::vector<Index> near;
    const Vec<D> n = is_open ? _open_towards : Vec<D>((middle - at) / length);
    const auto [behind, ahead] = crossings(at, n, near);
    if (ahead.facet == no_index)
      return is_open ? std::abs(behind.g) : length;
    return ahead.facing > 0.0 ? ahead.g : -ahead.g;
  }

private:
  struct Crossing
  {
    double g = std::numeric_limits<double>::infinity();
    Index facet = no_index;
    typename F::RefPoint eta = F::RefPoint::Zero();
    double facing = 0.0; ///< positive where the line enters
  };

  /// The nearest crossing of a line on both sides of its origin
  struct Sides
  {
    Crossing behind, ahead;
  };

  [[nodiscard]] std::size_t count() const
  {
    return _facets.nodes.size() / F::nodes;
  }

  [[nodiscard]] typename F::NodeMatrix nodes_of(Index facet) const
  {
    return _facets.template nodes_of<F>(facet);
  }

  [[nodiscard]] static Box<D> in_own_space(const Box<3>& box)
  {
    return {box.lower.template head<D>(), box.upper.template head<D>()};
  }

  [[nodiscard]] Sides crossings(const Vec<D>& x, const Vec<D>& n,
                                std::vector<Index>& near) const
  {
    near.clear();
    _tree.query_line(x, n, near);
    Sides sides;
    for (const Index facet : near)
    {
      const auto nodes = nodes_of(facet);
      const RayHit<F> hit = inside(x, n, nodes);
      if (hit.status != RayStatus::hit)
        continue;
      Crossing& side = hit.g < 0.0 ? sides.behind : sides.ahead;
      if (std::abs(hit.g) < std::abs(side.g))
        side = {hit.g, facet, hit.eta, -n.dot(frame_at<F>(nodes, hit.eta).n)};
    }
    return sides;
  }

  /// Mean normal of an open surface, unit; zero if it is closed: the normals of
  /// flat facets through the corners of a closed one cancel
  [[nodiscard]] Vec<D> open_direction() const
  {
    using Flat = FacetType<F::shape, 1, 1>;
    constexpr double cancels = 1e-6;
    const typename F::RefPoint middle = middle_of_reference<F>();
    Vec<D> sum = Vec<D>::Zero();
    double size = 0.0;
    for (std::size_t f = 0; f < count(); ++f)
    {
      const auto nodes = nodes_of(static_cast<Index>(f));
      const Vec<D> area = normal_of(
          frame_at<Flat>(nodes.template leftCols<Flat::nodes>(), middle).t);
      sum += area;
      size += area.norm();
    }
    if (not(sum.norm() > cancels * size))
      return Vec<D>::Zero();
    return sum.normalized();
  }

  /// Hit of a line between the edges of a facet. On a bent one Newton's method
  /// may need another start
  [[nodiscard]] static RayHit<F> inside(const Vec<D>& x, const Vec<D>& n,
                                        const typename F::NodeMatrix& nodes)
  {
    const auto is_inside = [](const RayHit<F>& hit)
    {
      return hit.status == RayStatus::hit and
             hit.outside.amount <= tolerance::ray_outside;
    };
    RayHit<F> hit = intersect<F>(x, n, nodes, flat_guess<F>(x, n, nodes));
    if (is_inside(hit))
      return hit;
    if constexpr (not F::affine)
      for (const auto& point : F::Node::points)
      {
        hit = intersect<F>(x, n, nodes, typename F::RefPoint(point.data()));
        if (is_inside(hit))
          return hit;
      }
    hit.status = RayStatus::no_facet;
    return hit;
  }

  [[nodiscard]] ToolHit hit_of(const ToolRay& ray,
                               std::vector<Index>& near) const
  {
    const Sides sides = crossings(ray.x.head<D>(), ray.n.head<D>(), near);
    const Crossing& side =
        sides.behind.facing > 0.0 ? sides.behind : sides.ahead;
    if (not(side.facing > 0.0))
      return {};
    const auto nodes = nodes_of(side.facet);
    const Frame<D> frame = frame_at<F>(nodes, side.eta);
    const auto dual = dual_tangents<D>(frame);
    ToolHit hit;
    hit.found = frame.n.allFinite();
    hit.g = side.g;
    hit.normal.template head<D>() = frame.n;
    hit.bend.template topLeftCorner<D, D>() =
        curvature_at<F>(nodes, side.eta, frame, dual).n * dual.transpose();
    return hit;
  }

  ToolFacets _facets;
  Vec<D> _open_towards; ///< see open_direction
  AabbTree<D> _tree;
  AabbTree<D> _rim;
};
} // namespace

std::shared_ptr<const Tool> make_facet_tool(ToolFacets facets)
{
  if (facets.degree != 1 and facets.degree != 2)
    throw Error("facets of a rigid surface have degree 1 or 2");
  struct Kind
  {
    Shape shape;
    int node_degree;
  };
  return with_geometry(
      Kind{facets.shape, facets.degree},
      [&]<class F>(F) -> std::shared_ptr<const Tool>
      { return std::make_shared<FacetTool<F>>(std::move(facets)); });
}
} // namespace raymortar
