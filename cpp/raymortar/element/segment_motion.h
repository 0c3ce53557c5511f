// Moving segments: their contribution to tangents.
#pragma once

#include "raymortar/element/facet_taylor.h"
#include "raymortar/element/segment_points.h"
#include "raymortar/element/segment_target.h"
#include "raymortar/element/taylor_gradient.h"

#include <utility>

namespace raymortar
{
/// @brief Derivative of an element's residual through the vertices of its
/// segments, their points and weights.
///
/// A segment's points and weights are functions of its vertices, and those of
/// the bodies. Points of one segment are summed into one small matrix per
/// vertex first, times the motion of the vertex last  [theory (3.8)].
template <int D>
class SegmentMotion
{
public:
  static constexpr int T = D - 1;
  static constexpr std::size_t most = PointShapes<D>::most;
  /// Its sides are straight where those of a facet's plane are
  using Plane = std::conditional_t<D == 2, FacetType<Shape::interval, 1, 1>,
                                   FacetType<Shape::quadrilateral, 1, 1>>;

  explicit SegmentMotion(const ContactState& s);

  /// @brief An element whose points are being added.
  struct Element
  {
    std::size_t number;
    int alone; ///< unknowns without the target's
    int size;
    double* A; ///< tangent, row-major
    const CouplingSink& couplings;
  };

  /// @brief Add point q, in the order of points.
  void add(const Element& e, std::size_t q, const AnyIntegrand<D>& at);

  /// @brief Vertices' share, after the last point of an element.
  void finish(const Element& e);

private:
  using Points = SegmentPoints<Plane>;
  using Row = std::array<double, most>;
  using Sum = std::array<Row, static_cast<std::size_t>(T)>;

  /// The plane that sides of segments are straight in: of quadrilaterals their
  /// mean plane, of others the reference facet
  [[nodiscard]] typename Plane::NodeMatrix corners(Index facet) const;

  /// Set the change of a point's integrand by its position in the plane and by
  /// the measure of its tile, per weight of the rule
  void set_change(std::size_t q, const AnyIntegrand<D>& at, int size);

  void set_mapped(const Vec<2>& xi, double weight, const AnyIntegrand<D>& at,
                  int size);

  void add_vertex(Row& sum, std::size_t t, double N, double dJ, int size) const
  {
    for (std::size_t r = 0; r < std::size_t(size); ++r)
      sum[r] += N * _by_y[t][r] + dJ * _by_measure[r];
  }

  void take(const Element& e, Index number);

  /// The sums of a vertex by the facet's own coordinates
  void to_facet(std::size_t vertex, Sum& sum, int size) const;

  /// Add rows [first, last) of the sums times some motion to a block
  /// @param[in] motion (T, columns), out Where the block's rows begin
  template <class Motion>
  static void add_product(const Sum& sum, int first, int last,
                          const Motion& motion, double* __restrict out,
                          int width)
  {
    const auto columns = static_cast<std::size_t>(motion.cols());
    Sum rows; // one after the other, so that loops over columns are vectors
    for (std::size_t t = 0; t < T; ++t)
      for (std::size_t k = 0; k < columns; ++k)
        rows[t][k] =
            motion(static_cast<Eigen::Index>(t), static_cast<Eigen::Index>(k));
    for (auto r = static_cast<std::size_t>(first); std::cmp_less(r, last);
         ++r, out += width)
      for (std::size_t k = 0; k < columns; ++k)
      {
        double change = sum[0][r] * rows[0][k];
        if constexpr (T == 2)
          change += sum[1][r] * rows[1][k];
        out[k] += change;
      }
  }

  void flush(const Element& e, const Segment& of);

  /// Share of the vertices that one facet moves
  void add_motion(const Element& e, const Segment& of,
                  const SegmentTarget<D>& target);

  const ContactState& _state;
  bool _is_map;
  FlatMap<Plane> _map;
  Index _facet = no_index;   ///< that the map is of
  Index _segment = no_index; ///< that of the points being added
  Points _points;
  std::array<Sum, Points::capacity + 1> _by_vertex;
  Sum _by_y;
  Row _scaled;
  const double* _by_measure = nullptr;
  std::array<double, most * most> _coupling, _hit_rows;
};
} // namespace raymortar
