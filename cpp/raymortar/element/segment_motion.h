// What the motion of segments adds to tangents, of facets of any kind.
#pragma once

#include "raymortar/element/point_kernel.h"
#include "raymortar/element/segment_points.h"
#include "raymortar/element/segment_target.h"

namespace raymortar
{
/// @brief What the motion of segments adds to an element's tangent, see
/// MovingSegments.
template <int D>
class SegmentMotion
{
public:
  static constexpr int T = D - 1;
  /// Its sides are straight where those of a facet's plane are
  using Plane = std::conditional_t<D == 2, FacetType<Shape::interval, 1, 1>,
                                   FacetType<Shape::quadrilateral, 1, 1>>;

  /// @brief An element whose points are being added.
  struct Element
  {
    const ContactState& state;
    std::size_t number;
    Eigen::Index alone; ///< unknowns without the target's
    BlockExpansion::Block& A;
    const CouplingSink& couplings;
    FlatMap<Plane> map;
  };

  /// @param[in] sides Of the point
  void add(const Element& e, std::size_t q, const ElementColumns& sides,
           const PointBlocks<D>& at)
  {
    const Index segment = e.state.points.segment[q];
    if (segment != _segment)
    {
      finish(e);
      take(e, segment);
    }
    Eigen::Matrix<double, Eigen::Dynamic, 1 + T, Eigen::RowMajor> in(
        at.f.rows(), 1 + T),
        out(unknowns_of(sides), 1 + T);
    in << at.f, at.f_xi;
    expand_rows(sides, in.data(), 1 + T, out.data());
    bend_tests(e.state.slave, e.state.points.xi[q], at.f,
               out.template rightCols<T>());
    const auto change = change_in_plane<Plane, Eigen::Dynamic>(
        e.map, e.state.points.xi[q].template head<T>(),
        e.state.points.weight[q], out.col(0), out.template rightCols<T>());
    _points.visit(e.state.segment_rules,
                  static_cast<std::size_t>(e.state.points.place[q]),
                  [&](std::size_t v, double N, const Mat<1, T>& dJ) {
                    _by_vertex[v] += N * change.by_y + change.by_measure * dJ;
                  });
  }

  /// @brief Vertices' share, after the last point of an element.
  void finish(const Element& e)
  {
    if (_segment != no_index)
      flush(e,
            e.state.segmentation.segments[static_cast<std::size_t>(_segment)]);
    _segment = no_index;
  }

private:
  using Points = SegmentPoints<Plane>;
  using Sum = Mat<Eigen::Dynamic, T>;

  /// Add that the gradients of the slave's test functions change along the
  /// facet
  /// @param[in] f Integrand over the coefficients, [value, gradients] first
  template <class Rates>
  static void bend_tests(const Surface& slave, const Vec<2>& xi,
                         const typename PointBlocks<D>::Vector& f, Rates&& f_xi)
  {
    const Vec<D* T> by_gradients = f.template segment<D * T>(D);
    if (by_gradients.isZero(0.0))
      return;
    const auto N = shape_taylor<T>(slave.shape, slave.degree,
                                   Vec<T>(xi.template head<T>()));
    for (int j = 0; j < T; ++j)
      for (int i = 0; i < T; ++i)
        for (Eigen::Index a = 0; a < N.rows(); ++a)
          f_xi.col(j).template segment<D>(a * D) +=
              N(a, 1 + T + i + j) * by_gradients.template segment<D>(i * D);
  }

  void take(const Element& e, Index number)
  {
    _segment = number;
    const Segment& segment =
        e.state.segmentation.segments[static_cast<std::size_t>(number)];
    _points.take(e.state.segmentation, segment, e.map);
    for (std::size_t v = 0; v < static_cast<std::size_t>(segment.size); ++v)
      _by_vertex[v].setZero(e.A.rows(), T);
    if (_points.has_centre())
      _by_vertex[Points::centre].setZero(e.A.rows(), T);
  }

  void flush(const Element& e, const Segment& of)
  {
    const ContactState& s = e.state;
    const SegmentTarget<D> target(s, of);
    const Index hit = target_of(s, e.number);
    const bool own = target.number() == hit;
    const Eigen::Index columns = target.unknowns();
    const Eigen::Index size = e.alone + columns;
    const Eigen::Index hit_rows = e.A.rows() - e.alone;
    if (not own)
    {
      _coupling.setZero(size, size);
      _hit_rows.setZero(hit_rows, columns);
    }
    _points.share_centre(_by_vertex);
    for (std::size_t v = 0; v < static_cast<std::size_t>(of.size); ++v)
    {
      const std::size_t at = static_cast<std::size_t>(of.begin) + v;
      if (s.segmentation.breaks[at].motion == Break::Motion::fixed)
        continue;
      const auto motion = target.motion(at);
      const Sum by_xi =
          _by_vertex[v] *
          e.map.gradient(s.segmentation.vertices[at].template head<T>());
      e.A.leftCols(motion.by_slave.cols()) += by_xi * motion.by_slave;
      const Eigen::MatrixXd by_target = by_xi * target.columns(motion);
      if (own)
        e.A.rightCols(columns) += by_target;
      else
      {
        _coupling.topRightCorner(e.alone, columns) +=
            by_target.topRows(e.alone);
        _hit_rows += by_target.bottomRows(hit_rows);
      }
    }
    if (not own and columns > 0)
      e.couplings(e.number, target.number(), _coupling.data(),
                  static_cast<int>(size),
                  hit == no_index ? nullptr : _hit_rows.data());
  }

  Index _segment = no_index;
  Points _points;
  std::array<Sum, Points::capacity + 1> _by_vertex;
  BlockExpansion::Block _coupling, _hit_rows;
};
} // namespace raymortar
