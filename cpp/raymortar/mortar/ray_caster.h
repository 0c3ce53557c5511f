// Rays of slave points: from facet to facet of the master, and which of several
// layers of it they meet.
#pragma once

#include "raymortar/geometry/middle.h"
#include "raymortar/mortar/facet_hit.h"
#include "raymortar/mortar/slave_rays.h"
#include "raymortar/pairing/pair_filter.h"
#include <algorithm>

namespace raymortar
{
/// @brief Casts the rays of one slave surface on the true deformed master.
///
/// @tparam M Geometry of the master's facets
///
/// A penetration up to `depth` counts. A default depth goes through bodies that
/// are thin against their facets: beyond what is `certain` a penetration counts
/// only where the old positions, those of the last accepted step, tell that the
/// slave came from the front. They also tell which of several layers a point
/// was paired with [theory, section 3, Layers].
template <class M>
class RayCaster
{
public:
  /// @param[in] filter Of surfaces that meet themselves, nullptr: none
  RayCaster(const Surface& slave, const Surface& master,
            const FacetDistances& distances, const PairFilter* filter = nullptr)
      : _slave(slave), _master(master), _distances(distances), _filter(filter),
        _rays(make_slave_rays<D>(slave))
  {
  }

  /// @brief Where the ray of a slave point meets the master.
  /// @param[in] seed Facet to start from
  /// @param[in] rivals Facets of other layers over this point
  [[nodiscard]] FacetHit<M> cast(Index slave, const Vec<2>& xi, Index seed,
                                 std::span<const Index> rivals = {})
  {
    place(slave, xi);
    const FacetHit<M> first = land(seed);
    if (rivals.empty() and not(first.is_hit() and not is_certain(first)))
      return first;
    return contest(first, rivals);
  }

  /// @brief Which of two facets' layers a slave point is paired with: -1, the
  /// first; 1, the second; 0, neither, or they are one.
  [[nodiscard]] int compare(Index slave, const Vec<2>& xi, Index first,
                            Index second)
  {
    place(slave, xi);
    const FacetHit<M> a = land(first), b = land(second);
    if (a.facet == b.facet)
      return 0;
    const FacetHit<M> chosen = contest(a, {&second, 1});
    if (not chosen.is_hit())
      return 0;
    return chosen.facet == a.facet ? -1 : 1;
  }

  /// @brief Whether any ray was decided by the old positions.
  [[nodiscard]] bool has_looked_back() const { return _has_looked_back; }

private:
  static constexpr int D = M::gdim;

  void place(Index slave, const Vec<2>& xi)
  {
    _facet = slave;
    _xi = xi;
    _ray = _rays->now(slave, xi);
  }

  /// The hit that is reached from a facet, if it counts
  [[nodiscard]] FacetHit<M> land(Index seed)
  {
    FacetHit<M> found = walk(_ray, seed, _master.x);
    if (found.is_hit())
      found.hit.status = admit(found);
    // Affine facets have one root, which Newton finds from anywhere
    if (not M::affine and not found.is_hit())
      found = search(found);
    return found;
  }

  /// Follow a ray from facet to facet until it lands inside one
  [[nodiscard]] FacetHit<M> walk(const Ray<D>& ray, Index facet,
                                 const std::vector<double>& positions)
  {
    FacetHit<M> found;
    _hops = 0;
    while (_hops < max_hops)
    {
      _visited[_hops++] = facet;
      const auto nodes = _master.template nodes<M>(positions, facet);
      found = {
          intersect<M>(ray.x, ray.n, nodes, flat_guess<M>(ray.x, ray.n, nodes)),
          facet};
      RayHit<M>& hit = found.hit;
      if (hit.status != RayStatus::hit or
          hit.outside.amount <= tolerance::ray_outside)
        return found;
      const Index next =
          neighbour(facet, static_cast<std::size_t>(hit.outside.edge));
      // Two facets that send the ray to each other: it passes between them
      if (next == no_index or (_hops > 1 and next == _visited[_hops - 2]))
        break;
      facet = next;
    }
    found.hit.status = RayStatus::no_facet;
    return found;
  }

  /// Second chance on the facets of a walk that failed, and on the neighbours
  /// of its first.
  ///
  /// From the flat guess, Newton may diverge on a strongly curved or warped
  /// facet, or end at a root of its extension beyond the edges, which then
  /// sends the walk astray. Other starting points find the root inside, if
  /// there is one. Nothing is accepted that `walk` would not accept.
  [[nodiscard]] FacetHit<M> search(const FacetHit<M>& failed)
  {
    FacetHit<M> best = failed;
    for (std::size_t k = 0; k < _hops; ++k)
      best = nearer(best, inside(_visited[k]));
    for (std::size_t e = 0; e < M::Ref::edges; ++e)
    {
      const Index next = neighbour(_visited[0], e);
      if (not best.is_hit() and next != no_index)
        best = nearer(best, inside(next));
    }
    return best;
  }

