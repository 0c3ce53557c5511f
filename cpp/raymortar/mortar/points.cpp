#include "raymortar/mortar/points.h"
#include "raymortar/geometry/dispatch.h"
#include "raymortar/geometry/revolution.h"
#include "raymortar/mortar/filtered.h"
#include "raymortar/mortar/flat_map.h"
#include "raymortar/mortar/ray_caster.h"
#include <cmath>

namespace raymortar
{
namespace
{
template <class F>
class PointMaker
{
public:
  PointMaker(const Surface& slave, const Segmentation& segmentation,
             const SegmentRules& segment_rules,
             const QuadratureRule& facet_rule, bool complement,
             bool of_revolution)
      : _slave(slave), _segmentation(segmentation),
        _segment_rules(segment_rules), _facet_rule(facet_rule),
        _complement(complement), _of_revolution(of_revolution)
  {
    const auto n = static_cast<std::size_t>(slave.num_facets());
    _out.covered.assign(n, 0.0);
    _out.whole.assign(n, 0.0);
    _out.width.assign(n, 0.0);
    _out.rivals = segmentation.rivals;
  }

  [[nodiscard]] IntegrationPoints make() &&
  {
    auto segment = _segmentation.segments.begin();
    for (Index f = 0; f < _slave.num_facets(); ++f)
    {
      _nodes = _slave.template nodes<F>(_slave.X, f);
      const FlatMap<F> map(_nodes);
      const std::size_t first = _out.size();
      for (; segment != _segmentation.segments.end() and segment->slave == f;
           ++segment)
        add_segment(*segment, map);
      finish_facet(f, first);
    }
    return std::move(_out);
  }

private:
  void add_segment(const Segment& segment, const FlatMap<F>& map)
  {
    _corners.clear();
    for (std::int32_t v = segment.begin; v < segment.begin + segment.size; ++v)
    {
      const Vec<2>& xi = _segmentation.vertices[static_cast<std::size_t>(v)];
      _corners.emplace_back(Vec<2>::Zero());
      _corners.back().template head<F::tdim>() =
          map.to_flat(xi.template head<F::tdim>());
    }
    _laid.clear();
    if constexpr (F::tdim == 1)
      append_on_interval(_segment_rules.simplex, _corners[0][0], _corners[1][0],
                         _laid);
    else
      append_on_polygon(_segment_rules, _segmentation.tiles(segment), _corners,
                        _laid);
    const auto number =
        static_cast<Index>(&segment - _segmentation.segments.data());
    Index place = 0;
    for (WeightedPoint& p : _laid)
    {
      const typename F::RefPoint xi =
          map.from_flat(p.xi.template head<F::tdim>());
      p.xi.template head<F::tdim>() = xi;
      p.weight /= map.gradient(xi).determinant();
      add(p, segment.slave, segment.master, number, place++);
    }
  }

  void add(const WeightedPoint& p, Index slave, Index master, Index segment,
           Index place)
  {
    _out.xi.push_back(p.xi);
    _out.weight.push_back(p.weight);
    _out.area.push_back(p.weight * jacobian(frame(p.xi)));
    _out.slave.push_back(slave);
    _out.seed.push_back(master);
    _out.segment.push_back(segment);
    _out.place.push_back(place);
  }

  /// Areas of the facet, and the signed points of its uncovered part
  void finish_facet(Index f, std::size_t first)
  {
    const auto k = static_cast<std::size_t>(f);
    add_sizes(k);
    const std::size_t last = _out.size();
    for (std::size_t q = first; q < last; ++q)
      _out.covered[k] += _out.area[q];
    if (not _complement or
        std::abs(1.0 - _segmentation.covered[k]) <= tolerance::coverage)
      return;
    for (std::size_t q = 0; q < _facet_rule.points.size(); ++q)
      add({_facet_rule.points[q], _facet_rule.weights[q]}, f, no_index,
          no_index, 0);
    for (std::size_t q = first; q < last; ++q)
      add({_out.xi[q], -_out.weight[q]}, f, no_index, _out.segment[q],
          _out.place[q]);
  }

  /// Area and width of the facet
  void add_sizes(std::size_t facet)
  {
    double plain = 0.0;
    for (std::size_t q = 0; q < _facet_rule.points.size(); ++q)
    {
      const Frame<F::gdim> at = frame(_facet_rule.points[q]);
      plain += _facet_rule.weights[q] * at.jacobian;
      _out.whole[facet] += _facet_rule.weights[q] * jacobian(at);
    }
    _out.width[facet] = std::pow(plain, 1.0 / F::tdim);
  }

  [[nodiscard]] Frame<F::gdim> frame(const Vec<2>& xi) const
  {
    return frame_at<F>(_nodes, xi.template head<F::tdim>());
  }

  /// Area per reference area
  [[nodiscard]] double jacobian(const Frame<F::gdim>& at) const
  {
    if constexpr (F::gdim == 2)
      if (_of_revolution)
        return at.jacobian * circumference(at.x);
    return at.jacobian;
  }

  const Surface& _slave;
  const Segmentation& _segmentation;
  const SegmentRules& _segment_rules;
  const QuadratureRule& _facet_rule;
  bool _complement, _of_revolution;
  typename F::NodeMatrix _nodes;
  std::vector<Vec<2>> _corners; ///< of the present segment, flat
  std::vector<WeightedPoint> _laid;
  IntegrationPoints _out;
};

/// None for points that no segment has made
std::span<const Index> rivals_of(const IntegrationPoints& points, std::size_t q)
{
  if (q >= points.segment.size())
    return {};
  return points.rivals.of(points.segment[q]);
}

template <class M>
Hits cast_all(const Surface& slave, const Surface& master,
              const IntegrationPoints& points, const FacetDistances& range,
              const PairFilter* filter)
{
  const std::size_t n = points.size();
  Hits hits{std::vector<RayStatus>(n, RayStatus::no_facet),
            std::vector<Index>(n, no_index),
            std::vector<Vec<2>>(n, Vec<2>::Zero()),
            std::vector<double>(n, 0.0)};
  RayCaster<M> caster(slave, master, range, filter);
  for (std::size_t q = 0; q < n; ++q)
  {
    if (points.seed[q] == no_index)
      continue;
    const FacetHit<M> found = caster.cast(points.slave[q], points.xi[q],
                                          points.seed[q], rivals_of(points, q));
    hits.status[q] = found.hit.status;
    hits.gap[q] = found.hit.g;
    hits.eta[q].template head<M::tdim>() = found.hit.eta;
    if (found.hit.status == RayStatus::hit)
      hits.master[q] = found.facet;
  }
  hits.hang_on_past = caster.has_looked_back();
  return hits;
}
} // namespace

IntegrationPoints make_points(const Surface& slave,
                              const Segmentation& segmentation,
                              const SegmentRules& segment_rules,
                              const QuadratureRule& facet_rule, bool complement,
                              bool of_revolution)
{
  return with_geometry(slave,
                       [&]<class F>(F)
                       {
                         return PointMaker<F>(slave, segmentation,
                                              segment_rules, facet_rule,
                                              complement, of_revolution)
                             .make();
                       });
}

Hits cast_rays(const Surface& slave, const Surface& master,
               const IntegrationPoints& points, const FacetDistances& range)
{
  return cast_rays(slave, master, points, range, nullptr);
}

Hits cast_rays(const Surface& slave, const Surface& master,
               const IntegrationPoints& points, const FacetDistances& range,
               const PairFilter* filter)
{
  return with_geometry(
      master, [&]<class M>(M)
      { return cast_all<M>(slave, master, points, range, filter); });
}
} // namespace raymortar
