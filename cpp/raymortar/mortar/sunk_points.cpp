#include "raymortar/mortar/sunk_points.h"
#include "raymortar/geometry/dispatch.h"
#include "raymortar/mortar/ray_caster.h"
#include "raymortar/rigid/in_space.h"

namespace raymortar
{
std::vector<Index> find_sunk_points(const Surface& slave, const Surface& master,
                                    const IntegrationPoints& points,
                                    const Hits& hits,
                                    const FacetDistances& range)
{
  const FacetDistances unlimited(0.0, std::numeric_limits<double>::infinity());
  std::vector<Index> sunk;
  const auto find = [&]<class S, class M>(S, M)
  {
    RayCaster<S, M> caster(slave, master, unlimited);
    for (std::size_t q = 0; q < points.size(); ++q)
    {
      if (hits.status[q] != RayStatus::too_deep)
        continue;
      const Landing<M> landing =
          caster.cast(points.slave[q], points.xi[q], points.seed[q]);
      if (not landing.is_hit())
        continue;
      const double below = -landing.hit.g * landing.facing;
      const double behind = master.thickness_behind(landing.facet);
      const double depth = certain_depth(range, slave, points.slave[q], behind);
      if (below > depth and below <= behind and std::isfinite(behind))
        sunk.push_back(static_cast<Index>(q));
    }
  };
  with_geometries(slave, master, find);
  return sunk;
}

namespace
{
/// Rays of one slave facet's points on tools where they are
class ToolProbe
{
public:
  ToolProbe(std::span<const PlacedTool> tools) : _tools(tools) {}

  [[nodiscard]] bool is_inside(const Vec<3>& x) const
  {
    return std::any_of(_tools.begin(), _tools.end(),
                       [&](const PlacedTool& one)
                       { return one.tool->distance(one.now.origin(x)) < 0.0; });
  }

  /// Whether a ray enters a tool within a length
  [[nodiscard]] bool meets(const ToolRay& ray, double length) const
  {
    return std::any_of(_tools.begin(), _tools.end(),
                       [&](const PlacedTool& one)
                       {
                         const ToolRay own = ray_from(one, ray);
                         ToolHit hit;
                         one.tool->cast({&own, 1}, {&hit, 1});
                         return hit.found and hit.g >= 0.0 and hit.g <= length;
                       });
  }

private:
  std::span<const PlacedTool> _tools;
};

template <class F>
ToolRay ray_into_body(const Surface& slave, Index facet, const Vec<2>& xi)
{
  const auto frame =
      frame_at<F>(slave.nodes<F>(slave.x, facet), xi.template head<F::tdim>());
  return {in_space<F::gdim>(frame.x), -in_space<F::gdim>(frame.n)};
}
} // namespace

std::vector<Index> find_points_sunk_in_tools(const Surface& slave,
                                             std::span<const PlacedTool> tools,
                                             const IntegrationPoints& points,
                                             const Hits& hits,
                                             const FacetDistances& range)
{
  const ToolProbe probe(tools);
  std::vector<Index> sunk, inside;
  // How much of the body counts where its thickness is not known
  const auto half_behind = [&](Index facet)
  {
    const double thickness = slave.thickness_behind(facet);
    return std::isfinite(thickness) ? 0.5 * thickness : range[facet].depth;
  };
  const auto find = [&]<class F>(F)
  {
    for (std::size_t begin = 0; begin < points.size();)
    {
      const Index facet = points.slave[begin];
      bool all_inside = true;
      inside.clear();
      std::size_t q = begin;
      for (; q < points.size() and points.slave[q] == facet; ++q)
      {
        if (hits.status[q] == RayStatus::hit)
        {
          all_inside = false;
          continue;
        }
        const ToolRay ray = ray_into_body<F>(slave, facet, points.xi[q]);
        if (probe.is_inside(ray.x))
          inside.push_back(static_cast<Index>(q));
        else
          all_inside = false;
        if (probe.meets(ray, half_behind(facet)))
          sunk.push_back(static_cast<Index>(q));
      }
      if (all_inside)
        sunk.insert(sunk.end(), inside.begin(), inside.end());
      begin = q;
    }
  };
  with_facet_type(slave, find);
  return sunk;
}
} // namespace raymortar
