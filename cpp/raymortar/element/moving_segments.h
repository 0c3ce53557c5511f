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
  using Kernel = Element<F, L, Law>;
  using Layout = typename Kernel::Layout;
  using Data = typename Kernel::Data;
  static constexpr int T = F::tdim;

  /// @brief Add to the tangent of element e.
  /// @param[in,out] kernel Its tangent at fixed points
  /// @param[in] couplings Takes the columns of masters that are not e's own.
  /// Of the rows of a master that was hit in place of the segment's own they
  /// are left out: only points between the true edge of two masters and the
  /// chord that stands for it have such
  void add(const ContactState& s, std::size_t e, const Data& data,
           Kernel& kernel, const CouplingSink& couplings)
  {
    const FlatMap<F> map(data.reference);
    const bool hit = s.elements.master[e] != no_index;
    Index segment = no_index;
    for (const Index i : s.elements.points_of(e))
    {
      const auto q = static_cast<std::size_t>(i);
      if (s.points.segment[q] != segment)
      {
        flush(s, e, segment, data, map, kernel, couplings);
        segment = s.points.segment[q];
      }
      if (segment == no_index)
        continue;
      const ElementPoint<F> point = element_point<F>(s, q);
      add_point(s, q, map,
                hit ? Gradient::hit(data, point) : Gradient::miss(data, point));
    }
    flush(s, e, segment, data, map, kernel, couplings);
  }

