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

/// @brief Both states of one facet, made once for all of its points: on affine
/// facets only positions change from point to point.
template <class F>
class FacetStates
{
  static constexpr int D = F::gdim;

public:
  FacetStates(const typename F::NodeMatrix& now,
              const typename F::NodeMatrix& old)
      : _now(now), _old(old)
  {
    if constexpr (F::affine)
      set_frames(_frames, NodeShapes<F>(F::RefPoint::Zero()));
  }

  /// @param[out] f In its place: copies of what is fresh cost more than it
  void set(TwoFrames<D>& f, const NodeShapes<F>& shapes) const
  {
    if constexpr (F::affine)
    {
      f = _frames;
      f.now.x.noalias() = _now * shapes.N;
      f.old.x.noalias() = _old * shapes.N;
    }
    else
      set_frames(f, shapes);
  }

  /// @brief Of affine facets: what is the same at all points.
  [[nodiscard]] const TwoFrames<D>& frames() const requires F::affine
  {
    return _frames;
  }

  [[nodiscard]] TwoFrames<D> at(const NodeShapes<F>& shapes) const
  {
    TwoFrames<D> f;
    set(f, shapes);
    return f;
  }

private:
  void set_frames(TwoFrames<D>& f, const NodeShapes<F>& shapes) const
  {
    f.now = frame_at<F>(_now, shapes);
    f.old = frame_at<F>(_old, shapes);
    f.old_dual = dual_tangents<D>(f.old);
  }

  typename F::NodeMatrix _now, _old;
  std::conditional_t<F::affine, TwoFrames<D>, int> _frames; ///< but for x
};
} // namespace raymortar
