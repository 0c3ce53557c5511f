#include "raymortar/mortar/rim_coverage.h"
#include "raymortar/geometry/dispatch.h"
#include "raymortar/geometry/middle.h"
#include "raymortar/mortar/tool_rays.h"
#include <algorithm>
#include <cmath>
#include <numbers>

namespace raymortar
{
namespace
{
/// Faces of a tool: normals of different ones differ by more than 30 degrees,
/// as across its rim
const double sharp = std::cos(std::numbers::pi / 6.0);

/// A slave facet lies along one face rather than another that it faces by less
/// than this share of how it faces the first: below a punch with right angles,
/// as long as it has tilted by less than 39 degrees
constexpr double oblique = 0.8;

/// So it does, however tilted, where a corner's distance from the first is less
/// than this share of the segment's largest gap to the other, and the gap to
/// the other grows from this corner on. Where it falls the facet comes down on
/// the other face
constexpr double near_it = 0.25;

/// Segments are open that are nowhere deeper than this share of their largest
/// gap; oblique ones also if they are nowhere deeper than a share of the
/// facet's diameter
constexpr double open_by_gap = 0.5, open_by_size = 0.1;

/// A slave facet and the facets of tools near it
template <class S, class M>
class Surroundings
{
public:
  static constexpr int D = S::gdim;

  Surroundings(const Surface& slave, Index facet, const Surface& tools,
               std::span<const Index> near)
      : _nodes(slave.nodes<S>(slave.x, facet)), _tools(tools),
        _n(frame_at<S>(_nodes, middle_of_reference<S>()).n),
        _slack(open_by_size * diameter<S>(_nodes))
  {
    for (const Index m : near)
    {
      const Frame<D> middle = middle_of_facet(m);
      _faces.push_back({middle.n, middle.x, -_n.dot(middle.n)});
      find_nearest_corner(m, _faces.back());
    }
  }

  /// Whether a segment is open while its facet lies along another face of a
  /// tool than the one that has cut it
  [[nodiscard]] bool is_beside(std::span<const Vec<2>> polygon,
                               Index master) const
  {
    double lowest = std::numeric_limits<double>::infinity(), highest = 0.0;
    for (const Vec<2>& xi : polygon)
    {
      const double g = gap(xi.template head<S::tdim>(), master);
      lowest = std::min(lowest, g);
      highest = std::max(highest, g);
    }
    const Frame<D> own = middle_of_facet(master);
    const double facing = -_n.dot(own.n), slack = open_by_gap * highest;
    const auto lies_along = [&](const Face& other)
    {
      // In a corner that opens to the slave it faces both
      const bool is_behind = other.n.dot(own.x - other.x) < 0.0;
      if (not(is_behind and own.n.dot(other.n) < sharp))
        return false;
      return (facing < oblique * other.facing and
              lowest > -std::max(slack, _slack)) or
             (near_it * highest > other.distance and lowest > -slack and
              gap(other.corner, master) < 0.5 * (lowest + highest));
    };
    return std::any_of(_faces.begin(), _faces.end(), lies_along);
  }

private:
  struct Face
  {
    Vec<D> n, x;   ///< in its middle
    double facing; ///< -n_s . n in the middle of the slave facet
    /// Least of the slave facet's corners, and which that is. Length
    double distance = std::numeric_limits<double>::infinity();
    typename S::RefPoint corner = S::RefPoint::Zero();
  };

  /// Along the ray of a place of the slave, beyond the facet's edges as well;
  /// infinite where the slave does not face it
  [[nodiscard]] double gap(const typename S::RefPoint& xi, Index which) const
  {
    const auto frame = frame_at<S>(_nodes, xi);
    const auto nodes = _tools.nodes<M>(_tools.x, which);
    const RayHit<M> hit = intersect<M>(frame.x, frame.n, nodes,
                                       flat_guess<M>(frame.x, frame.n, nodes));
    const bool is_met =
        hit.status == RayStatus::hit and
        -frame.n.dot(frame_at<M>(nodes, hit.eta).n) > tolerance::facing;
    return is_met ? hit.g : std::numeric_limits<double>::infinity();
  }

  void find_nearest_corner(Index which, Face& face) const
  {
    for (int c = 0; c < S::Ref::corners; ++c)
    {
      const typename S::RefPoint xi(
          S::Node::points[static_cast<std::size_t>(c)].data());
      const double distance = std::abs(gap(xi, which));
      if (distance < face.distance)
      {
        face.distance = distance;
        face.corner = xi;
      }
    }
  }

  [[nodiscard]] Frame<D> middle_of_facet(Index which) const
  {
    return frame_at<M>(_tools.nodes<M>(_tools.x, which),
                       middle_of_reference<M>());
  }

  typename S::NodeMatrix _nodes;
  const Surface& _tools;
  Vec<D> _n;     ///< of the slave facet, in its middle
  double _slack; ///< of oblique segments. Length
  std::vector<Face> _faces;
};

/// Whether each segment is open, beside a face that its slave lies along
std::vector<bool> are_beside(const Surface& slave, const Surface& tools,
                             const Candidates& near, const Segmentation& s)
{
  std::vector<bool> found;
  found.reserve(s.segments.size());
  const auto look = [&]<class S, class M>(S, M)
  {
    for (auto one = s.segments.begin(); one != s.segments.end();)
    {
      const Index f = one->slave;
      const Surroundings<S, M> around(slave, f, tools, near.masters_of(f));
      for (; one != s.segments.end() and one->slave == f; ++one)
        found.push_back(around.is_beside(polygon_of(s, *one), one->master));
    }
  };
  with_geometries(slave, tools, look);
  return found;
}

/// Whether each middle ray enters a tool
std::vector<bool> are_met(const Surface& slave,
                          std::span<const PlacedTool> tools,
                          const Segmentation& s, const FacetDistances& range)
{
  IntegrationPoints places;
  for (const Segment& one : s.segments)
  {
    const auto polygon = polygon_of(s, one);
    Vec<2> sum = Vec<2>::Zero();
    for (const Vec<2>& xi : polygon)
      sum += xi;
    add_place(places, one.slave, sum / static_cast<double>(polygon.size()));
  }
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
  std::vector<bool> count = are_met(slave, tools, s, range);
  if (not has_multiplier)
    return count;
  const std::vector<bool> out = are_beside(slave, facets, near, s);
  for (std::size_t k = 0; k < count.size(); ++k)
    count[k] = count[k] and not out[k];
  return count;
}
} // namespace raymortar
