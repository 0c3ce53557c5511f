#include "raymortar/rigid/rim_coverage.h"
#include "raymortar/geometry/dispatch.h"
#include "raymortar/geometry/middle.h"
#include "raymortar/geometry/ray.h"
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

template <int D>
Frame<D> frame_on(const Surface& surface, Index facet, const Vec<2>& xi)
{
  return with_geometry_in<D>(surface,
                             [&]<class F>(F)
                             {
                               return frame_at<F>(
                                   surface.nodes<F>(surface.x, facet),
                                   xi.template head<F::tdim>());
                             });
}

template <int D>
Frame<D> frame_in_middle(const Surface& surface, Index facet)
{
  return with_geometry_in<D>(surface,
                             [&]<class F>(F)
                             {
                               return frame_at<F>(
                                   surface.nodes<F>(surface.x, facet),
                                   middle_of_reference<F>());
                             });
}

double diameter_of(const Surface& surface, Index facet)
{
  return with_geometry(surface,
                       [&]<class F>(F) {
                         return diameter<F>(surface.nodes<F>(surface.x, facet));
                       });
}

/// Reference coordinates of a facet's corners
std::vector<Vec<2>> corners_of(const Surface& surface)
{
  return with_geometry(surface,
                       [&]<class F>(F)
                       {
                         std::vector<Vec<2>> corners;
                         for (std::size_t c = 0; c < F::Ref::corners; ++c)
                         {
                           corners.emplace_back(Vec<2>::Zero());
                           for (std::size_t i = 0; i < F::tdim; ++i)
                             corners.back()[i] = F::Node::points[c][i];
                         }
                         return corners;
                       });
}

/// Along a slave's ray to a facet, beyond the facet's edges as well; infinite
/// where the slave does not face it
template <int D>
double gap_along(const Frame<D>& from, const Surface& tools, Index facet)
{
  return with_geometry_in<D>(
      tools,
      [&]<class M>(M)
      {
        const auto nodes = tools.nodes<M>(tools.x, facet);
        const RayHit<M> hit = intersect<M>(
            from.x, from.n, nodes, flat_guess<M>(from.x, from.n, nodes));
        const bool is_met =
            hit.status == RayStatus::hit and
            -from.n.dot(frame_at<M>(nodes, hit.eta).n) > tolerance::facing;
        return is_met ? hit.g : std::numeric_limits<double>::infinity();
      });
}

/// A slave facet and the facets of tools near it
template <int D>
class Surroundings
{
public:
  Surroundings(const Surface& slave, Index facet, const Surface& tools,
               std::span<const Index> near)
      : _slave(slave), _facet(facet), _tools(tools),
        _n(frame_in_middle<D>(slave, facet).n),
        _slack(open_by_size * diameter_of(slave, facet))
  {
    const std::vector<Vec<2>> corners = corners_of(slave);
    for (const Index m : near)
    {
      const Frame<D> middle = frame_in_middle<D>(tools, m);
      _faces.push_back({middle.n, middle.x, -_n.dot(middle.n)});
      find_nearest_corner(corners, m, _faces.back());
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
      const double g = gap(xi, master);
      lowest = std::min(lowest, g);
      highest = std::max(highest, g);
    }
    const Frame<D> own = frame_in_middle<D>(_tools, master);
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
    Vec<2> corner = Vec<2>::Zero();
  };

  /// Along the ray of a place of the slave
  [[nodiscard]] double gap(const Vec<2>& xi, Index which) const
  {
    return gap_along<D>(frame_on<D>(_slave, _facet, xi), _tools, which);
  }

  void find_nearest_corner(const std::vector<Vec<2>>& corners, Index which,
                           Face& face) const
  {
    for (const Vec<2>& xi : corners)
    {
      const double distance = std::abs(gap(xi, which));
      if (distance < face.distance)
      {
        face.distance = distance;
        face.corner = xi;
      }
    }
  }

  const Surface& _slave;
  Index _facet;
  const Surface& _tools;
  Vec<D> _n;     ///< of the slave facet, in its middle
  double _slack; ///< of oblique segments. Length
  std::vector<Face> _faces;
};

/// Whether each segment is open, beside a face that its slave lies along
template <int D>
std::vector<bool> are_beside(const Surface& slave, const Surface& tools,
                             const Candidates& near, const Segmentation& s)
{
  std::vector<bool> found;
  found.reserve(s.segments.size());
  for (auto one = s.segments.begin(); one != s.segments.end();)
  {
    const Index f = one->slave;
    const Surroundings<D> around(slave, f, tools, near.masters_of(f));
    for (; one != s.segments.end() and one->slave == f; ++one)
      found.push_back(around.is_beside(polygon_of(s, *one), one->master));
  }
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
  const std::vector<bool> out = slave.gdim == 2
                                    ? are_beside<2>(slave, facets, near, s)
                                    : are_beside<3>(slave, facets, near, s);
  for (std::size_t k = 0; k < count.size(); ++k)
    count[k] = count[k] and not out[k];
  return count;
}
} // namespace raymortar
