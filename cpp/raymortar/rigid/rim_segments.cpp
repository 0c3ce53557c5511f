#include "raymortar/geometry/dispatch.h"
#include "raymortar/geometry/middle.h"
#include "raymortar/geometry/ray.h"
#include "raymortar/mortar/reference_measure.h"
#include "raymortar/mortar/tool_cutter.h"
#include "raymortar/mortar/tool_rays.h"
#include "raymortar/mortar/whole_facets.h"
#include "raymortar/rigid/rim_coverage.h"
#include "raymortar/rigid/rims.h"
#include <cmath>

namespace raymortar
{
namespace
{
/// A facet of a tool: number of the tool, number of the facet
using ToolFacet = std::pair<Index, Index>;

/// A box around another one, in the coordinates that a tool was made in
template <int D>
Box<3> box_from(const PlacedTool& placed, const Box<D>& box)
{
  Vec<3> middle = Vec<3>::Zero(), half = Vec<3>::Zero();
  middle.head<D>() = 0.5 * (box.lower + box.upper);
  half.head<D>() = 0.5 * (box.upper - box.lower);
  const Vec<3> there = placed.now.origin(middle);
  const Vec<3> wide = placed.now.rotation.transpose().cwiseAbs() * half;
  return {there - wide, there + wide};
}

/// Facets bulge out of the box of their nodes by at most this share of it
constexpr double bulge = 0.25;

template <int D>
Box<D> box_around(const Surface& slave, const FacetDistances& range)
{
  Box<D> box;
  for (std::size_t k = 0; k < slave.x.size(); k += D)
  {
    const Eigen::Map<const Vec<D>> x(slave.x.data() + k);
    box.merge({x, x});
  }
  double length = 0.0;
  for (Index f = 0; f < slave.num_facets(); ++f)
    length = std::max({length, range[f].reach, range[f].depth});
  return box.inflated(length + bulge * (box.upper - box.lower).maxCoeff());
}

template <int D>
bool any_rim_in(std::span<const PlacedTool> tools, const Box<D>& box)
{
  return std::any_of(
      tools.begin(), tools.end(),
      [&](const PlacedTool& one)
      { return faceted(*one.tool)->has_rim_in(box_from<D>(one, box)); });
}

/// Facets of tools near each slave facet that has a rim above it
struct NearFacets
{
  std::vector<Above> above;        ///< the others: nothing
  std::vector<ToolFacet> facets;   ///< slave by slave
  std::vector<std::size_t> counts; ///< (slaves,)
};

template <int D>
NearFacets find_near(const Surface& slave, std::span<const PlacedTool> tools,
                     const FacetDistances& range)
{
  const auto boxes = ray_boxes<D>(slave, range);
  NearFacets near{std::vector<Above>(boxes.size(), Above::nothing),
                  {},
                  std::vector<std::size_t>(boxes.size(), 0)};
  std::vector<Index> found;
  for (std::size_t f = 0; f < boxes.size(); ++f)
  {
    std::vector<Box<3>> own;
    for (const PlacedTool& tool : tools)
    {
      own.push_back(box_from<D>(tool, boxes[f]));
      if (faceted(*tool.tool)->has_rim_in(own.back()))
        near.above[f] = Above::rim;
    }
    if (near.above[f] != Above::rim)
      continue;
    for (std::size_t k = 0; k < tools.size(); ++k)
    {
      found.clear();
      faceted(*tools[k].tool)->find_facets(own[k], found);
      for (const Index facet : found)
        near.facets.emplace_back(static_cast<Index>(k), facet);
      near.counts[f] += found.size();
    }
  }
  return near;
}

/// Some facets of tools as a surface
Surface surface_of(std::span<const PlacedTool> tools,
                   const std::vector<ToolFacet>& facets, int gdim)
{
  const ToolFacets& kind = faceted(*tools[0].tool)->facets();
  Surface s;
  s.shape = kind.shape;
  s.degree = s.node_degree = kind.degree;
  s.gdim = gdim;
  const auto d = static_cast<std::size_t>(gdim);
  const auto n = static_cast<std::size_t>(s.nodes_per_facet());
  for (const auto& [k, facet] : facets)
  {
    const PlacedTool& tool = tools[static_cast<std::size_t>(k)];
    const ToolFacets& own = faceted(*tool.tool)->facets();
    for (std::size_t a = 0; a < n; ++a)
    {
      const auto node = static_cast<std::size_t>(
          own.nodes[static_cast<std::size_t>(facet) * n + a]);
      Vec<3> X = Vec<3>::Zero();
      for (std::size_t i = 0; i < d; ++i)
        X[static_cast<Eigen::Index>(i)] = own.x[node * d + i];
      const Vec<3> now = tool.now.point(X), old = tool.old.point(X);
      s.x.insert(s.x.end(), now.data(), now.data() + d);
      s.x_old.insert(s.x_old.end(), old.data(), old.data() + d);
      s.facet_nodes.push_back(static_cast<Index>(s.facet_nodes.size()));
    }
    s.facet_id.push_back(static_cast<GlobalIndex>(s.facet_id.size()));
    s.body.push_back(k);
  }
  s.X = s.x;
  return s;
}

std::vector<ToolFacet> sorted_facets(std::vector<ToolFacet> facets)
{
  std::sort(facets.begin(), facets.end());
  facets.erase(std::unique(facets.begin(), facets.end()), facets.end());
  return facets;
}

Candidates candidates_of(const NearFacets& near,
                         const std::vector<ToolFacet>& sorted)
{
  Candidates c;
  for (const ToolFacet& facet : near.facets)
    c.masters.push_back(static_cast<Index>(
        std::lower_bound(sorted.begin(), sorted.end(), facet) -
        sorted.begin()));
  for (const std::size_t count : near.counts)
    c.offsets.push_back(c.offsets.back() + static_cast<std::int64_t>(count));
  return c;
}

/// Distance along a ray between where it meets a facet and a place on it
double apart(const Surface& slave, Index facet, const Vec<2>& xi,
             const Surface& tools, Index which, double g)
{
  const auto find = [&]<class S, class M>(S, M)
  {
    const auto frame = frame_at<S>(slave.nodes<S>(slave.x, facet),
                                   xi.template head<S::tdim>());
    const auto nodes = tools.nodes<M>(tools.x, which);
    const RayHit<M> hit = intersect<M>(frame.x, frame.n, nodes,
                                       flat_guess<M>(frame.x, frame.n, nodes));
    return hit.status == RayStatus::hit
               ? std::abs(hit.g - g)
               : std::numeric_limits<double>::infinity();
  };
  return with_geometries(slave, tools, find);
}

/// Keeps the facet that the ray enters a tool by
FacetOrder order_by_rays(const Surface& slave,
                         std::span<const PlacedTool> tools,
                         const Surface& facets, const FacetDistances& range)
{
  return [&slave, tools, &facets, &range](Index facet, const Vec<2>& xi,
                                          Index first, Index second)
  {
    IntegrationPoints place;
    add_place(place, facet, xi);
    const Hits hits = cast_on_tools(slave, tools, place, range);
    if (hits.master[0] == no_index)
      return 0;
    const auto distance = [&](Index one)
    {
      return facets.body_of(one) == hits.master[0]
                 ? apart(slave, facet, xi, facets, one, hits.gap[0])
                 : std::numeric_limits<double>::infinity();
    };
    const double a = distance(first), b = distance(second);
    return a == b ? 0 : (a < b ? -1 : 1);
  };
}

Vec<2> middle_of(Shape shape)
{
  return with_shape(shape,
                    []<Shape S>()
                    {
                      using F = FacetType<S, 1, 1>;
                      Vec<2> xi = Vec<2>::Zero();
                      xi.head<F::tdim>() = middle_of_reference<F>();
                      return xi;
                    });
}

/// Decide by one ray a facet with no rim nearby
void find_inside(const Surface& slave, std::span<const PlacedTool> tools,
                 const FacetDistances& range, std::vector<Above>& above)
{
  IntegrationPoints middles;
  for (Index f = 0; f < slave.num_facets(); ++f)
    if (above[static_cast<std::size_t>(f)] != Above::rim)
      add_place(middles, f, middle_of(slave.shape));
  const Hits hits = cast_on_tools(slave, tools, middles, range);
  for (std::size_t q = 0; q < middles.size(); ++q)
    if (hits.status[q] == RayStatus::hit)
      above[static_cast<std::size_t>(middles.slave[q])] = Above::inside;
}

/// Add a segment of another segmentation
void append(Segmentation& out, const Segmentation& from, Segment one,
            double whole)
{
  const auto polygon = polygon_of(from, one);
  out.covered[static_cast<std::size_t>(one.slave)] +=
      reference_measure(polygon) / whole;
  const auto begin = static_cast<std::ptrdiff_t>(one.begin);
  const auto copy = [&](auto& to, const auto& all)
  { to.insert(to.end(), all.begin() + begin, all.begin() + begin + one.size); };
  one.begin = static_cast<std::int32_t>(out.vertices.size());
  copy(out.vertices, from.vertices);
  copy(out.provenance, from.provenance);
  copy(out.breaks, from.breaks);
  out.segments.push_back(one);
}

/// Segments at rims that count, and whole facets, slave by slave
Segmentation merged(const Surface& slave, const std::vector<Above>& above,
                    const Segmentation& cut, const std::vector<bool>& counts)
{
  const Segmentation whole = whole_facets(slave);
  const double measure = slave.shape == Shape::triangle
                             ? Reference<Shape::triangle>::measure
                             : 1.0;
  Segmentation out;
  out.covered.assign(above.size(), 0.0);
  out.degenerate = cut.degenerate;
  out.subdivided = cut.subdivided;
  out.clipped = cut.clipped;
  std::size_t k = 0;
  for (std::size_t f = 0; f < above.size(); ++f)
  {
    if (above[f] == Above::inside)
      append(out, whole, whole.segments[f], measure);
    for (; k < cut.segments.size() and
           static_cast<std::size_t>(cut.segments[k].slave) == f;
         ++k)
      if (counts[k])
        append(out, cut, cut.segments[k], measure);
  }
  return out;
}
class RimCutter final : public ToolCutter
{
public:
  /// All have facets, of one kind, and some have rims
  [[nodiscard]] bool serves(std::span<const PlacedTool> tools) const override
  {
    bool any = false;
    for (const PlacedTool& one : tools)
    {
      const FacetedTool* const tool = faceted(*one.tool);
      if (tool == nullptr)
        return false;
      const ToolFacets& first = faceted(*tools[0].tool)->facets();
      if (tool->facets().shape != first.shape or
          tool->facets().degree != first.degree)
        return false;
      any = any or tool->has_rim();
    }
    return any;
  }

