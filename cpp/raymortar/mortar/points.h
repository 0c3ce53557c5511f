// Segments -> integration points, and points -> rays on the true master.
#pragma once

#include "raymortar/geometry/quadrature.h"
#include "raymortar/geometry/ray.h"
#include "raymortar/mortar/segmentation.h"

namespace raymortar
{
/// @brief Integration points of a contact zone, in order of the slave facet.
///
/// Fixed between re-pairings: the tangent at fixed points differentiates the
/// integrand at these xi with these weights.
struct IntegrationPoints
{
  std::vector<Vec<2>> xi;     ///< slave reference coordinates
  std::vector<double> weight; ///< in reference coordinates
  /// Weight times reference surface Jacobian; of surfaces of revolution times
  /// the reference circumference
  std::vector<double> area;
  std::vector<Index> slave;    ///< slave facet
  std::vector<Index> seed;     ///< master of the segment, no_index: uncovered
  std::vector<Index> segment;  ///< no_index: of the rule of the whole facet
  std::vector<Index> place;    ///< number within the segment: tile by tile
  std::vector<double> covered; ///< segments' area, per slave facet
  std::vector<double> whole;   ///< reference area per slave facet
  std::vector<double> width;   ///< of each slave facet, h_f of (5.5). Length
  LayerRivals rivals;          ///< other masters that points may meet

  [[nodiscard]] std::size_t size() const { return xi.size(); }
};

/// @brief Quadrature on every segment and on what the segments leave out.
///
/// The uncovered part of a slave facet is its full rule minus the points of
/// its segments (negative weights): exact on affine facets. No equation is
/// integrated there, but results are, such as the share that is covered.
/// @param[in] facet_rule Rule of the whole facet
/// @param[in] complement Whether the uncovered part is asked for: only a
/// multiplier lives there
/// @param[in] of_revolution Whether areas are of the surfaces that the facets
/// make in a full turn about the axis r = 0, in 2D [theory (2.12)]
[[nodiscard]] IntegrationPoints
make_points(const Surface& slave, const Segmentation& segmentation,
            const SegmentRules& segment_rules, const QuadratureRule& facet_rule,
            bool complement, bool of_revolution = false);

/// @brief Where the rays of the integration points meet the master.
struct Hits
{
  std::vector<RayStatus> status; ///< anything but hit: no contact here
  std::vector<Index> master;     ///< facet that was hit, no_index without
  std::vector<Vec<2>> eta;       ///< its reference coordinates
  std::vector<double> gap;       ///< g of (1), length
  bool hang_on_past = false;     ///< some were chosen by the old positions
  /// Of tools, which have no facets: see ToolHit, (points,) each
  std::vector<Vec<3>> normal = {};
  std::vector<Mat<3, 3>> bend = {};
  std::vector<std::int8_t> flat = {};
};

/// @brief Cast the ray of every covered point on the true deformed master.
///
/// Newton from the flat guess on the segment's master; where eta leaves the
/// facet the ray is handed to the neighbour across that edge. Where layers of
/// master lie over each other, the rays decide which one a point meets.
/// @param[in] range Reach and depth: a depth is one head on, times the cosine
/// of a ray's incidence otherwise
[[nodiscard]] Hits cast_rays(const Surface& slave, const Surface& master,
                             const IntegrationPoints& points,
                             const FacetDistances& range);
} // namespace raymortar