private:
  using Gradient = SurfaceGradient<F, L, Law>;
  using Flat = typename F::RefPoint;
  static constexpr std::size_t capacity = ClipPolygon::capacity;
  using Sum = Mat<Layout::size, T>;

  /// Mean of all vertices, around which pieces of larger polygons lie
  static constexpr std::size_t centre = capacity;

  /// What a point changes by its place y in the segment's plane, and by the
  /// measure of its piece per weight of the rule
  struct Change
  {
    Sum by_y;
    Vec<Layout::size> by_measure;
  };

  /// Vertices of one segment in the plane in which its sides are straight
  struct Vertices
  {
    const ContactState& s;
    const Segment& segment;
    const FlatMap<F>& map;

    [[nodiscard]] std::size_t size() const
    {
      return static_cast<std::size_t>(segment.size);
    }

    [[nodiscard]] Flat operator()(std::size_t v) const
    {
      if (v == centre)
      {
        Flat sum = Flat::Zero();
        for (std::size_t k = 0; k < size(); ++k)
          sum += (*this)(k) / static_cast<double>(size());
        return sum;
      }
      const auto k = static_cast<std::size_t>(segment.begin) + v;
      return map.to_flat(s.segmentation.vertices[k].template head<T>());
    }
  };

  void add_point(const ContactState& s, std::size_t q, const FlatMap<F>& map,
                 const Integrand<F, L, Law>& at)
  {
    const Segment& segment =
        s.segmentation.segments[static_cast<std::size_t>(s.points.segment[q])];
    const typename F::RefPoint xi = s.points.xi[q].template head<T>();
    const typename FlatMap<F>::Gradient G = map.gradient(xi);
    // The uncovered part takes the points of segments with negative weights
    const double sign = s.points.seed[q] == no_index ? -1.0 : 1.0;
    const Change change{
        s.points.weight[q] *
            (at.f_xi - at.f * map.log_det_gradient(xi).transpose()) *
            G.inverse(),
        sign / G.determinant() * at.f};
    add_in_piece(change, {s, segment, map},
                 static_cast<std::size_t>(s.points.place[q]));
  }

  /// By the rule that append_on_polygon took, and its place in there
  void add_in_piece(const Change& change, const Vertices& vertices,
                    std::size_t place)
  {
    const SegmentRules& rules = vertices.s.segment_rules;
    const std::size_t n = vertices.size();
    if constexpr (T == 1)
      add_on<Shape::interval>(change, vertices, rules.simplex, place, {0, 1});
    else if (n == 3)
      add_on<Shape::triangle>(change, vertices, rules.simplex, place,
                              {0, 1, 2});
    else if (n == 4)
      add_on<Shape::quadrilateral>(change, vertices, rules.quadrilateral, place,
                                   {0, 1, 3, 2});
    else
    {
      const std::size_t piece = place / rules.fan.weights.size();
      add_on<Shape::triangle>(change, vertices, rules.fan,
                              place % rules.fan.weights.size(),
                              {centre, piece, (piece + 1) % n});
    }
  }

  /// Point k of a rule under the map of some vertices
  template <Shape P>
  void add_on(const Change& change, const Vertices& vertices,
              const QuadratureRule& rule, std::size_t k,
              const std::array<std::size_t, Reference<P>::corners>& corners)
  {
    constexpr int count = Reference<P>::corners;
    const Flat r = rule.points[k].template head<T>();
    const Vec<count> N = Lagrange<P, 1>::values(r);
    const Mat<count, T> dN = Lagrange<P, 1>::gradients(r);
    Mat<T, T> J = Mat<T, T>::Zero();
    for (int c = 0; c < count; ++c)
      J += vertices(corners[static_cast<std::size_t>(c)]) * dN.row(c);
    const Mat<count, T> dJ = rule.weights[k] * dN * adjugate(J);
    for (int c = 0; c < count; ++c)
    {
      const Sum sum = N[c] * change.by_y + change.by_measure * dJ.row(c);
      const std::size_t v = corners[static_cast<std::size_t>(c)];
      if (v != centre)
      {
        _by_vertex[v] += sum;
        continue;
      }
      for (std::size_t each = 0; each < vertices.size(); ++each)
        _by_vertex[each] += sum / static_cast<double>(vertices.size());
    }
  }

  /// det(J) J^-1: the derivative of det(J) by a corner is its row of dN times
  /// this, also where the piece has no area
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

  /// Vertices' share of the tangent; empties the sums for the next segment
  void flush(const ContactState& s, std::size_t e, Index segment,
             const Data& data, const FlatMap<F>& map, Kernel& kernel,
             const CouplingSink& couplings)
  {
    constexpr int side = Layout::side;
    if (segment == no_index)
      return;
    const Segment& of =
        s.segmentation.segments[static_cast<std::size_t>(segment)];
    const bool own = of.master == s.elements.master[e];
    const auto master = s.master.template nodes<F>(s.master.x, of.master);
    if (not own)
      _coupling.setZero();
    for (std::size_t v = 0; v < static_cast<std::size_t>(of.size); ++v)
    {
      const std::size_t at = static_cast<std::size_t>(of.begin) + v;
      const Break& hangs_on = s.segmentation.breaks[at];
      if (hangs_on.motion == Break::Motion::fixed)
        continue;
      const typename F::RefPoint xi =
          s.segmentation.vertices[at].template head<T>();
      const Mat<T, 2 * side> dy =
          map.gradient(xi) * vertex_motion<F>(data.slave, master, xi, hangs_on);
      const Sum& A = _by_vertex[v];
      kernel.A.template leftCols<side>() += A * dy.template leftCols<side>();
      if (own)
        kernel.A.template rightCols<side>() +=
            A * dy.template rightCols<side>();
      else
        _coupling.template topRightCorner<Layout::alone, side>() +=
            A.template topRows<Layout::alone>() * dy.template rightCols<side>();
    }
    if (not own)
      couplings(e, of.master, _coupling.data(), Layout::size);
    for (auto& sum : _by_vertex)
      sum.setZero();
  }

  std::array<Sum, capacity> _by_vertex = []
  {
    std::array<Sum, capacity> zero;
    for (auto& sum : zero)
      sum.setZero();
    return zero;
  }();
  typename Kernel::Matrix _coupling;
};
} // namespace raymortar
