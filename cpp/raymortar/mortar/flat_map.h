// Coordinates of a slave facet in which the sides of its segments are straight.
#pragma once

#include "raymortar/geometry/frame.h"
#include "raymortar/geometry/patch.h"
#include "raymortar/mortar/plane.h"

namespace raymortar
{
/// @brief Reference coordinates xi <-> coordinates y in the facet's plane.
///
/// Straight edges of a master are straight in the plane of a flat slave facet,
/// but on a quadrilateral without parallel sides not in xi. The map is the
/// bilinear one through the corners of the *undeformed* facet: it does not
/// move with the bodies, and weights add up to the reference area exactly
/// where that facet is flat. On intervals and triangles y = xi.
/// [theory (3.7)]
template <class F>
class FlatMap
{
public:
  using RefPoint = typename F::RefPoint;
  using Gradient = Mat<F::tdim, F::tdim>;

  /// Whether y is not just xi
  static constexpr bool is_map = F::shape == Shape::quadrilateral;

  explicit FlatMap(const typename F::NodeMatrix& nodes)
  {
    if constexpr (is_map)
    {
      const Patch& patch = patches<F>(false)[0];
      const auto corners = patch_corners<F>(nodes, patch);
      const auto plane = patch_plane<3>(corners, 4);
      const auto xi = patch_reference<F>(patch);
      for (std::size_t i = 0; i < 4; ++i)
        _y[i] = plane.valid ? plane.coordinates(corners[i]) : xi[i];
    }
  }

  [[nodiscard]] RefPoint to_flat(const RefPoint& xi) const
  {
    if constexpr (is_map)
      return _y[0] + (_y[1] - _y[0]) * xi[0] + (_y[3] - _y[0]) * xi[1] +
             twist() * (xi[0] * xi[1]);
    else
      return xi;
  }

  [[nodiscard]] RefPoint from_flat(const RefPoint& y) const
  {
    if constexpr (is_map)
      return inverse_bilinear(_y, y);
    else
      return y;
  }

  /// dy/dxi
  [[nodiscard]] Gradient gradient(const RefPoint& xi) const
  {
    Gradient G = Gradient::Identity();
    if constexpr (is_map)
    {
      G.col(0) = _y[1] - _y[0] + twist() * xi[1];
      G.col(1) = _y[3] - _y[0] + twist() * xi[0];
    }
    return G;
  }

  /// Derivative of log det(dy/dxi) by xi
  [[nodiscard]] RefPoint log_det_gradient(const RefPoint& xi) const
  {
    RefPoint rate = RefPoint::Zero();
    if constexpr (is_map)
    {
      const Gradient inverse = gradient(xi).inverse();
      rate[0] = inverse.row(1).dot(twist());
      rate[1] = inverse.row(0).dot(twist());
    }
    return rate;
  }

private:
  [[nodiscard]] RefPoint twist() const { return _y[0] - _y[1] + _y[2] - _y[3]; }

  std::array<RefPoint, 4> _y; ///< corners around the facet
};
} // namespace raymortar
