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

/// @brief Both states of one facet, made once for all of its points.
///
/// Nodes stand one state above the other, so that one product gives both: six
/// rows fill vector registers, three do not. On affine facets only positions
/// change from point to point.
template <class F>
class FacetStates
{
  static constexpr int D = F::gdim;

public:
  FacetStates(const typename F::NodeMatrix& now,
              const typename F::NodeMatrix& old)
  {
    _nodes << now, old;
    if constexpr (F::affine)
      set_bases(_frames,
                _nodes.template rightCols<F::tdim>().colwise() - _nodes.col(0));
  }

  /// @param[out] f In its place: copies of what is fresh cost more than it
  void set(TwoFrames<D>& f, const NodeShapes<F>& shapes) const
  {
    if constexpr (F::affine)
      f = _frames;
    else
      set_bases(f, _nodes * shapes.dN);
    const Vec<2 * D> x = _nodes * shapes.N;
    f.now.x = x.template head<D>();
    f.old.x = x.template tail<D>();
  }

  [[nodiscard]] TwoFrames<D> at(const NodeShapes<F>& shapes) const
  {
    TwoFrames<D> f;
    set(f, shapes);
    return f;
  }

private:
  /// @param[in] t Tangents of both states
  static void set_bases(TwoFrames<D>& f, const Mat<2 * D, D - 1>& t)
  {
    set_basis<D>(f.now, t.template topRows<D>());
    set_basis<D>(f.old, t.template bottomRows<D>());
    f.old_dual = dual_tangents<D>(f.old);
  }

  Mat<2 * D, F::nodes> _nodes;
  std::conditional_t<F::affine, TwoFrames<D>, int> _frames; ///< but for x
};

/// @brief Both facets of an element in both states; nothing without friction.
template <class F, bool Frictional>
struct ElementStates
{
  template <class Data>
  explicit ElementStates(const Data&)
  {
  }
};

template <class F>
struct ElementStates<F, true>
{
  FacetStates<F> slave;
  FacetStates<F> master;

  template <class Data>
  explicit ElementStates(const Data& e)
      : slave(e.slave, e.history.slave_old),
        master(e.master, e.history.master_old)
  {
  }
};
} // namespace raymortar
