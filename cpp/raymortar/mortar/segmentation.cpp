#include "raymortar/mortar/segmentation.h"
#include "raymortar/geometry/dispatch.h"
#include "raymortar/geometry/patch.h"
#include "raymortar/mortar/layers.h"

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

/// Share of the slave patch that the plane coordinates give measure one to
template <class F>
constexpr double patch_measure()
{
  return F::shape == Shape::triangle ? 0.5 : 1.0;
}

template <class F>
class Segmenter
{
public:
  static constexpr int D = F::gdim;

  Segmenter(const Surface& slave, const Surface& master,
            const SegmentationOptions& options)
      : _slave(slave), _master(master), _options(options),
        _patches(patches<F>(options.subdivide))
  {
    _out.covered.assign(static_cast<std::size_t>(slave.num_facets()), 0.0);
  }

  void add(Index facet, std::span<const Index> masters)
  {
    const typename F::NodeMatrix nodes =
        _slave.template nodes<F>(_slave.x, facet);
    bool usable = true;
    for (std::size_t k = 0; k < _patches.size(); ++k)
    {
      const SlavePatch<F> patch(nodes, _patches[k]);
      usable = usable and patch.plane.valid;
      if (not patch.plane.valid)
        continue;
      _pieces.clear();
      for (const Index m : masters)
        overlap_with(patch, m);
      keep_nearest<D>(_pieces, patch_measure<F>(), _options.reach,
                      _options.depth);
      for (const Piece<D>& piece : _pieces)
        emit(facet, static_cast<std::int8_t>(k), patch, nodes, piece);
    }
    if (not usable)
      _out.degenerate.push_back(facet);
  }

  [[nodiscard]] Segmentation result() && { return std::move(_out); }

private:
  void overlap_with(const SlavePatch<F>& slave, Index master)
  {
    const typename F::NodeMatrix nodes =
        _master.template nodes<F>(_master.x, master);
    for (std::size_t k = 0; k < _patches.size(); ++k)
    {
      const auto seen = project_patch<D>(
          slave.plane, patch_corners<F>(nodes, _patches[k]), _patches[k].size);
      // Curved facets rise over their linear patch: the rays decide later
      const double slack = 0.25 * slave.plane.size;
      if (seen.size == 0 or seen.lowest > _options.reach + slack or
          seen.highest < -_options.depth - slack)
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

  void clip(const SlavePatch<F>& slave, const ProjectedPatch<D>& master,
            std::array<Index, 2> of)
  {
    ++_out.clipped;
    const Region<D> region = overlap(slave.y, slave.count, master);
    if (measure_of(region) > tolerance::segment_area)
      _pieces.push_back(
          {region, of[0], static_cast<std::int8_t>(of[1]), master});
  }

  void emit(Index facet, std::int8_t slave_patch, const SlavePatch<F>& patch,
            const typename F::NodeMatrix& nodes, const Piece<D>& piece)
  {
    const auto begin = static_cast<std::int32_t>(_out.vertices.size());
    for (std::size_t i = 0; i < static_cast<std::size_t>(piece.region.size);
         ++i)
    {
      const Provenance& from = piece.region.provenance[i];
      Vec<2> xi = Vec<2>::Zero();
      xi.template head<F::tdim>() = vertex(patch, nodes, piece, i);
      _out.vertices.push_back(xi);
      _out.provenance.push_back(from);
    }
    const double share = reference_measure(begin) / F::Ref::measure;
    if (not(share > tolerance::segment_area))
    {
      _out.vertices.resize(static_cast<std::size_t>(begin));
      _out.provenance.resize(static_cast<std::size_t>(begin));
      return;
    }
    _out.covered[static_cast<std::size_t>(facet)] += share;
    _out.segments.push_back({facet, piece.master, slave_patch,
                             piece.master_patch, begin, piece.region.size});
  }

  /// Corners of the slave are exact; everything else is mapped back
  [[nodiscard]] typename F::RefPoint vertex(const SlavePatch<F>& patch,
                                            const typename F::NodeMatrix& nodes,
                                            const Piece<D>& piece,
                                            std::size_t i) const
  {
    const Provenance& from = piece.region.provenance[i];
    if (from.kind == Provenance::Kind::slave_corner)
      return patch.xi[static_cast<std::size_t>(from.slave)];
    if constexpr (D == 2)
    {
      const typename F::RefPoint guess =
          patch.to_reference(Vec<1>(piece.region.points[i]));
      if (F::node_degree == 1 or from.kind != Provenance::Kind::master_corner)
        return guess;
      const Patch& cut = _patches[static_cast<std::size_t>(piece.master_patch)];
      const auto corner = static_cast<std::size_t>(from.master);
      const auto masters = _master.template nodes<F>(_master.x, piece.master);
      return seen_from_curve(nodes, masters.col(cut.node[corner]), guess);
    }
    else
      return patch.to_reference(piece.region.points[i]);
  }

  /// Where the slave ray through a master node starts on a curved slave:
  /// (x_node - x_s(xi)) . t(xi) = 0. Segments of both masters that share the
  /// node break at the same xi.
  [[nodiscard]] static typename F::RefPoint
  seen_from_curve(const typename F::NodeMatrix& nodes,
                  const typename F::Point& node, typename F::RefPoint xi)
  {
    for (int step = 0; step < 10; ++step)
    {
      const Frame<D> f = frame_at<F>(nodes, xi);
      const Vec<F::tdim> dxi =
          (f.t.transpose() * f.t).inverse() * (f.t.transpose() * (node - f.x));
      xi += dxi;
      if (not(dxi.cwiseAbs().maxCoeff() > 1e-2 * tolerance::ray_step))
        break;
    }
    return xi.cwiseMax(0.0).cwiseMin(1.0);
  }

  [[nodiscard]] double reference_measure(std::int32_t begin) const
  {
    const std::span v =
        std::span(_out.vertices).subspan(static_cast<std::size_t>(begin));
    if constexpr (D == 2)
      return v[1][0] - v[0][0];
    double twice = 0.0;
    for (std::size_t i = 0; i < v.size(); ++i)
    {
      const Vec<2>& a = v[i];
      const Vec<2>& b = v[(i + 1) % v.size()];
      twice += a[0] * b[1] - a[1] * b[0];
    }
    return 0.5 * twice;
  }

  const Surface& _slave;
  const Surface& _master;
  SegmentationOptions _options;
  std::span<const Patch> _patches;
  std::vector<Piece<D>> _pieces;
  Segmentation _out;
};
} // namespace

Segmentation make_segments(const Surface& slave, const Surface& master,
                           const Candidates& candidates,
                           const SegmentationOptions& options)
{
  return with_facet_type(slave,
                         [&]<class F>(F)
                         {
                           Segmenter<F> segmenter(slave, master, options);
                           for (Index f = 0; f < slave.num_facets(); ++f)
                             segmenter.add(f, candidates.masters_of(f));
                           return std::move(segmenter).result();
                         });
}
} // namespace raymortar
