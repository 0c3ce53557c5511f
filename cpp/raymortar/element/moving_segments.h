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
  static constexpr std::size_t corners = T + 1; ///< of an interval or triangle

  /// Where a point is in its segment: corners of its piece and their shares
  struct Place
  {
    std::array<std::size_t, corners> vertex; ///< or centre
    std::array<double, corners> share;
    double rule_weight;
  };

  /// Mean of all vertices, around which pieces of larger polygons lie
  static constexpr std::size_t centre = capacity;

  [[nodiscard]] static Place place_of(const ContactState& s, std::size_t q,
                                      std::size_t size)
  {
    const QuadratureRule& rule = s.segment_rule;
    const auto number = static_cast<std::size_t>(s.points.place[q]);
    const std::size_t k = number % rule.weights.size();
    const Vec<2>& r = rule.points[k];
    if constexpr (T == 1)
      return {{0, 1}, {1.0 - r[0], r[0]}, rule.weights[k]};
    else
    {
      const std::size_t piece = number / rule.weights.size();
      const std::array<double, corners> share = {1.0 - r[0] - r[1], r[0], r[1]};
      if (size == 3)
        return {{0, 1, 2}, share, rule.weights[k]};
      return {{centre, piece, (piece + 1) % size}, share, rule.weights[k]};
    }
  }

  /// Derivatives of the piece's measure by its vertices
  [[nodiscard]] static std::array<Flat, corners>
  measure_gradient(const std::array<Flat, corners>& y)
  {
    if constexpr (T == 1)
      return {Flat(-1.0), Flat(1.0)};
    else
    {
      const Flat e = y[1] - y[0], f = y[2] - y[0];
      const Flat by_1(f[1], -f[0]), by_2(-e[1], e[0]);
      return {-by_1 - by_2, by_1, by_2};
    }
  }

  void add_point(const ContactState& s, std::size_t q, const FlatMap<F>& map,
                 const Integrand<F, L, Law>& at)
  {
    const Segment& segment =
        s.segmentation.segments[static_cast<std::size_t>(s.points.segment[q])];
    const auto size = static_cast<std::size_t>(segment.size);
    const Place place = place_of(s, q, size);
    const auto vertex = [&](std::size_t v) -> Flat
    {
      const auto k = static_cast<std::size_t>(segment.begin) + v;
      return map.to_flat(s.segmentation.vertices[k].template head<T>());
    };
    std::array<Flat, corners> y;
    for (std::size_t c = 0; c < corners; ++c)
    {
      if (place.vertex[c] != centre)
      {
        y[c] = vertex(place.vertex[c]);
        continue;
      }
      y[c].setZero();
      for (std::size_t v = 0; v < size; ++v)
        y[c] += vertex(v) / static_cast<double>(size);
    }
    const typename F::RefPoint xi = s.points.xi[q].template head<T>();
    const typename FlatMap<F>::Gradient G = map.gradient(xi);
    const Mat<Layout::size, T> by_y =
        s.points.weight[q] *
        (at.f_xi - at.f * map.log_det_gradient(xi).transpose()) * G.inverse();
    // The uncovered part takes the points of segments with negative weights
    const double sign = s.points.seed[q] == no_index ? -1.0 : 1.0;
    const double per_measure = sign * place.rule_weight / G.determinant();
    const auto measure = measure_gradient(y);
    for (std::size_t c = 0; c < corners; ++c)
    {
      const Mat<Layout::size, T> sum =
          place.share[c] * by_y + per_measure * at.f * measure[c].transpose();
      if (place.vertex[c] != centre)
      {
        _by_vertex[place.vertex[c]] += sum;
        continue;
      }
      for (std::size_t v = 0; v < size; ++v)
        _by_vertex[v] += sum / static_cast<double>(size);
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
      const Mat<Layout::size, T>& A = _by_vertex[v];
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

  std::array<Mat<Layout::size, T>, capacity> _by_vertex = []
  {
    std::array<Mat<Layout::size, T>, capacity> zero;
    for (auto& sum : zero)
      sum.setZero();
    return zero;
  }();
  typename Kernel::Matrix _coupling;
};
} // namespace raymortar
