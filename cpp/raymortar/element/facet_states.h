// A facet at the present and at the accepted step: friction needs frames of
// both at every point.
#pragma once

#include "raymortar/element/element_data.h"
#include "raymortar/geometry/frame.h"

namespace raymortar
{
/// @brief Frames of one material point of a facet.
template <int D>
struct TwoFrames
{
  Frame<D> now;
  Frame<D> old;
  Mat<D, D - 1> old_dual; ///< of the old tangents
};

/// @brief Whether positions on a facet are bilinear in its coordinates.
template <class F>
inline constexpr bool is_bilinear = false;
template <int P>
inline constexpr bool is_bilinear<FacetType<Shape::quadrilateral, P, 1>> = true;

/// @brief Position of a bilinear facet as a polynomial: it takes a third of the
/// work that shape functions do.
struct Bilinear
{
  std::array<Vec<3>, 4> c; ///< of 1, xi_1, xi_2, xi_1 xi_2

  explicit Bilinear(const Mat<3, 4>& x)
  {
    for (int i = 0; i < 3; ++i)
    {
      c[0][i] = x(i, 0);
      c[1][i] = x(i, 1) - x(i, 0);
      c[2][i] = x(i, 2) - x(i, 0);
      c[3][i] = (x(i, 3) - x(i, 2)) - c[1][i];
    }
  }

  void set(Frame<3>& f, const Vec<2>& xi) const
  {
    for (int i = 0; i < 3; ++i)
    {
      f.t(i, 0) = c[1][i] + xi[1] * c[3][i];
      f.t(i, 1) = c[2][i] + xi[0] * c[3][i];
      f.x[i] = c[0][i] + xi[0] * f.t(i, 0) + xi[1] * c[2][i];
    }
    set_normal(f);
  }
};

/// @brief Both states of one facet, made once for all of its points: on affine
/// facets only positions change from point to point.
template <class F>
class FacetStates
{
  static constexpr int D = F::gdim;
  using Point = typename F::RefPoint;

public:
  FacetStates(const typename F::NodeMatrix& now,
              const typename F::NodeMatrix& old)
      : _now(now), _old(old)
  {
    if constexpr (F::affine)
      set_frames(_frames, F::RefPoint::Zero(),
                 NodeShapes<F>(F::RefPoint::Zero()));
  }

  /// @param[out] f In its place: copies of what is fresh cost more than it
  void set(TwoFrames<D>& f, const Point& xi, const NodeShapes<F>& shapes) const
  {
    if constexpr (F::affine)
    {
      f = _frames;
      f.now.x.noalias() = _now * shapes.N;
      f.old.x.noalias() = _old * shapes.N;
    }
    else
      set_frames(f, xi, shapes);
  }

  /// @brief Of affine facets: what is the same at all points.
  [[nodiscard]] const TwoFrames<D>& frames() const requires F::affine
  {
    return _frames;
  }

  [[nodiscard]] TwoFrames<D> at(const Point& xi,
                                const NodeShapes<F>& shapes) const
  {
    TwoFrames<D> f;
    set(f, xi, shapes);
    return f;
  }

private:
  void set_frames(TwoFrames<D>& f, const Point& xi,
                  const NodeShapes<F>& shapes) const
  {
    if constexpr (is_bilinear<F>)
    {
      _now.set(f.now, xi);
      _old.set(f.old, xi);
    }
    else
    {
      f.now = frame_at<F>(_now, shapes);
      f.old = frame_at<F>(_old, shapes);
    }
    f.old_dual = dual_tangents<D>(f.old);
  }

  std::conditional_t<is_bilinear<F>, Bilinear, typename F::NodeMatrix> _now,
      _old;
  std::conditional_t<F::affine, TwoFrames<D>, int> _frames; ///< but for x
};
} // namespace raymortar
