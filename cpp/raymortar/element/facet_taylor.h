// A facet of any kind, and what it is around its points.
#pragma once

#include "raymortar/element/taylor_data.h"
#include "raymortar/geometry/taylor.h"
#include "raymortar/pairing/surface.h"

namespace raymortar
{
/// @brief What kernels ask for at points.
struct Wanted
{
  bool old = false;    ///< the accepted step
  bool target = false; ///< what is hit, though the law does not take it
  bool bends = false;  ///< second derivatives of what is hit
  bool along = false;  ///< derivatives along the slave facet
};

/// @brief Nodal vectors of one facet.
template <int D>
struct AnyNodes
{
  static constexpr int T = D - 1;
  std::array<Vec<D>, 9> at;

  /// Take them from positions
  void take(const Surface& s, const std::vector<double>& positions, Index facet,
            std::size_t count)
  {
    const Index* const nodes =
        s.facet_nodes.data() + static_cast<std::size_t>(facet) * count;
    for (std::size_t a = 0; a < count; ++a)
      at[a] = Eigen::Map<const Vec<D>>(positions.data() + D * nodes[a]);
  }

  /// @brief One Taylor coefficient at a point.
  [[nodiscard]] Vec<D> taylor(const ShapeRows<T>& N, std::size_t count,
                              std::size_t coefficient) const
  {
    Vec<D> sum = N[0][coefficient] * at[0];
    for (std::size_t a = 1; a < count; ++a)
      sum += N[a][coefficient] * at[a];
    return sum;
  }

  /// @brief Set those of second order, after all others.
  template <class Coefficients>
  void set_second(const ShapeRows<T>& N, std::size_t count,
                  Coefficients& c) const
  {
    for (int p = D; p < taylor_size<T>; ++p)
      c.col(p) = taylor(N, count, static_cast<std::size_t>(p));
  }
};

/// @brief A facet now and at the accepted step.
template <int D>
class FacetTaylor
{
public:
  static constexpr int T = D - 1;
  using Coefficients = typename TaylorFacet<D>::NodeMatrix;

  FacetTaylor(const Surface& s, bool old)
      : _surface(s), _shapes(s.shape, s.node_degree), _old(old),
        _nodes(static_cast<std::size_t>(_shapes.nodes()))
  {
  }

  /// @brief Take another facet.
  void take(Index facet)
  {
    _x.take(_surface, _surface.x, facet, _nodes);
    if (_old)
      _x_old.take(_surface, _surface.x_old, facet, _nodes);
    _is_new = true;
  }

  [[nodiscard]] bool bends() const { return not _shapes.is_affine(); }
  [[nodiscard]] const ShapeFunctions<T>& shapes() const { return _shapes; }

  /// @brief Set coefficients and frames at a point.
  /// @param[in] N Shape functions of positions there
  /// @param[in] second Whether second derivatives are asked for, and known
  /// @return Whether tangents are others than at the point before
  bool place(const ShapeRows<T>& N, bool second, Coefficients& now,
             Coefficients& old, TwoFrames<D>& frames)
  {
    const bool turned = _is_new or bends();
    _is_new = false;
    place(_x, N, turned, now, frames.now);
    if (_old)
    {
      place(_x_old, N, turned, old, frames.old);
      if (turned)
        frames.old_dual = dual_tangents<D>(frames.old);
    }
    if (second and turned)
    {
      _x.set_second(N, _nodes, now);
      if (_old)
        _x_old.set_second(N, _nodes, old);
    }
    return turned;
  }

  /// @brief Corners' largest distance. Length
  [[nodiscard]] double diameter() const
  {
    const auto corners = static_cast<std::size_t>(_surface.corners());
    double d = 0.0;
    for (std::size_t i = 0; i < corners; ++i)
      for (std::size_t j = 0; j < i; ++j)
        d = std::max(d, (_x.at[i] - _x.at[j]).squaredNorm());
    return std::sqrt(d);
  }

private:
  /// Values are stored twice from where they are computed: a load of what has
  /// just been stored would wait
  void place(const AnyNodes<D>& nodes, const ShapeRows<T>& N, bool turned,
             Coefficients& c, Frame<D>& frame) const
  {
    const Vec<D> x = nodes.taylor(N, _nodes, 0);
    c.col(0) = x;
    frame.x = x;
    if (not turned)
      return;
    Mat<D, T> t;
    for (int j = 0; j < T; ++j)
      t.col(j) = nodes.taylor(N, _nodes, static_cast<std::size_t>(1 + j));
    c.template middleCols<T>(1) = t;
    frame.t = t;
    const Vec<D> m = normal_of(t);
    frame.jacobian = length<D>(m);
    frame.n = m / frame.jacobian;
  }

  const Surface& _surface;
  ShapeFunctions<T> _shapes;
  bool _old;
  std::size_t _nodes;
  AnyNodes<D> _x, _x_old;
  bool _is_new = true;
};
} // namespace raymortar
