// Data of an element: unknowns, nodal values and integration points.
#pragma once

#include "raymortar/element/measure.h"
#include "raymortar/law/frictional.h"
#include <algorithm>

namespace raymortar
{
/// @brief Dof layout of an element: [slave u | multiplier | master u].
///
/// The multiplier is first of the optional parts so that an element without
/// master uses the leading block.
/// @tparam L Degree of the multiplier, 0 without
/// @tparam M Components of the multiplier, 0 without
template <class F, int L, int M>
struct LayoutOf
{
  static constexpr int D = F::gdim;
  static constexpr int components = M;
  static constexpr int side = F::dofs * D;
  static constexpr int multipliers =
      L == 0 ? 0 : F::template Basis<std::max(L, 1)>::nodes;
  static constexpr int multiplier_dofs = multipliers * components;
  static constexpr int master = side + multiplier_dofs;
  static constexpr int size = 2 * side + multiplier_dofs;
  static constexpr int alone = side + multiplier_dofs;
};

template <class F, int L, class Law>
using ElementLayout = LayoutOf<F, L, Law::template multiplier_size<F::gdim>>;

/// @brief What friction needs of the accepted step; nothing without it.
template <class F, bool Frictional>
struct FrictionData
{
};

template <class F>
struct FrictionData<F, true>
{
  typename F::NodeMatrix slave_old;
  typename F::NodeMatrix master_old;
  Mat<F::gdim, F::dofs> traction_old; ///< nodal, see ContactState
  bool has_springs = true;            ///< false: traction_old is zero
  /// Nodal, what the law has in place of the multiplier's unfelt part, less it
  Mat<F::gdim, F::dofs> kept;
  bool has_kept = false; ///< false: kept is zero
  FrictionLaw friction;
  bool has_coefficient = false; ///< a field in place of the law's number
  Vec<F::dofs> coefficient;     ///< its nodal values
};

/// @brief Tells whether the law uses the target's frame. Only the general
/// kernel asks: typed facets use the slave's.
template <class F>
struct TargetFrame
{
  static constexpr bool of_target = false;
  explicit TargetFrame(bool) {}
};

template <class F>
requires F::is_taylor struct TargetFrame<F>
{
  bool of_target;
  explicit TargetFrame(bool is_of_target) : of_target(is_of_target) {}
};

/// @brief One integration point of an element.
template <class F>
struct ElementPoint
{
  typename F::RefPoint xi;
  typename F::RefPoint eta;
  double weight; ///< in reference coordinates
  double area;   ///< times the reference Jacobian
  double g;
  PointBound bound{}; ///< of a friction law that is known at points only
};

/// @brief Data of one element besides its points; see taylor_data.h for those
/// of a Taylor facet.
template <class F, int L, class Law>
struct ElementData
{
  using Layout = ElementLayout<F, L, Law>;
  typename F::NodeMatrix slave;
  typename F::NodeMatrix master;
  typename F::NodeMatrix reference; ///< undeformed slave; moving segments only
  Mat<Layout::components, Layout::multipliers>
      lam;            ///< nodal unknowns ell = lam / lam_scale
  Vec<F::dofs> gamma; ///< nodal coefficient on the slave facet
  Vec<F::dofs> offset = Vec<F::dofs>::Zero(); ///< nodal, added to gaps; length
  double lam_scale = 1; ///< traction per unit of the multiplier unknown
  double touch = 0;     ///< see PointState, length
  Measure measure = Measure::reference;
  FrictionData<F, is_frictional<Law>> history;
};

/// @brief Frame of what a point has hit.
template <class F, int L, class Law>
[[nodiscard]] Frame<F::gdim> master_frame(const ElementData<F, L, Law>& e,
                                          const ElementPoint<F>& q)
{
  return frame_at<F>(e.master, q.eta);
}

/// @brief Whether the law uses the target's frame; typed facets use the
/// slave's.
template <class F, int L, class Law>
[[nodiscard]] constexpr bool frame_of_target(const ElementData<F, L, Law>&)
{
  return false;
}

/// @brief Whether tangents and normal of the master change along it.
template <class F, int L, class Law>
[[nodiscard]] constexpr bool bends_at_master(const ElementData<F, L, Law>&)
{
  return not F::affine;
}
/// @brief Whether those of the slave do.
template <class F, int L, class Law>
[[nodiscard]] constexpr bool bends_at_slave(const ElementData<F, L, Law>&)
{
  return not F::affine;
}
} // namespace raymortar
