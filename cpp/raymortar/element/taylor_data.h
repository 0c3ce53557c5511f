// Slave and target data that a law takes at one point, for facets of any kind.
// All points share one set of these data.
#pragma once

#include "raymortar/element/element_states.h"
#include "raymortar/element/taylor_facet.h"
#include "raymortar/geometry/curvature.h"

namespace raymortar
{
/// @brief Taylor coefficients of geometry in the columns of
/// TaylorFacet<D>::NodeMatrix, of fields in columns: value and derivatives by
/// xi.
///
/// Second derivatives of geometry and derivatives of fields are set where they
/// are asked for.
template <int D>
struct TaylorData
{
  using F = TaylorFacet<D>;
  typename F::NodeMatrix slave;
  typename F::NodeMatrix master;     ///< around the point that is hit
  typename F::NodeMatrix reference;  ///< undeformed slave; moving segments only
  Mat<D, D> lam = Mat<D, D>::Zero(); ///< traction; rows as components
  Vec<D> gamma = Vec<D>::Zero();
  Vec<D> offset = Vec<D>::Zero(); ///< length
  double touch = 0.0;             ///< see PointState, length
  Measure measure = Measure::reference;
  bool frame_of_target = false; ///< see ContactState::has_frame_of_target
  bool slave_bends = true;      ///< false: tangents are the same at all points
  bool master_bends = true;
  FrictionData<F, true> history;
  /// Unfelt parts of the multiplier at its nodes, if anything is kept
  std::array<Mat<D, D>, 4> unfelt;
  TwoFrames<D> slave_frames;  ///< the old ones with friction only
  TwoFrames<D> master_frames; ///< those of the point that is hit
  Spin<D> spin;

  /// Coefficients that are never set are multiplied by zeros
  TaylorData()
  {
    for (auto* nodes :
         {&slave, &master, &reference, &history.slave_old, &history.master_old})
      nodes->setZero();
    history.traction_old.setZero();
    history.kept.setZero();
    history.coefficient.setZero();
  }
};

/// @brief Curvature of a facet with constant tangents.
template <int D>
[[nodiscard]] Curvature<D> no_curvature()
{
  Curvature<D> c;
  c.t.fill(Mat<D, D - 1>::Zero());
  c.n.setZero();
  c.log_jacobian.setZero();
  return c;
}

template <class F, int L, class Law>
requires F::is_taylor struct ElementData<F, L, Law> : TaylorData<F::gdim>
{
  using Layout = ElementLayout<F, L, Law>;
};

template <class F, int L, class Law>
requires F::is_taylor [[nodiscard]] const Frame<F::gdim>&
master_frame(const ElementData<F, L, Law>& e, const ElementPoint<F>&)
{
  return e.master_frames.now;
}

template <class F, int L, class Law>
requires F::is_taylor [[nodiscard]] bool
frame_of_target(const ElementData<F, L, Law>& e)
{
  return e.frame_of_target;
}

template <class F, int L, class Law>
requires F::is_taylor [[nodiscard]] bool
bends_at_master(const ElementData<F, L, Law>& e)
{
  return e.master_bends;
}

template <class F, int L, class Law>
requires F::is_taylor [[nodiscard]] bool
bends_at_slave(const ElementData<F, L, Law>& e)
{
  return e.slave_bends;
}

/// Coordinates on a Taylor facet are 0: its shape functions are known
template <class F>
requires F::is_taylor struct NodeShapes<F>
{
  explicit NodeShapes(const typename F::RefPoint&) {}
  [[nodiscard]] Vec<F::dofs> displacement(const typename F::RefPoint&) const
  {
    return Vec<F::dofs>::Unit(0);
  }
};

/// Frames and spin come with the data
template <class F>
requires F::is_taylor struct ElementStates<F, true>
{
  static constexpr int D = F::gdim;

  struct Side
  {
    const TwoFrames<D>& frames;
    [[nodiscard]] const TwoFrames<D>& at(const NodeShapes<F>&) const
    {
      return frames;
    }
    void set(TwoFrames<D>& f, const NodeShapes<F>&) const { f = frames; }
  };
  Side slave;
  Side master;

  explicit ElementStates(const TaylorData<D>& e)
      : slave{e.slave_frames}, master{e.master_frames}, _spin(e.spin)
  {
  }

  void set_spin(Spin<D>& spin, const TwoFrames<D>&, const TwoFrames<D>&) const
  {
    spin = _spin;
  }

private:
  const Spin<D>& _spin;
};
} // namespace raymortar
