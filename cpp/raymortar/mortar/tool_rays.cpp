#include "raymortar/mortar/tool_rays.h"
#include "raymortar/geometry/dispatch.h"
#include "raymortar/target/in_space.h"

namespace raymortar
{
namespace
{
template <class F>
std::vector<ToolRay> rays_of(const Surface& slave,
                             const IntegrationPoints& points)
{
  std::vector<ToolRay> rays;
  rays.reserve(points.size());
  typename F::NodeMatrix nodes;
  Index facet = no_index;
  for (std::size_t q = 0; q < points.size(); ++q)
  {
    if (points.slave[q] != facet)
    {
      facet = points.slave[q];
      nodes = slave.nodes<F>(slave.x, facet);
    }
    const auto frame =
        frame_at<F>(nodes, points.xi[q].template head<F::tdim>());
    rays.push_back({in_space<F::gdim>(frame.x), in_space<F::gdim>(frame.n)});
  }
  return rays;
}

/// Hits on a tool where it is
std::vector<ToolHit> hits_on(const PlacedTool& placed,
                             std::span<const ToolRay> rays)
{
  const Pose& pose = placed.now;
  const Mat<3, 3> back = pose.rotation.transpose();
  std::vector<ToolRay> own;
  own.reserve(rays.size());
  for (const ToolRay& ray : rays)
    own.push_back(ray_from(placed, ray));
  std::vector<ToolHit> hits(rays.size());
  placed.tool->cast(own, hits);
  for (ToolHit& hit : hits)
  {
    hit.normal = (pose.rotation * hit.normal).eval();
    hit.bend = (pose.rotation * hit.bend * back).eval();
  }
  return hits;
}

RayStatus admit(const ToolHit& hit, const Vec<3>& n,
                const SearchDistances& range, bool depth_is_default)
{
  const double facing = -n.dot(hit.normal);
  if (not(facing > tolerance::facing))
    return RayStatus::back_face;
  if (hit.g > range.reach)
    return RayStatus::too_far;
  if (not depth_is_default and hit.g < -range.depth * facing)
    return RayStatus::too_deep;
  return RayStatus::hit;
}

/// Whether a hit goes before another one
bool is_nearer(double g, double other)
{
  return std::pair{g >= 0.0, std::abs(g)} <
         std::pair{other >= 0.0, std::abs(other)};
}
} // namespace

Hits cast_on_tools(const Surface& slave, std::span<const PlacedTool> tools,
                   const IntegrationPoints& points, const FacetDistances& range)
{
  const std::size_t n = points.size();
  Hits hits{std::vector<RayStatus>(n, RayStatus::no_facet),
            std::vector<Index>(n, no_index),
            std::vector<Vec<2>>(n, Vec<2>::Zero()),
            std::vector<double>(n, 0.0),
            false,
            std::vector<Vec<3>>(n, Vec<3>::Zero()),
            std::vector<Mat<3, 3>>(n, Mat<3, 3>::Zero()),
            std::vector<std::int8_t>(n, 0)};
  const auto rays = with_geometry(slave, [&]<class F>(F)
                                  { return rays_of<F>(slave, points); });
  for (std::size_t k = 0; k < tools.size(); ++k)
  {
    const std::vector<ToolHit> found = hits_on(tools[k], rays);
    for (std::size_t q = 0; q < n; ++q)
    {
      const ToolHit& hit = found[q];
      const bool known = hits.master[q] != no_index;
      if (points.seed[q] == no_index or not hit.found or
          (known and not is_nearer(hit.g, hits.gap[q])))
        continue;
      const RayStatus status = admit(hit, rays[q].n, range[points.slave[q]],
                                     range.depth_is_default());
      if (known and status != RayStatus::hit)
        continue;
      hits.status[q] = status;
      hits.gap[q] = hit.g;
      hits.normal[q] = hit.normal;
      hits.bend[q] = hit.bend;
      hits.flat[q] = hit.flat;
      if (status == RayStatus::hit)
        hits.master[q] = static_cast<Index>(k);
    }
  }
  return hits;
}

std::vector<PlacedTool> where_they_were(std::span<const PlacedTool> tools)
{
  std::vector<PlacedTool> past(tools.begin(), tools.end());
  for (PlacedTool& one : past)
    one.now = one.old;
  return past;
}
} // namespace raymortar
