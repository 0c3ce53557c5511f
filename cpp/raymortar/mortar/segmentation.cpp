#include "raymortar/mortar/segmentation.h"
#include "raymortar/geometry/dispatch.h"
#include "raymortar/geometry/patch.h"
#include "raymortar/mortar/filtered.h"
#include "raymortar/mortar/layers.h"
#include "raymortar/mortar/master_side.h"
#include "raymortar/mortar/reference_measure.h"

namespace raymortar
{
namespace
{
/// One linear patch of a slave facet with its plane
template <class F>
struct SlavePatch
{
  PatchPlane<F::gdim> plane;
  int count;
  std::array<typename F::RefPoint, 4> y;  ///< corners in plane coordinates
  std::array<typename F::RefPoint, 4> xi; ///< corners on the facet

  SlavePatch(const typename F::NodeMatrix& nodes, const Patch& patch)
      : count(patch.size), xi(patch_reference<F>(patch))
  {
    const auto corners = patch_corners<F>(nodes, patch);
    plane = patch_plane<F::gdim>(corners, count);
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i)
      y[i] = plane.coordinates(corners[i]);
  }

  [[nodiscard]] ReferenceEdge<F::tdim> edge(std::size_t e) const
  {
    return {xi[e], xi[(e + 1) % static_cast<std::size_t>(count)] - xi[e]};
  }

  /// Edge that a point of the plane lies on, to rounding, or -1. Coordinates
  /// are of size one
  [[nodiscard]] int edge_at(const typename F::RefPoint& at) const
  {
    if constexpr (F::tdim == 2)
      for (int i = 0; i < count; ++i)
      {
        const Vec<2>& begin = y[static_cast<std::size_t>(i)];
        const Vec<2> e = y[static_cast<std::size_t>((i + 1) % count)] - begin;
        const Vec<2> d = at - begin;
        if (std::abs(parallelogram(e, d)) <= 4.0 * tolerance::merge * e.norm())
          return i;
      }
    return -1;
  }

  /// From plane coordinates to the facet's reference coordinates
  [[nodiscard]] typename F::RefPoint
  to_reference(const typename F::RefPoint& at) const
  {
    typename F::RefPoint s = at;
    std::size_t last = F::tdim;
    if constexpr (F::shape == Shape::quadrilateral)
    {
      s = inverse_bilinear(y, at);
      last = 3;
    }
    typename F::RefPoint result = xi[0] + s[0] * (xi[1] - xi[0]);
    if constexpr (F::tdim == 2)
      result += s[1] * (xi[last] - xi[0]);
    return result;
  }
};

/// A vertex of a segment in the slave's reference coordinates
template <int T>
struct Vertex
{
  Vec<T> xi;
  Break hangs_on;
};

/// A vertex of a segment as it is stored
struct Corner
{
  Vec<2> xi;
  Provenance from;
  Break hangs_on;
};

/// Share of the slave patch that the plane coordinates give measure one to
template <class F>
constexpr double patch_measure()
{
  return F::shape == Shape::triangle ? 0.5 : 1.0;
}

template <class S>
class Segmenter
{
public:
  static constexpr int D = S::gdim;
  static constexpr int T = S::tdim;
  using RefPoint = typename S::RefPoint;

  Segmenter(const Surface& slave, MasterSide<S>& master,
            const SegmentationOptions& options)
      : _slave(slave), _master(master), _options(options),
        _patches(patches<S>(options.subdivide))
  {
    _out.covered.assign(static_cast<std::size_t>(slave.num_facets()), 0.0);
    _out.subdivided = options.subdivide;
  }

  void add(Index facet, std::span<const Index> masters)
  {
    const typename S::NodeMatrix nodes =
        _slave.template nodes<S>(_slave.x, facet);
    bool usable = true;
    _facet = facet;
    _range = _options.distances[facet];
    for (std::size_t k = 0; k < _patches.size(); ++k)
    {
      const SlavePatch<S> patch(nodes, _patches[k]);
      usable = usable and patch.plane.valid;
      if (not patch.plane.valid)
        continue;
      _pieces.clear();
      for (const Index m : masters)
        overlap_with(patch, m);
      if constexpr (D == 2)
        _uncut = _pieces;
      _rivalries = keep_nearest<D>(_pieces, patch_measure<S>(), _range.reach,
                                   _range.depth, order(patch));
      for (const Piece<D>& piece : _pieces)
        emit(facet, static_cast<std::int8_t>(k), patch, nodes, piece);
    }
    if (not usable)
      _out.degenerate.push_back(facet);
  }

