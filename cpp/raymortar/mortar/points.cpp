#include "raymortar/mortar/points.h"
#include "raymortar/geometry/dispatch.h"
#include "raymortar/mortar/flat_map.h"

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
             const QuadratureRule& facet_rule, bool complement)
      : _slave(slave), _segmentation(segmentation),
        _segment_rules(segment_rules), _facet_rule(facet_rule),
        _complement(complement)
  {
    const auto n = static_cast<std::size_t>(slave.num_facets());
    _out.covered.assign(n, 0.0);
    _out.whole.assign(n, 0.0);
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
    _out.area.push_back(p.weight * jacobian(p.xi));
    _out.slave.push_back(slave);
    _out.seed.push_back(master);
    _out.segment.push_back(segment);
    _out.place.push_back(place);
  }

  /// Areas of the facet, and the signed points of its uncovered part
  void finish_facet(Index f, std::size_t first)
  {
    const auto k = static_cast<std::size_t>(f);
    for (std::size_t q = 0; q < _facet_rule.points.size(); ++q)
      _out.whole[k] += _facet_rule.weights[q] * jacobian(_facet_rule.points[q]);
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

  [[nodiscard]] double jacobian(const Vec<2>& xi) const
  {
    return frame_at<F>(_nodes, xi.template head<F::tdim>()).jacobian;
  }

  const Surface& _slave;
  const Segmentation& _segmentation;
  const SegmentRules& _segment_rules;
  const QuadratureRule& _facet_rule;
  bool _complement;
  typename F::NodeMatrix _nodes;
  std::vector<Vec<2>> _corners; ///< of the present segment, flat
  std::vector<WeightedPoint> _laid;
  IntegrationPoints _out;
};

/// A ray's result together with the facet it ended on
template <class F>
struct Landing
{
  RayHit<F> hit;
  Index facet = no_index;
};

template <class F>
class RayCaster
{
public:
  RayCaster(const Surface& slave, const Surface& master, const GapRange& range)
      : _slave(slave), _master(master), _range(range)
  {
  }

  [[nodiscard]] Landing<F> cast(Index slave, const Vec<2>& xi, Index seed)
  {
    if (slave != _facet)
    {
      _facet = slave;
      _nodes = _slave.template nodes<F>(_slave.x, slave);
    }
    const auto frame = frame_at<F>(_nodes, xi.template head<F::tdim>());
    Landing<F> landing = walk(frame.x, frame.n, seed);
    if (landing.hit.status == RayStatus::hit)
      landing.hit.status = admit(frame.n, landing);
    // Affine facets have one root, which Newton finds from anywhere
    if (not F::affine and landing.hit.status != RayStatus::hit)
      landing = search(frame.x, frame.n, landing);
    return landing;
  }

private:
  /// Follow the ray from facet to facet until it lands inside one
  [[nodiscard]] Landing<F> walk(const typename F::Point& x_s,
                                const typename F::Point& n, Index facet)
  {
    Landing<F> landing;
    _hops = 0;
    while (_hops < max_hops)
    {
      _visited[_hops++] = facet;
      const auto nodes = _master.template nodes<F>(_master.x, facet);
      landing = {intersect<F>(x_s, n, nodes, flat_guess<F>(x_s, n, nodes)),
                 facet};
      RayHit<F>& hit = landing.hit;
      if (hit.status != RayStatus::hit or
          hit.outside.amount <= tolerance::ray_outside)
        return landing;
      const Index next =
          _master.neighbours[static_cast<std::size_t>(facet) * F::Ref::edges +
                             static_cast<std::size_t>(hit.outside.edge)];
      // Two facets that send the ray to each other: it passes between them
      if (next == no_index or (_hops > 1 and next == _visited[_hops - 2]))
        break;
      facet = next;
    }
    landing.hit.status = RayStatus::no_facet;
    return landing;
  }

