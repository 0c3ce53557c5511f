// Both facets of an element in both states, and how they have turned against
// each other.
#pragma once

#include "raymortar/element/facet_states.h"
#include "raymortar/element/spin.h"

namespace raymortar
{
/// @brief Made once for all points of an element; nothing without friction.
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
    if constexpr (F::affine)
      _spin.set(slave.frames(), master.frames());
  }

  /// @param[out] spin Of a point with these frames: one for all of affine
  /// facets
  void set_spin(Spin<F::gdim>& spin, const TwoFrames<F::gdim>& at_slave,
                const TwoFrames<F::gdim>& at_master) const
  {
    if constexpr (F::affine)
      spin = _spin;
    else
      spin.set(at_slave, at_master);
  }

private:
  std::conditional_t<F::affine, Spin<F::gdim>, int> _spin;
};
} // namespace raymortar
