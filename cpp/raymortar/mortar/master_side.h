// Data of a master that the segments of a slave need, for any type of facets.
#pragma once

#include "raymortar/geometry/patch.h"
#include "raymortar/mortar/breaks.h"
#include "raymortar/mortar/plane.h"
#include "raymortar/mortar/ray_caster.h"
#include "raymortar/mortar/segmentation.h"
#include <array>
#include <span>
#include <vector>

namespace raymortar
{
/// @brief A master whose type of facets the segmenter of a slave does not know.
///
/// @tparam S Geometry of the slave's facets
template <class S>
class MasterSide
{
public:
  static constexpr int T = S::tdim;
  static constexpr int D = S::gdim;
  using RefPoint = typename S::RefPoint;

  /// @tparam F Type of its facets
  template <class F>
  MasterSide(const Surface& surface, bool subdivide, F)
      : patches(raymortar::patches<F>(subdivide)), affine(F::affine),
        flat(F::node_degree == 1), _surface(surface), _nodes(F::nodes)
  {
    for (const Patch& patch : patches)
      eta.push_back(patch_reference<F>(patch));
  }
  virtual ~MasterSide() = default;

  [[nodiscard]] std::array<Vec<D>, 4> corners(Index facet,
                                              const Patch& patch) const
  {
    const Index* const nodes =
        _surface.facet_nodes.data() + static_cast<std::size_t>(facet) * _nodes;
    std::array<Vec<D>, 4> at;
    for (std::size_t i = 0; i < static_cast<std::size_t>(patch.size); ++i)
      at[i] = Eigen::Map<const Vec<D>>(_surface.x.data() +
                                       D * nodes[patch.node[i]]);
    return at;
  }

  /// `cross_edges` with an edge of a facet of this side
  [[nodiscard]] virtual bool cross(const typename S::NodeMatrix& slave,
                                   const ReferenceEdge<T>& edge_s, Index facet,
                                   const ReferenceEdge<T>& edge_m, double& s,
                                   double& t) const = 0;

  /// `RayCaster::compare`
  [[nodiscard]] virtual int compare(Index slave, const Vec<2>& xi, Index first,
                                    Index second) = 0;

  [[nodiscard]] virtual bool has_looked_back() const = 0;

  const std::span<const Patch> patches;
  std::vector<std::array<RefPoint, 4>> eta; ///< corners of patches on a facet
  const bool affine;
  const bool flat; ///< facets of degree 1

private:
  const Surface& _surface;
  std::size_t _nodes; ///< of a facet
};

/// @brief A master with facets of type M.
template <class S, class M>
class MasterSideOf final : public MasterSide<S>
{
public:
  using Edge = ReferenceEdge<S::tdim>;

  MasterSideOf(const Surface& slave, const Surface& master,
               const SegmentationOptions& options, const PairFilter* filter)
      : MasterSide<S>(master, options.subdivide, M{}), _master(master),
        _rays(slave, master, options.distances, filter)
  {
  }

  /// In space; in the plane edges are corners
  [[nodiscard]] bool cross([[maybe_unused]] const typename S::NodeMatrix& slave,
                           [[maybe_unused]] const Edge& edge_s,
                           [[maybe_unused]] Index facet,
                           [[maybe_unused]] const Edge& edge_m,
                           [[maybe_unused]] double& s,
                           [[maybe_unused]] double& t) const override
  {
    if constexpr (S::gdim == 3)
      return cross_edges<S, M>(slave, edge_s,
                               _master.template nodes<M>(_master.x, facet),
                               edge_m, s, t);
    else
      return false;
  }

  [[nodiscard]] int compare(Index slave, const Vec<2>& xi, Index first,
                            Index second) override
  {
    return _rays.compare(slave, xi, first, second);
  }

  [[nodiscard]] bool has_looked_back() const override
  {
    return _rays.has_looked_back();
  }

private:
  const Surface& _master;
  RayCaster<M> _rays;
};

/// @brief One linear patch of a master facet as a slave patch sees it.
template <class S>
struct MasterPatch
{
  Index facet;
  std::size_t count;
  std::array<typename S::Point, 4> corners;
  const std::array<typename S::RefPoint, 4>& eta; ///< corners on the facet
  std::array<typename S::RefPoint, 4> y; ///< corners in plane coordinates

  MasterPatch(const MasterSide<S>& side, Index of, std::size_t patch,
              const PatchPlane<S::gdim>& plane)
      : facet(of), count(static_cast<std::size_t>(side.patches[patch].size)),
        corners(side.corners(of, side.patches[patch])), eta(side.eta[patch])
  {
    for (std::size_t i = 0; i < count; ++i)
      y[i] = plane.coordinates(corners[i]);
  }

  [[nodiscard]] ReferenceEdge<S::tdim> edge(std::size_t e) const
  {
    return {eta[e], eta[(e + 1) % count] - eta[e]};
  }
  /// Position of a point of the plane between the ends of an edge
  [[nodiscard]] double place_on_edge(std::size_t e,
                                     const typename S::RefPoint& at) const
  {
    return ReferenceEdge<S::tdim>{y[e], y[(e + 1) % count] - y[e]}.place_of(at);
  }
};
} // namespace raymortar