  /// Second chance on the facets of a walk that failed, and on the neighbours
  /// of its first.
  ///
  /// From the flat guess, Newton may diverge on a strongly curved or warped
  /// facet, or end at a root of its extension beyond the edges, which then
  /// sends the walk astray. Other starting points find the root inside, if
  /// there is one. Nothing is accepted that `walk` would not accept.
  [[nodiscard]] Landing<F> search(const typename F::Point& x_s,
                                  const typename F::Point& n,
                                  const Landing<F>& failed) const
  {
    Landing<F> best = failed;
    for (std::size_t k = 0; k < _hops; ++k)
      best = nearer(best, inside(x_s, n, _visited[k]));
    for (std::size_t e = 0; e < F::Ref::edges; ++e)
    {
      const Index next =
          _master.neighbours[static_cast<std::size_t>(_visited[0]) *
                                 F::Ref::edges +
                             e];
      if (best.hit.status != RayStatus::hit and next != no_index)
        best = nearer(best, inside(x_s, n, next));
    }
    return best;
  }

  /// Nearest admitted hit within a facet, Newton started at each of its nodes
  [[nodiscard]] Landing<F> inside(const typename F::Point& x_s,
                                  const typename F::Point& n, Index facet) const
  {
    const auto nodes = _master.template nodes<F>(_master.x, facet);
    Landing<F> best;
    for (const auto& point : F::Node::points)
    {
      const typename F::RefPoint start(point.data());
      Landing<F> landing{intersect<F>(x_s, n, nodes, start), facet};
      if (landing.hit.status == RayStatus::hit and
          landing.hit.outside.amount <= tolerance::ray_outside and
          admit(n, landing) == RayStatus::hit)
        best = nearer(best, landing);
    }
    return best;
  }

  [[nodiscard]] static const Landing<F>& nearer(const Landing<F>& a,
                                                const Landing<F>& b)
  {
    if (b.hit.status != RayStatus::hit)
      return a;
    const bool better =
        a.hit.status != RayStatus::hit or std::abs(b.hit.g) < std::abs(a.hit.g);
    return better ? b : a;
  }

  [[nodiscard]] RayStatus admit(const typename F::Point& n,
                                const Landing<F>& landing) const
  {
    const auto nodes = _master.template nodes<F>(_master.x, landing.facet);
    const auto master = frame_at<F>(nodes, landing.hit.eta);
    const double facing = -n.dot(master.n);
    if (not(facing > tolerance::facing))
      return RayStatus::back_face;
    if (landing.hit.g > _range.reach)
      return RayStatus::too_far;
    // Obliquely, a point that lies little below the master is deep along its
    // ray: beside a corner of the slave, the other face is nearer by far
    if (landing.hit.g < -_range.depth * facing)
      return RayStatus::too_deep;
    return RayStatus::hit;
  }

  static constexpr std::size_t max_hops = 16;
  const Surface& _slave;
  const Surface& _master;
  GapRange _range;
  Index _facet = no_index;
  typename F::NodeMatrix _nodes;
  std::array<Index, max_hops> _visited{}; ///< facets of the last walk
  std::size_t _hops = 0;
};

template <class F>
Hits cast_all(const Surface& slave, const Surface& master,
              const IntegrationPoints& points, const GapRange& range)
{
  const std::size_t n = points.size();
  Hits hits{std::vector<RayStatus>(n, RayStatus::no_facet),
            std::vector<Index>(n, no_index),
            std::vector<Vec<2>>(n, Vec<2>::Zero()),
            std::vector<double>(n, 0.0)};
  RayCaster<F> caster(slave, master, range);
  for (std::size_t q = 0; q < n; ++q)
  {
    if (points.seed[q] == no_index)
      continue;
    const Landing<F> landing =
        caster.cast(points.slave[q], points.xi[q], points.seed[q]);
    hits.status[q] = landing.hit.status;
    hits.gap[q] = landing.hit.g;
    hits.eta[q].template head<F::tdim>() = landing.hit.eta;
    if (landing.hit.status == RayStatus::hit)
      hits.master[q] = landing.facet;
  }
  return hits;
}
} // namespace

IntegrationPoints make_points(const Surface& slave,
                              const Segmentation& segmentation,
                              const SegmentRules& segment_rules,
                              const QuadratureRule& facet_rule, bool complement)
{
  return with_facet_type(slave,
                         [&]<class F>(F)
                         {
                           return PointMaker<F>(slave, segmentation,
                                                segment_rules, facet_rule,
                                                complement)
                               .make();
                         });
}

Hits cast_rays(const Surface& slave, const Surface& master,
               const IntegrationPoints& points, const GapRange& range)
{
  return with_facet_type(slave, [&]<class F>(F)
                         { return cast_all<F>(slave, master, points, range); });
}
} // namespace raymortar