  /// Nearest admitted hit within a facet, Newton started at each of its nodes
  [[nodiscard]] FacetHit<M> inside(Index facet)
  {
    const auto nodes = _master.template nodes<M>(_master.x, facet);
    FacetHit<M> best;
    for (const auto& point : M::Node::points)
    {
      const typename M::RefPoint start(point.data());
      FacetHit<M> found{intersect<M>(_ray.x, _ray.n, nodes, start), facet};
      if (found.is_hit() and
          found.hit.outside.amount <= tolerance::ray_outside and
          admit(found) == RayStatus::hit)
        best = nearer(best, found);
    }
    return best;
  }

  [[nodiscard]] static const FacetHit<M>& nearer(const FacetHit<M>& a,
                                                 const FacetHit<M>& b)
  {
    if (not b.is_hit())
      return a;
    const bool better = not a.is_hit() or std::abs(b.hit.g) < std::abs(a.hit.g);
    return better ? b : a;
  }

  /// Whether a hit counts; notes its incidence
  [[nodiscard]] RayStatus admit(FacetHit<M>& found)
  {
    const SearchDistances& range = _distances[_facet];
    const Frame<D> frame = frame_of(found, _master.x);
    found.facing = -_ray.n.dot(frame.n);
    if (not(found.facing > (_filter ? _filter->facing : tolerance::facing)))
      return RayStatus::back_face;
    if (_filter and not _filter->allows(_facet, id_of(found)))
      return RayStatus::no_facet;
    if (found.hit.g > range.reach)
      return RayStatus::too_far;
    // Obliquely, a point that lies little below the master is deep along its
    // ray: beside a corner of the slave, the other face is nearer by far
    if (found.hit.g < -range.depth * found.facing)
      return RayStatus::too_deep;
    return passes_by(found, frame) ? RayStatus::no_facet : RayStatus::hit;
  }

  /// Whether the point is beside an edge of the master and not within: the ray
  /// comes out of the master behind the point, and enters it behind the point
  /// too  [theory, section 3, Edges of the master]
  /// @param[in] frame Of the master at the hit
  [[nodiscard]] bool passes_by(const FacetHit<M>& found, const Frame<D>& frame)
  {
    // Walls of a surface that meets itself have depths of their own (3.14)
    if (_filter or found.hit.g >= 0.0 or
        -found.hit.g <= sharpest * distance_to_edges(found, frame))
      return false;
    _around.assign(1, found.facet);
    for (std::size_t k = 0; k < _around.size(); ++k)
      for (std::size_t e = 0; e < M::Ref::edges; ++e)
      {
        const Index next = neighbour(_around[k], e);
        if (next == no_index or
            std::find(_around.begin(), _around.end(), next) != _around.end())
          continue;
        if (enters_by(next, found))
          return true;
        if (_around.size() < most_around)
          _around.push_back(next);
      }
    return false;
  }

  /// Whether the ray enters the master through a facet between a hit and the
  /// point. Not if the ray is within the master for more than half of its
  /// thickness: the old positions decide about rays through thin masters
  [[nodiscard]] bool enters_by(Index facet, const FacetHit<M>& found) const
  {
    const auto nodes = _master.template nodes<M>(_master.x, facet);
    // Most facets face the point, which takes no intersection to see
    if (_ray.n.dot(frame_at<M>(nodes, middle_of_reference<M>()).n) <= 0.0)
      return false;
    const FacetHit<M> entry{intersect<M>(_ray.x, _ray.n, nodes,
                                         flat_guess<M>(_ray.x, _ray.n, nodes)),
                            facet};
    const double within = entry.hit.g - found.hit.g;
    return entry.is_hit() and
           entry.hit.outside.amount <= tolerance::ray_outside and
           within > 0.0 and entry.hit.g < 0.0 and
           within * found.facing <
               0.5 * _master.thickness_behind(found.facet) and
           facing(_ray, entry, _master.x) < 0.0;
  }

  /// A lower bound of the distance between a hit and the edges of its facet
  [[nodiscard]] static double distance_to_edges(const FacetHit<M>& found,
                                                const Frame<D>& frame)
  {
    const double sides = M::tdim == 1 ? 1.0 : frame.t.colwise().norm().sum();
    return -found.hit.outside.amount * frame.jacobian / sides;
  }

  [[nodiscard]] Index neighbour(Index facet, std::size_t edge) const
  {
    return _master
        .neighbours[static_cast<std::size_t>(facet) * M::Ref::edges + edge];
  }

  [[nodiscard]] Frame<D> frame_of(const FacetHit<M>& found,
                                  const std::vector<double>& positions) const
  {
    return frame_at<M>(_master.template nodes<M>(positions, found.facet),
                       found.hit.eta);
  }

  [[nodiscard]] double facing(const Ray<D>& ray, const FacetHit<M>& found,
                              const std::vector<double>& positions) const
  {
    return -ray.n.dot(frame_of(found, positions).n);
  }

  [[nodiscard]] bool is_certain(const FacetHit<M>& found) const
  {
    return found.hit.g >= 0.0 or
           found.hit.g >= -depth_at(found.facet) * found.facing;
  }

