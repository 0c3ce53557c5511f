// Moving segments: their contribution to an element's tangent.
#pragma once

#include "raymortar/element/element_point.h"
#include "raymortar/element/segment_points.h"
#include "raymortar/element/surface_gradient.h"
#include "raymortar/element/vertex_motion.h"

namespace raymortar
{
/// @brief Derivative of an element's residual through the vertices of its
/// segments, their points and weights.
///
/// A segment's points and weights are functions of its vertices, and those of
/// the bodies. Points of one segment are summed into one small matrix per
/// vertex first, times the motion of the vertex last  [theory (3.8)].
template <class F, class Layout>
class MovingSegments
{
public:
  using Matrix =
      Eigen::Matrix<double, Layout::size, Layout::size, Eigen::RowMajor>;
  static constexpr int T = F::tdim;

  /// @brief An element whose points are being added.
  struct Element
  {
    const ContactState& state;
    std::size_t number;
    const typename F::NodeMatrix& slave; ///< deformed nodes. Length
    /// Tangent at fixed points, to which the motion adds
    Matrix& A;
    /// Takes the columns of masters that are not the element's own
    const CouplingSink& couplings;
    std::optional<FlatMap<F>>
        map; ///< of the slave facet; set wherever it is called
  };

  /// @brief Add point q of element e, in the order of its points.
  void add(const Element& e, std::size_t q,
           const Integrand<F, Layout>& integrand)
  {
    const Index segment = e.state.points.segment[q];
    if (segment != _segment)
    {
      finish(e);
      _segment = segment;
      take(e.state, *e.map);
    }
    add_point(e.state, q, *e.map, integrand);
  }

  /// @brief Vertices' share of the tangent, after the last point of an element.
  void finish(const Element& e)
  {
    if (_segment != no_index)
      flush(e,
            e.state.segmentation.segments[static_cast<std::size_t>(_segment)]);
    _segment = no_index;
  }

private:
  using Points = SegmentPoints<F>;
  using Sum = Mat<Layout::size, T>;

  void add_point(const ContactState& s, std::size_t q, const FlatMap<F>& map,
                 const Integrand<F, Layout>& at)
  {
    const auto change =
        change_in_plane<F, Layout::size>(map, s.points.xi[q].template head<T>(),
                                         s.points.weight[q], at.f, at.f_xi);
    _points.visit(
        s.segment_rules, static_cast<std::size_t>(s.points.place[q]),
        [&](std::size_t v, double N, const Mat<1, T>& dJ)
        {
          for (int t = 0; t < T; ++t)
          {
            const double* const by_y = change.by_y.data() + t * Layout::size;
            double* const sum = _by_vertex[v].data() + t * Layout::size;
            for (int r = 0; r < Layout::size; ++r)
              sum[r] += N * by_y[r] + dJ[t] * change.by_measure.data()[r];
          }
        });
  }

  /// Begin a segment
  void take(const ContactState& s, const FlatMap<F>& map)
  {
    const Segment& segment =
        s.segmentation.segments[static_cast<std::size_t>(_segment)];
    _points.take(s.segmentation, segment, map);
    for (std::size_t v = 0; v < static_cast<std::size_t>(segment.size); ++v)
      _by_vertex[v].setZero();
    if (_points.has_centre())
      _by_vertex[Points::centre].setZero();
  }

  void flush(const Element& e, const Segment& of)
  {
    constexpr int side = Layout::side;
    const ContactState& s = e.state;
    const Index hit = s.elements.master[e.number];
    const bool own = of.master == hit;
    const MasterNodes<F> master{
        s.master.template nodes<F>(s.master.x, of.master)};
    if (not own)
    {
      _coupling.setZero();
      _hit_rows.setZero();
    }
    _points.share_centre(
        [this](std::size_t v, double share)
        {
          add_scaled<T * Layout::size>(share, _by_vertex[Points::centre].data(),
                                       _by_vertex[v].data());
        });
    for (std::size_t v = 0; v < static_cast<std::size_t>(of.size); ++v)
    {
      const std::size_t at = static_cast<std::size_t>(of.begin) + v;
      const Break& hangs_on = s.segmentation.breaks[at];
      if (hangs_on.motion == Break::Motion::fixed)
        continue;
      const typename F::RefPoint xi =
          s.segmentation.vertices[at].template head<T>();
      const Motion dy = rows_of<F>(
          segment_vertex_motion<F>(s.segmentation, of, e.slave, master, at),
          e.map->gradient(xi));
      add_motion<0, Layout::size>(_by_vertex[v], dy, 0, e.A, 0);
      if (own)
        add_motion<0, Layout::size>(_by_vertex[v], dy, side, e.A,
                                    Layout::master);
      else
      {
        add_motion<0, Layout::alone>(_by_vertex[v], dy, side, _coupling,
                                     Layout::master);
        add_motion<Layout::master, side>(_by_vertex[v], dy, side, _hit_rows, 0);
      }
    }
    if (not own)
      e.couplings(e.number, of.master, _coupling.data(), Layout::size,
                  hit == no_index ? nullptr : _hit_rows.data());
  }

  using Motion = MotionRows<F>;

  /// Add some rows of A times one side's columns of dy to the rows of a block
  template <int First, int Count, class Block>
  static void add_motion(const Sum& A, const Motion& dy, int from, Block& block,
                         int to)
  {
    constexpr int side = Layout::side;
    constexpr int width = Block::ColsAtCompileTime;
    const double* const first = dy.data() + from;
    for (int i = 0; i < Count; ++i)
    {
      double* const row = block.data() + i * width + to;
      const double by_first = A(First + i, 0);
      for (int k = 0; k < side; ++k)
        if constexpr (T == 1)
          row[k] += by_first * first[k];
        else
          row[k] += by_first * first[k] + A(First + i, 1) * first[k + 2 * side];
    }
  }

  Index _segment = no_index; ///< that of the points being added
  Points _points;
  std::array<Sum, Points::capacity + 1> _by_vertex;
  Matrix _coupling;
  Eigen::Matrix<double, Layout::side, Layout::side, Eigen::RowMajor> _hit_rows;
};
} // namespace raymortar
