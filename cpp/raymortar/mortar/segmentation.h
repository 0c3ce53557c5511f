// Candidate pairs -> segments: the parts of slave facets that see one master.
#pragma once

#include "raymortar/geometry/tiles.h"
#include "raymortar/mortar/breaks.h"
#include "raymortar/mortar/overlap.h"
#include "raymortar/pairing/candidates.h"
#include <algorithm>
#include <functional>

namespace raymortar
{
/// @brief Part of one slave facet that faces one master facet.
struct Segment
{
  Index slave;
  Index master;
  std::int8_t slave_patch;  ///< linear patch of the slave facet
  std::int8_t master_patch; ///< linear patch of the master facet
  std::int32_t begin;       ///< first vertex
  std::int32_t size;        ///< vertices: 2 in 2D, 3 to 8 in 3D
};

/// @brief Masters that lie over the same places as those of some segments.
class LayerRivals
{
public:
  /// @param[in] segment Larger than all before
  void add(Index segment, std::span<const Index> masters)
  {
    _segments.push_back(segment);
    _masters.insert(_masters.end(), masters.begin(), masters.end());
    _offsets.push_back(_masters.size());
  }

  /// Masters that the points of a segment try besides its own
  [[nodiscard]] std::span<const Index> of(Index segment) const
  {
    const auto at =
        std::lower_bound(_segments.begin(), _segments.end(), segment);
    if (at == _segments.end() or *at != segment)
      return {};
    const auto k = static_cast<std::size_t>(at - _segments.begin());
    return std::span(_masters).subspan(_offsets[k],
                                       _offsets[k + 1] - _offsets[k]);
  }

private:
  std::vector<Index> _segments; ///< those that have any, ascending
  std::vector<std::size_t> _offsets = {0};
  std::vector<Index> _masters;
};

/// @brief Segments of all slave facets, in order of the slave facet.
struct Segmentation
{
  std::vector<Segment> segments;
  std::vector<Vec<2>> vertices; ///< slave reference coordinates
  std::vector<Provenance> provenance;
  std::vector<Break> breaks;     ///< how each vertex moves
  std::vector<double> covered;   ///< share of each slave facet, (slaves,)
  std::vector<Index> degenerate; ///< slave facets without a usable normal
  bool subdivided = false;   ///< patches are those of facets that were split
  LayerRivals rivals;        ///< where layers of master lie over each other
  bool hang_on_past = false; ///< layers were chosen by the old positions
  std::int64_t clipped = 0;  ///< patch pairs that were clipped

  [[nodiscard]] std::span<const Break> breaks_of(const Segment& segment) const
  {
    return std::span(breaks).subspan(static_cast<std::size_t>(segment.begin),
                                     static_cast<std::size_t>(segment.size));
  }

  /// Tiles on which a polygon is integrated
  [[nodiscard]] Tiles tiles(const Segment& segment) const
  {
    return tiles_of(
        std::span(vertices).subspan(static_cast<std::size_t>(segment.begin),
                                    static_cast<std::size_t>(segment.size)));
  }
};

/// @brief Which of two masters a place of a slave facet is paired with: see
/// LayerOrder.
using FacetOrder = std::function<int(Index slave, const Vec<2>& xi, Index first,
                                     Index second)>;

/// @brief What the segmentation needs to know besides the surfaces.
struct SegmentationOptions
{
  FacetDistances distances; ///< reach and depth that count
  bool subdivide = false;   ///< split quadratic facets at their mid nodes
  FacetOrder order;         ///< none: rays on the master

  SegmentationOptions(FacetDistances range, bool split)
      : distances(std::move(range)), subdivide(split)
  {
  }
  SegmentationOptions(double reach, double depth, bool split)
      : SegmentationOptions(FacetDistances(reach, depth), split)
  {
  }
};

/// @brief Project, clip and collect, slave facet by slave facet.
///
/// The master facet is projected along the normal at the slave patch's
/// barycentre into its plane and clipped against it. All masters share one
/// direction and one plane per slave patch, so that segments of neighbouring
/// masters meet in the same edge: they tile the covered part. Where two
/// layers of master overlap, the true ray decides which one keeps the place.
///
/// This clip of flat patches decides which corners and edges meet. On curved
/// and warped facets every vertex is then moved to where the *true* corner or
/// edge is seen along the slave's rays. Neighbours share their vertices before
/// and after, so that they still tile: areas are signed, as polygons thinner
/// than this move may turn over.
[[nodiscard]] Segmentation make_segments(const Surface& slave,
                                         const Surface& master,
                                         const Candidates& candidates,
                                         const SegmentationOptions& options);
} // namespace raymortar