  /// Penetration of a master's facet that is certain
  [[nodiscard]] double depth_at(Index master) const
  {
    if (_filter and _slave.body_of(_facet) == _master.body_of(master))
      return std::min(_distances[_facet].depth,
                      half_thickness(_slave, _facet, _master, master));
    return certain_depth(_distances, _slave, _facet,
                         _master.thickness_behind(master));
  }

  [[nodiscard]] GlobalIndex id_of(const FacetHit<M>& found) const
  {
    return _master.facet_id[static_cast<std::size_t>(found.facet)];
  }

  /// Whether the slave point is within the body that its ray has come out of
  [[nodiscard]] bool is_within(const FacetHit<M>& found) const
  {
    const double behind = _master.thickness_behind(found.facet);
    return found.hit.g < 0.0 and std::isfinite(behind) and
           -found.hit.g * found.facing <= behind;
  }

  /// The layer that a point is paired with, among those that its ray meets
  [[nodiscard]] FacetHit<M> contest(const FacetHit<M>& first,
                                    std::span<const Index> rivals)
  {
    _layers.clear();
    const auto add = [this](const FacetHit<M>& one)
    {
      bool fresh = one.is_hit();
      for (const FacetHit<M>& other : _layers)
        fresh = fresh and other.facet != one.facet;
      if (fresh)
        _layers.push_back(one);
    };
    add(first);
    for (const Index rival : rivals)
      add(land(rival));
    if (const std::size_t k = choose(); k < _layers.size())
      return _layers[k];
    FacetHit<M> missed = first;
    if (missed.is_hit())
      missed.hit.status = RayStatus::too_deep;
    return missed;
  }

  /// The best among those that `fit(k)` takes, or `none`: a point that is
  /// within a body sees the layers ahead through it, so that this body's
  /// surface goes before them; otherwise the nearest is the first on the ray
  template <class Fit>
  [[nodiscard]] std::size_t best(const std::vector<FacetHit<M>>& layers,
                                 Fit&& fit) const
  {
    std::size_t best = none;
    for (std::size_t k = 0; k < layers.size(); ++k)
    {
      if (not layers[k].is_hit() or not fit(k))
        continue;
      const auto rank = [&](std::size_t i) {
        return std::pair{not is_within(layers[i]), std::abs(layers[i].hit.g)};
      };
      if (best == none or rank(k) < rank(best))
        best = k;
    }
    return best;
  }

  /// A point stays with the layer that it was paired with, as long as that is
  /// not behind another one
  [[nodiscard]] std::size_t choose()
  {
    const auto is_open = [this](std::size_t k)
    { return _layers[k].hit.g >= 0.0; };
    bool all_open = true;
    for (std::size_t k = 0; k < _layers.size(); ++k)
      all_open = all_open and is_open(k);
    if (all_open)
      return best(_layers, is_open);
    look_back();
    const std::size_t kept =
        best(_past, [this](std::size_t k) { return is_certain(_past[k]); });
    if (kept == none)
      return best(_layers,
                  [this](std::size_t k) { return is_certain(_layers[k]); });
    if (not is_open(kept))
      return kept;
    // A layer that the point penetrates has come from the side
    return best(_layers,
                [&](std::size_t k)
                {
                  const bool is_new = not _past[k].is_hit();
                  return is_open(k) or (is_new and is_certain(_layers[k]));
                });
  }

  /// Find where the point's old ray met the layers
  void look_back()
  {
    _has_looked_back = true;
    const Ray<D> ray = _rays->before(_facet, _xi);
    _past.clear();
    for (const FacetHit<M>& layer : _layers)
    {
      FacetHit<M> past = walk(ray, layer.facet, _master.x_old);
      if (past.is_hit())
        past.facing = facing(ray, past, _master.x_old);
      if (not(past.facing > tolerance::facing))
        past.hit.status = RayStatus::back_face;
      _past.push_back(past);
    }
  }

  static constexpr std::size_t max_hops = 16;
  /// Sine of the smallest angle of a master's edge. A ray that comes out at a
  /// distance d from all edges has passed one only if it is longer than this
  /// times d
  static constexpr double sharpest = 0.1;
  /// Most facets around a hit that are asked whether the ray enters by them
  static constexpr std::size_t most_around = 64;
  static constexpr auto none = static_cast<std::size_t>(-1);
  const Surface& _slave;
  const Surface& _master;
  const FacetDistances& _distances;
  const PairFilter* _filter;
  std::unique_ptr<SlaveRays<D>> _rays;
  Index _facet = no_index;                ///< of the present point
  Vec<2> _xi = Vec<2>::Zero();            ///< of the present point
  Ray<D> _ray;                            ///< of the present point
  std::array<Index, max_hops> _visited{}; ///< facets of the last walk
  std::size_t _hops = 0;
  std::vector<Index> _around;       ///< facets around the last hit
  std::vector<FacetHit<M>> _layers; ///< that the present ray meets
  std::vector<FacetHit<M>> _past;   ///< the same, of the old ray
  bool _has_looked_back = false;
};
} // namespace raymortar
