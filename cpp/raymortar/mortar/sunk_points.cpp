#include "raymortar/mortar/sunk_points.h"
#include "raymortar/geometry/dispatch.h"
#include "raymortar/mortar/ray_caster.h"

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
} // namespace raymortar