  [[nodiscard]] Segmentation result() &&
  {
    _out.hang_on_past = _master.has_looked_back();
    return std::move(_out);
  }

private:
  /// Decides between layers of master by the true ray
  [[nodiscard]] auto order(const SlavePatch<S>& patch)
  {
    // No more than what std::function holds without an allocation
    return [this, &patch](Index first, Index second, const RefPoint& at)
    {
      Vec<2> xi = Vec<2>::Zero();
      xi.template head<T>() = patch.to_reference(at);
      if (_options.order)
        return _options.order(_facet, xi, first, second);
      return _master.compare(_facet, xi, first, second);
    };
  }

  /// Points of the segment that comes next try the masters that have lost to
  /// its own. Curved masters bulge out of their flat patches: those that have
  /// won against it are tried as well
  void add_rivals(Index master)
  {
    _losers.clear();
    for (const Rivalry& r : _rivalries)
    {
      if (r.winner == master)
        _losers.push_back(r.loser);
      else if (not _master.affine and r.loser == master)
        _losers.push_back(r.winner);
    }
    if (not _losers.empty())
      _out.rivals.add(static_cast<Index>(_out.segments.size()), _losers);
  }

  void overlap_with(const SlavePatch<S>& slave, Index master)
  {
    for (std::size_t k = 0; k < _master.patches.size(); ++k)
    {
      const Patch& patch = _master.patches[k];
      const auto seen = project_patch<D>(
          slave.plane, _master.corners(master, patch), patch.size);
      // Curved facets rise over their linear patch: the rays decide later
      const double slack = 0.25 * slave.plane.size;
      if (seen.size == 0 or seen.lowest > _range.reach + slack or
          seen.highest < -_range.depth - slack)
        continue;
      const std::array<Index, 2> of = {master, static_cast<Index>(k)};
      if constexpr (D == 2)
        clip(slave, seen, of);
      else
      {
        const ConvexParts parts = convex_parts(seen);
        for (std::size_t i = 0; i < static_cast<std::size_t>(parts.size); ++i)
          clip(slave, parts.part[i], of);
      }
    }
  }

  void clip(const SlavePatch<S>& slave, const ProjectedPatch<D>& master,
            std::array<Index, 2> of)
  {
    ++_out.clipped;
    const Region<D> region = overlap(slave.y, slave.count, master);
    if (measure_of(region) > tolerance::segment_area)
      _pieces.push_back(
          {region, of[0], static_cast<std::int8_t>(of[1]), master});
  }

  void emit(Index facet, std::int8_t slave_patch, const SlavePatch<S>& patch,
            const typename S::NodeMatrix& nodes, const Piece<D>& piece)
  {
    const MasterPatch<S> master = seen_by(patch, piece);
    const Region<D>& region = piece.region;
    const auto n = static_cast<std::size_t>(region.size);
    _polygon.clear();
    for (std::size_t i = 0; i < n; ++i)
    {
      const RefPoint at(region.points[i]);
      const Vertex<T> v =
          region.provenance[i].kind == Provenance::Kind::cut
              ? cut_vertex(patch, nodes, at)
              : vertex(patch, nodes, master, region.provenance[i], at);
      Vec<2> xi = Vec<2>::Zero();
      xi.template head<T>() = v.xi;
      _polygon.push_back({xi, region.provenance[i], v.hangs_on});
    }
    const double share =
        reference_measure(_polygon, &Corner::xi) / S::Ref::measure;
    if (not(std::abs(share) > tolerance::segment_area))
      return;
    const auto begin = static_cast<std::int32_t>(_out.vertices.size());
    for (const Corner& c : _polygon)
    {
      _out.vertices.push_back(c.xi);
      _out.provenance.push_back(c.from);
      _out.breaks.push_back(c.hangs_on);
    }
    _out.covered[static_cast<std::size_t>(facet)] += share;
    if (not _rivalries.empty())
      add_rivals(piece.master);
    _out.segments.push_back({facet, piece.master, slave_patch,
                             piece.master_patch, begin, region.size});
  }

  [[nodiscard]] MasterPatch<S> seen_by(const SlavePatch<S>& patch,
                                       const Piece<D>& piece) const
  {
    return MasterPatch<S>(_master, piece.master,
                          static_cast<std::size_t>(piece.master_patch),
                          patch.plane);
  }

  /// The end of a nearer layer is that of its piece before it was cut: a third
  /// layer may have taken all of it. In 3D this vertex need not be a vertex of
  /// the nearer polygon, and stays fixed
  [[nodiscard]] Vertex<T> cut_vertex(const SlavePatch<S>& patch,
                                     const typename S::NodeMatrix& nodes,
                                     const RefPoint& at) const
  {
    if constexpr (D == 2)
      for (const Piece<D>& piece : _uncut)
        for (std::size_t i = 0; i < 2; ++i)
          if (piece.region.points[i] == at[0])
            return vertex(patch, nodes, seen_by(patch, piece),
                          piece.region.provenance[i], at);
    return {patch.to_reference(at), {}};
  }

