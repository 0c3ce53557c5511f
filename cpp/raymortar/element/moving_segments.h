// What the motion of segments adds to the tangent of an element.
#pragma once

#include "raymortar/element/element_point.h"
#include "raymortar/element/surface_gradient.h"
#include "raymortar/element/vertex_motion.h"
#include "raymortar/mortar/flat_map.h"

namespace raymortar
{
/// @brief Derivative of an element's residual through the vertices of its
/// segments, their points and weights.
///
/// A segment's points and weights are functions of its vertices, and those of
/// the bodies. Points of one segment are summed into one small matrix per
/// vertex first, times the motion of the vertex last  [theory (3.8)].
template <class F, int L, class Law>
class MovingSegments
{
public:
  using Kernel = raymortar::Element<F, L, Law>;
  using Layout = typename Kernel::Layout;
  using Data = typename Kernel::Data;
  static constexpr int T = F::tdim;

  /// @brief An element whose points are being added.
  struct Element
  {
    const ContactState& state;
    std::size_t number;
    const Data& data;
    /// Tangent at fixed points, to which the motion adds
    typename Kernel::Matrix& A;
    /// Takes the columns of masters that are not the element's own
    const CouplingSink& couplings;
    FlatMap<F> map;
  };

  /// @brief Add point q of element e, in the order of its points.
  /// @param[in] integrand Gives the Integrand there
  template <class Make>
  void add(const Element& e, std::size_t q, Make&& integrand)
  {
    const Index segment = e.state.points.segment[q];
    if (segment != _segment)
    {
      finish(e);
      _segment = segment;
      place_vertices(e.state, segment, e.map);
    }
    add_point(e.state, q, e.map, integrand());
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
  using Flat = typename F::RefPoint;
  static constexpr std::size_t capacity = Tiles::capacity;
  using Sum = Mat<Layout::size, T>;

  /// Place of the mean of the core after all vertices
  static constexpr auto centre = static_cast<std::size_t>(Tiles::centre);

  /// What a point changes by its place y in the segment's plane, and by the
  /// measure of its tile per weight of the rule
  struct Change
  {
    Sum by_y;
    Vec<Layout::size> by_measure;
  };

  /// Vertices of a segment, and the mean of its core, in the plane in which its
  /// sides are straight
  void place_vertices(const ContactState& s, Index number,
                      const FlatMap<F>& map)
  {
    const Segment& segment =
        s.segmentation.segments[static_cast<std::size_t>(number)];
    for (std::size_t v = 0; v < static_cast<std::size_t>(segment.size); ++v)
    {
      const auto k = static_cast<std::size_t>(segment.begin) + v;
      _y[v] = map.to_flat(s.segmentation.vertices[k].template head<T>());
      _by_vertex[v].setZero();
    }
    if constexpr (T == 2)
    {
      _tiles = s.segmentation.tiles(segment);
      if (_tiles.has_centre())
      {
        _y[centre] = mean_of_core(_tiles, _y);
        _by_vertex[centre].setZero();
      }
    }
  }

  void add_point(const ContactState& s, std::size_t q, const FlatMap<F>& map,
                 const Integrand<F, L, Law>& at)
  {
    const double weight = s.points.weight[q];
    Change change;
    if constexpr (not FlatMap<F>::is_map)
    {
      change.by_y = weight * at.f_xi;
      change.by_measure = at.f;
    }
    else
    {
      const typename F::RefPoint xi = s.points.xi[q].template head<T>();
      const typename FlatMap<F>::Gradient G = map.gradient(xi);
      const Mat<T, T> to_y = weight * G.inverse();
      const Mat<1, T> log_det = map.log_det_gradient(xi).transpose() * to_y;
      for (int t = 0; t < T; ++t)
        change.by_y.col(t) = at.f_xi.col(0) * to_y(0, t) +
                             at.f_xi.col(1) * to_y(1, t) - log_det[t] * at.f;
      change.by_measure = at.f / G.determinant();
    }
    add_in_tile(change, s.segment_rules,
                static_cast<std::size_t>(s.points.place[q]));
  }

  /// By the rule that append_on_polygon took, and its place in there
  void add_in_tile(const Change& change, const SegmentRules& rules,
                   std::size_t place)
  {
    if constexpr (T == 1)
      add_on<Shape::interval>(change, rules.simplex, place, {0, 1});
    else
    {
      const Tile* tile = _tiles.tiles.data();
      while (place >= rules.on(tile->kind).weights.size())
        place -= rules.on((tile++)->kind).weights.size();
      const QuadratureRule& rule = rules.on(tile->kind);
      const auto& [a, b, c, d] = tile->corners;
      const auto at = [](std::int8_t v) { return static_cast<std::size_t>(v); };
      if (tile->kind == Tile::Kind::quadrilateral)
        add_on<Shape::quadrilateral>(change, rule, place,
                                     {at(a), at(b), at(d), at(c)});
      else
        add_on<Shape::triangle>(change, rule, place, {at(a), at(b), at(c)});
    }
  }

  /// Point k of a rule under the map of some vertices
  template <Shape P>
  void add_on(const Change& change, const QuadratureRule& rule, std::size_t k,
              const std::array<std::size_t, Reference<P>::corners>& corners)
  {
    constexpr int count = Reference<P>::corners;
    const Flat r = rule.points[k].template head<T>();
    const Vec<count> N = Lagrange<P, 1>::values(r);
    const Mat<count, T> dN = Lagrange<P, 1>::gradients(r);
    Mat<T, T> J = Mat<T, T>::Zero();
    for (int c = 0; c < count; ++c)
      J += _y[corners[static_cast<std::size_t>(c)]] * dN.row(c);
    const Mat<count, T> dJ = rule.weights[k] * dN * adjugate(J);
    for (int c = 0; c < count; ++c)
    {
      Sum& sum = _by_vertex[corners[static_cast<std::size_t>(c)]];
      for (int t = 0; t < T; ++t)
        sum.col(t) += N[c] * change.by_y.col(t) + dJ(c, t) * change.by_measure;
    }
  }

  /// det(J) J^-1: the derivative of det(J) by a corner is its row of dN times
  /// this, also where the tile has no area
  [[nodiscard]] static Mat<T, T> adjugate(const Mat<T, T>& J)
  {
    if constexpr (T == 1)
      return Mat<T, T>::Identity();
    else
    {
      Mat<T, T> adj;
      adj << J(1, 1), -J(0, 1), -J(1, 0), J(0, 0);
      return adj;
    }
  }

  void flush(const Element& e, const Segment& of)
  {
    constexpr int side = Layout::side;
    const ContactState& s = e.state;
    const Index hit = s.elements.master[e.number];
    const bool own = of.master == hit;
    const auto master = s.master.template nodes<F>(s.master.x, of.master);
    if (not own)
    {
      _coupling.setZero();
      _hit_rows.setZero();
    }
    share_centre();
    for (std::size_t v = 0; v < static_cast<std::size_t>(of.size); ++v)
    {
      const std::size_t at = static_cast<std::size_t>(of.begin) + v;
      const Break& hangs_on = s.segmentation.breaks[at];
      if (hangs_on.motion == Break::Motion::fixed)
        continue;
      const typename F::RefPoint xi =
          s.segmentation.vertices[at].template head<T>();
      const Motion dy = e.map.gradient(xi) *
                        segment_vertex_motion<F>(s.segmentation, of,
                                                 e.data.slave, master, at);
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

  /// The mean of the core moves with each of its vertices
  void share_centre()
  {
    if (T == 1 or not _tiles.has_centre())
      return;
    for (int v = 0; v < _tiles.core_size; ++v)
      _by_vertex[static_cast<std::size_t>(
          _tiles.core[static_cast<std::size_t>(v)])] +=
          _by_vertex[centre] / static_cast<double>(_tiles.core_size);
  }

  using Motion = Eigen::Matrix<double, T, 2 * Layout::side, Eigen::RowMajor>;

  /// Add some rows of A times one side's columns of dy to the rows of a block
  template <int First, int Count, class Block>
  static void add_motion(const Sum& A, const Motion& dy, int from, Block& block,
                         int to)
  {
    constexpr int side = Layout::side;
    for (int i = 0; i < Count; ++i)
    {
      const int r = First + i;
      auto row = block.row(i).template segment<side>(to);
      if constexpr (T == 1)
        row += A(r, 0) * dy.template segment<side>(from);
      else
        row += A(r, 0) * dy.row(0).template segment<side>(from) +
               A(r, 1) * dy.row(1).template segment<side>(from);
    }
  }

  Index _segment = no_index; ///< that of the points being added
  Tiles _tiles;              ///< of that
  std::array<Flat, capacity + 1> _y;
  std::array<Sum, capacity + 1> _by_vertex;
  typename Kernel::Matrix _coupling;
  Eigen::Matrix<double, Layout::side, Layout::side, Eigen::RowMajor> _hit_rows;
};
} // namespace raymortar
