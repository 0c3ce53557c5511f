#include "raymortar/mortar/rim_coverage.h"
#include "raymortar/geometry/dispatch.h"
#include "raymortar/mortar/tool_rays.h"
#include <algorithm>

namespace raymortar
{
namespace
{
/// A facet is beside the slave that it faces by less than this share of how
/// another one near it does: of a punch with right angles, as long as the slave
/// has tilted by less than 39 degrees
constexpr double beside = 0.8;

/// A segment is open that is nowhere deeper than this share of its largest gap
constexpr double touching = 0.1;

/// How a slave facet sees the facet that has cut a segment
struct View
{
  double facing = 0.0; ///< -n . n_m in the middle
  bool is_open = false;
};

template <class S, class M>
View view_of(const Surface& slave, const Surface& facets, const Segmentation& s,
             const Segment& one, const Vec<2>& middle)
{
  const auto nodes = slave.nodes<S>(slave.x, one.slave);
  const auto master = facets.nodes<M>(facets.x, one.master);
  const auto meet = [&](const Vec<2>& xi)
  {
    const auto frame = frame_at<S>(nodes, xi.template head<S::tdim>());
    return std::pair{frame,
                     intersect<M>(frame.x, frame.n, master,
                                  flat_guess<M>(frame.x, frame.n, master))};
  };
  const auto [frame, hit] = meet(middle);
  if (hit.status != RayStatus::hit)
    return {};
  double highest = hit.g, lowest = hit.g;
  for (const Vec<2>& xi : polygon_of(s, one))
    if (const auto at = meet(xi).second; at.status == RayStatus::hit)
    {
      highest = std::max(highest, at.g);
      lowest = std::min(lowest, at.g);
    }
  return {-frame.n.dot(frame_at<M>(master, hit.eta).n),
          lowest > -touching * highest};
}

std::vector<Vec<2>> middles_of(const Segmentation& s)
{
  std::vector<Vec<2>> middles;
  for (const Segment& one : s.segments)
  {
    const auto polygon = polygon_of(s, one);
    Vec<2> sum = Vec<2>::Zero();
    for (const Vec<2>& xi : polygon)
      sum += xi;
    middles.push_back(sum / static_cast<double>(polygon.size()));
  }
  return middles;
}

/// The most that any of some facets faces a slave facet's middle
template <class S, class M>
double most_facing(const Surface& slave, Index facet, const Vec<2>& middle,
                   const Surface& facets, std::span<const Index> near)
{
  const auto n = frame_at<S>(slave.nodes<S>(slave.x, facet),
                             middle.template head<S::tdim>())
                     .n;
  const typename M::RefPoint centre =
      M::RefPoint::Constant(M::shape == Shape::triangle ? 1.0 / 3.0 : 0.5);
  double most = 0.0;
  for (const Index m : near)
    most = std::max(
        most, -n.dot(frame_at<M>(facets.nodes<M>(facets.x, m), centre).n));
  return most;
}

/// Whether each segment is open, below a facet that the slave faces far more
/// obliquely than others near it
std::vector<bool> are_beside(const Surface& slave, const Surface& facets,
                             const Candidates& near, const Segmentation& s,
                             const std::vector<Vec<2>>& middles)
{
  std::vector<bool> found;
  found.reserve(middles.size());
  const auto look = [&]<class S, class M>(S, M)
  {
    for (std::size_t k = 0; k < middles.size(); ++k)
    {
      const Segment& one = s.segments[k];
      const View view = view_of<S, M>(slave, facets, s, one, middles[k]);
      found.push_back(
          view.is_open and
          view.facing < beside * most_facing<S, M>(slave, one.slave, middles[k],
                                                   facets,
                                                   near.masters_of(one.slave)));
    }
  };
  with_geometries(slave, facets, look);
  return found;
}

/// Whether each middle ray enters a tool
std::vector<bool> are_met(const Surface& slave,
                          std::span<const PlacedTool> tools,
                          const Segmentation& s, const FacetDistances& range,
                          const std::vector<Vec<2>>& middles)
{
  IntegrationPoints places;
  for (std::size_t k = 0; k < middles.size(); ++k)
    add_place(places, s.segments[k].slave, middles[k]);
  std::vector<bool> met;
  for (const RayStatus status :
       cast_on_tools(slave, tools, places, range).status)
    met.push_back(status != RayStatus::no_facet and
                  status != RayStatus::back_face);
  return met;
}
} // namespace

void add_place(IntegrationPoints& places, Index slave, const Vec<2>& xi)
{
  places.slave.push_back(slave);
  places.xi.push_back(xi);
  places.seed.push_back(0);
}

std::span<const Vec<2>> polygon_of(const Segmentation& s, const Segment& one)
{
  return std::span(s.vertices)
      .subspan(static_cast<std::size_t>(one.begin),
               static_cast<std::size_t>(one.size));
}

std::vector<bool>
segments_that_count(const Surface& slave, std::span<const PlacedTool> tools,
                    const Surface& facets, const Candidates& near,
                    const Segmentation& s, const FacetDistances& range,
                    bool has_multiplier)
{
  const std::vector<Vec<2>> middles = middles_of(s);
  std::vector<bool> count = are_met(slave, tools, s, range, middles);
  if (not has_multiplier)
    return count;
  const std::vector<bool> out = are_beside(slave, facets, near, s, middles);
  for (std::size_t k = 0; k < count.size(); ++k)
    count[k] = count[k] and not out[k];
  return count;
}
} // namespace raymortar