  /// Corners of the slave are exact; everything else is mapped back, and moved
  /// to the true break where that is elsewhere
  [[nodiscard]] Vertex<T> vertex(const SlavePatch<S>& patch,
                                 const typename S::NodeMatrix& nodes,
                                 const MasterPatch<S>& master,
                                 const Provenance& from,
                                 const RefPoint& at) const
  {
    if (from.kind == Provenance::Kind::slave_corner)
      return {patch.xi[static_cast<std::size_t>(from.slave)], {}};
    const Vertex<T> flat{patch.to_reference(at), {}};
    if (from.kind == Provenance::Kind::master_corner)
    {
      Vertex<T> v = under_corner(nodes, master,
                                 static_cast<std::size_t>(from.master), flat);
      // A corner on an edge of the slave is a vertex of polygons that have it
      // for a crossing: leaving the edge would open a gap
      if (const int e = S::affine ? -1 : patch.edge_at(at); e >= 0)
      {
        const ReferenceEdge<T> edge = patch.edge(static_cast<std::size_t>(e));
        v.xi = edge.at(edge.place_of(v.xi));
        v.hangs_on.motion = Break::Motion::fixed;
      }
      return v;
    }
    if constexpr (D == 3)
      if (from.kind == Provenance::Kind::crossing and from.master >= 0)
        return crossing(patch.edge(static_cast<std::size_t>(from.slave)), nodes,
                        master, static_cast<std::size_t>(from.master), at,
                        flat);
    return flat;
  }

  /// Start of the slave ray through a corner of the master
  [[nodiscard]] static Vertex<T>
  under_corner(const typename S::NodeMatrix& nodes,
               const MasterPatch<S>& master, std::size_t corner, Vertex<T> v)
  {
    v.hangs_on.eta.template head<T>() = master.eta[corner];
    v.hangs_on.motion = Break::Motion::corner;
    v.hangs_on.master = master.facet;
    if (S::affine)
      return v;
    if (not ray_through<S>(nodes, master.corners[corner], v.xi))
      v.hangs_on.motion = Break::Motion::flat_corner;
    if (D == 2 and violation<S::shape>(v.xi).amount > 0.0)
    {
      v.xi = v.xi.cwiseMax(0.0).cwiseMin(1.0);
      v.hangs_on.motion = Break::Motion::fixed;
    }
    return v;
  }

  [[nodiscard]] Vertex<T> crossing(const ReferenceEdge<T>& edge_s,
                                   const typename S::NodeMatrix& nodes,
                                   const MasterPatch<S>& master,
                                   std::size_t edge, const RefPoint& at,
                                   Vertex<T> v) const
  {
    // Straight edges seen along one normal cross where the flat patches say
    const bool is_flat = S::affine and _master.flat;
    const ReferenceEdge<T> edge_m = master.edge(edge);
    double s = edge_s.place_of(v.xi), t = master.place_on_edge(edge, at);
    if (not is_flat and
        not _master.cross(nodes, edge_s, master.facet, edge_m, s, t))
    {
      v.hangs_on = {Break::Motion::flat_crossing, edge_m.begin, edge_s.along,
                    edge_m.along, master.facet};
      return v;
    }
    if (not is_flat)
      v.xi = edge_s.at(s);
    v.hangs_on = {Break::Motion::crossing, edge_m.at(t), edge_s.along,
                  edge_m.along, master.facet};
    return v;
  }

  const Surface& _slave;
  MasterSide<S>& _master;
  const SegmentationOptions& _options;
  std::span<const Patch> _patches;
  Index _facet = no_index; ///< the present one
  SearchDistances _range;  ///< of it
  std::vector<Piece<D>> _pieces;
  std::vector<Piece<D>> _uncut;    ///< before layers are chosen; in the plane
  std::vector<Rivalry> _rivalries; ///< of the present patch
  std::vector<Index> _losers;      ///< to the present segment's master
  std::vector<Corner> _polygon;    ///< of the present segment
  Segmentation _out;
};
} // namespace

Segmentation make_segments(const Surface& slave, const Surface& master,
                           const Candidates& candidates,
                           const SegmentationOptions& options)
{
  return make_segments(slave, master, candidates, options, nullptr);
}

Segmentation make_segments(const Surface& slave, const Surface& master,
                           const Candidates& candidates,
                           const SegmentationOptions& options,
                           const PairFilter* filter)
{
  const auto segments = [&]<class S>(S, MasterSide<S>& side)
  {
    Segmenter<S> segmenter(slave, side, options);
    for (Index f = 0; f < slave.num_facets(); ++f)
      segmenter.add(f, candidates.masters_of(f));
    return std::move(segmenter).result();
  };
  return with_geometries(slave, master,
                         [&]<class S, class M>(S of, M)
                         {
                           MasterSideOf<S, M> side(slave, master, options,
                                                   filter);
                           return segments(of, side);
                         });
}
} // namespace raymortar
