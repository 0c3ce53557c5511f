#include "raymortar/mortar/penetrating_points.h"
#include "raymortar/geometry/dispatch.h"
#include "raymortar/mortar/ray_caster.h"
#include "raymortar/target/in_space.h"

namespace raymortar
{
std::vector<Index>
find_penetrating_points(const Surface& slave, const Surface& master,
                        const IntegrationPoints& points, const Hits& hits,
                        const FacetDistances& range, const PairFilter* filter)
{
  const FacetDistances unlimited(0.0, std::numeric_limits<double>::infinity());
  std::vector<Index> penetrating;
  const auto find = [&]<class M>(M)
  {
    RayCaster<M> caster(slave, master, unlimited, filter);
    for (std::size_t q = 0; q < points.size(); ++q)
    {
      if (hits.status[q] != RayStatus::too_deep)
        continue;
      const FacetHit<M> found =
          caster.cast(points.slave[q], points.xi[q], points.seed[q]);
      if (not found.is_hit() or (filter and slave.body_of(points.slave[q]) ==
                                                master.body_of(found.facet)))
        continue;
      const double below = -found.hit.g * found.facing;
      const double behind = master.thickness_behind(found.facet);
      const double depth = certain_depth(range, slave, points.slave[q], behind);
      if (below > depth and below <= behind and std::isfinite(behind))
        penetrating.push_back(static_cast<Index>(q));
    }
  };
  with_geometry(master, find);
  return penetrating;
}

namespace
{
/// Rays of one slave facet's points on tools where they are
class ToolProbe
{
public:
  /// @param[in] body Solid within the slave's surface, null: not known
  ToolProbe(std::span<const PlacedTool> tools, const Tool* body)
      : _tools(tools), _body(body)
  {
  }

  [[nodiscard]] bool is_inside(const Vec<3>& x) const
  {
    return std::any_of(_tools.begin(), _tools.end(),
                       [&](const PlacedTool& one)
                       { return one.tool->distance(one.now.origin(x)) < 0.0; });
  }

  /// Whether a ray into the slave's body enters a tool there, within a length
  [[nodiscard]] bool meets(const ToolRay& ray, double length) const
  {
    return std::any_of(_tools.begin(), _tools.end(),
                       [&](const PlacedTool& one)
                       {
                         const ToolHit hit =
                             hit_on(*one.tool, ray_from(one, ray));
                         return hit.found and hit.g >= 0.0 and
                                hit.g <= length and is_in_body(ray, hit.g);
                       });
  }

private:
  static ToolHit hit_on(const Tool& tool, const ToolRay& ray)
  {
    ToolHit hit;
    tool.cast({&ray, 1}, {&hit, 1});
    return hit;
  }

  /// Whether a place on a ray into the body is nearer to the ray's origin than
  /// to the body's back. A tool that is nearer to the back, or beyond it,
  /// touches the back
  [[nodiscard]] bool is_in_body(const ToolRay& ray, double g) const
  {
    if (_body == nullptr)
      return true;
    const ToolHit back = hit_on(*_body, {ray.x + g * ray.n, -ray.n});
    return not back.found or -back.g >= g;
  }

  std::span<const PlacedTool> _tools;
  const Tool* _body;
};

template <class F>
ToolRay ray_into_body(const Surface& slave, Index facet, const Vec<2>& xi)
{
  const auto frame =
      frame_at<F>(slave.nodes<F>(slave.x, facet), xi.template head<F::tdim>());
  return {in_space<F::gdim>(frame.x), -in_space<F::gdim>(frame.n)};
}

/// Depth of the body behind a facet that counts: half of its thickness, if
/// known
double half_behind(const Surface& slave, const FacetDistances& range,
                   Index facet)
{
  const double thickness = slave.thickness_behind(facet);
  return std::isfinite(thickness) ? 0.5 * thickness : range[facet].depth;
}

/// Points [begin, end) of one slave facet that a tool has passed: those behind
/// which one begins, and all that are inside one where none is outside
template <class F>
void append_penetrating(const Surface& slave, const ToolProbe& probe,
                        const IntegrationPoints& points, const Hits& hits,
                        const FacetDistances& range, std::size_t begin,
                        std::size_t end, std::vector<Index>& penetrating)
{
  const Index facet = points.slave[begin];
  const double behind = half_behind(slave, range, facet);
  std::vector<Index> inside;
  for (std::size_t q = begin; q < end; ++q)
  {
    if (hits.status[q] == RayStatus::hit)
      continue;
    const ToolRay ray = ray_into_body<F>(slave, facet, points.xi[q]);
    if (probe.is_inside(ray.x))
      inside.push_back(static_cast<Index>(q));
    if (probe.meets(ray, behind))
      penetrating.push_back(static_cast<Index>(q));
  }
  if (inside.size() == end - begin)
    penetrating.insert(penetrating.end(), inside.begin(), inside.end());
}
} // namespace

std::vector<Index> find_points_inside_tools(const Surface& slave,
                                            std::span<const PlacedTool> tools,
                                            const IntegrationPoints& points,
                                            const Hits& hits,
                                            const FacetDistances& range,
                                            const Tool* body)
{
  const ToolProbe probe(tools, body);
  std::vector<Index> penetrating;
  const auto find = [&]<class F>(F)
  {
    for (std::size_t begin = 0, end = 0; begin < points.size(); begin = end)
    {
      while (end < points.size() and points.slave[end] == points.slave[begin])
        ++end;
      append_penetrating<F>(slave, probe, points, hits, range, begin, end,
                            penetrating);
    }
  };
  with_geometry(slave, find);
  return penetrating;
}
} // namespace raymortar