  [[nodiscard]] bool is_near(const Surface& slave,
                             std::span<const PlacedTool> tools,
                             const FacetDistances& range) const override
  {
    return slave.gdim == 2 ? any_rim_in<2>(tools, box_around<2>(slave, range))
                           : any_rim_in<3>(tools, box_around<3>(slave, range));
  }

  [[nodiscard]] ToolSegments cut(const Surface& slave,
                                 std::span<const PlacedTool> tools,
                                 const FacetDistances& range, bool subdivide,
                                 bool has_multiplier) const override
  {
    NearFacets near = slave.gdim == 2 ? find_near<2>(slave, tools, range)
                                      : find_near<3>(slave, tools, range);
    const std::vector<ToolFacet> sorted = sorted_facets(near.facets);
    const Candidates candidates = candidates_of(near, sorted);
    ToolSegments out{
        std::move(near.above), surface_of(tools, sorted, slave.gdim), {}};
    SegmentationOptions options(range, subdivide);
    options.order = order_by_rays(slave, tools, out.facets, range);
    const Segmentation segments =
        make_segments(slave, out.facets, candidates, options);
    find_inside(slave, tools, range, out.above);
    out.segmentation =
        merged(slave, out.above, segments,
               segments_that_count(slave, tools, out.facets, candidates,
                                   segments, range, has_multiplier));
    return out;
  }
};
} // namespace

const ToolCutter* FacetedTool::cutter() const
{
  static const RimCutter cutter;
  return &cutter;
}
} // namespace raymortar
