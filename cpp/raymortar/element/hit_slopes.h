// What tangents take of a point with a hit besides its values.
#pragma once

#include "raymortar/element/contact_point.h"

namespace raymortar
{
/// @brief How the slip changes with the point that is hit, and with its master.
template <class F, bool Frictional>
struct SlipSlopes
{
};

template <class F>
struct SlipSlopes<F, true>
{
  static constexpr int D = F::gdim;
  using Old = OldPoint<F, true>;
  using Along = Mat<D, F::tdim>; ///< along some coordinates
  Along dual;                    ///< of the master's tangents
  SpinSlopes<D> spin;
  Along by_eta;

  /// @param[in] of_target Whether the frame is the master's  [theory (2.9)]
  /// @param[in] bends Whether tangents and normal of the master change along it
  SlipSlopes(const typename F::NodeMatrix& master_nodes,
             const typename F::NodeMatrix& master_old, const ElementPoint<F>& q,
             const Old& was, bool of_target, bool bends)
      : dual(dual_tangents<D>(was.master.now)), spin(was.spin, was.slide.value),
        by_eta(moved(was, was.master.old.t))
  {
    if constexpr (not F::affine)
    {
      if (not bends)
        return;
      const NodeBends<F> second = node_bends<F>(q.eta);
      const Curvature<D> old = curvature_at<F>(
          master_old, second, was.master.old, was.master.old_dual);
      const Curvature<D> now =
          curvature_at<F>(master_nodes, second, was.master.now, dual);
      const Mat<D, D> carry =
          convection<D>(was.master.old, was.master.old_dual, was.master.now);
      const auto along = [&](const ConvectedVector<D>& c)
      { return convected_along_master<F>(c, carry, old, now); };
      by_eta += spin.after(along(was.slide));
      if constexpr (D == 3)
        by_eta += spin.by_angle *
                  (spin.by_first.transpose() * along(was.spin.first) +
                   spin.by_second.transpose() * along(was.spin.second));
      if (was.closing.by_old != 0.0)
        by_eta -= 0.5 * was.closing.by_old * was.normal *
                  (was.distance.transpose() * old.n);
      if (of_target)
        by_eta += turned(was, -old.n);
    }
  }

  /// @brief By vectors that are transported along, with half of the spin.
  template <int C>
  [[nodiscard]] Mat<D, C> transported(const Old& was, const Mat<D, C>& v) const
  {
    const TwoFrames<D>& m = was.master;
    const Mat<D - 1, C> along = m.old_dual.transpose() * v;
    const Mat<1, C> across = m.old.n.transpose() * v;
    return spin.after(Mat<D, C>(m.now.t * along + m.now.n * across));
  }

  /// @brief By `ahead`, but for what has closed.
  template <int C>
  [[nodiscard]] Mat<D, C> slid(const Old& was, const Mat<D, C>& v) const
  {
    const Mat<1, C> across = was.normal.transpose() * v;
    return transported<C>(was, v - was.normal * across);
  }

  /// @brief By the distance.
  template <int C>
  [[nodiscard]] Mat<D, C> moved(const Old& was, const Mat<D, C>& v) const
  {
    Mat<D, C> w = slid<C>(was, v);
    if (was.closing.by_old != 0.0)
      w += was.closing.by_old * was.normal * (was.across.transpose() * v);
    return w;
  }

  /// @brief Where the old normal of the frame turns.
  [[nodiscard]] Along turned(const Old& was, const Along& turn) const
  {
    const Mat<1, F::tdim> along = was.ahead.transpose() * turn;
    const Along turned = was.normal.dot(was.ahead) * turn + was.normal * along;
    return was.closing.length * turn - transported<F::tdim>(was, turned) +
           0.5 * was.closing.by_old * was.normal *
               (was.distance.transpose() * turn);
  }
};

/// @brief How the normal of the law's frame turns with what is hit: of a facet
/// type it is the slave's, and nothing is set  [theory (2.14)].
template <class F>
struct FrameSlopes : TargetFrame<F>
{
  static constexpr int D = F::gdim;
  Mat<D, D> by_ends; ///< by what both ends of the ray do, see chain

  template <class Data>
  FrameSlopes(const Data&, const ElementPoint<F>&, const Mat<F::tdim, D>&)
      : TargetFrame<F>(false)
  {
  }
};

/// @brief Tangents and variations at a point with a hit: what tangents take
/// besides.
template <class F, int L, class Law>
struct HitSlopes
{
  static constexpr int D = F::gdim;
  PointGeometry<F> geometry;
  Variations<F> vary;
  SlipSlopes<F, is_frictional<Law>> slip;
  FrameSlopes<F> frame;

  HitSlopes(const ElementData<F, L, Law>& e, const ElementPoint<F>& q,
            const HitPoint<F, L, Law>& p)
      : geometry(geometry_at(e, q, p)), vary(vary_hit<F>(geometry, q.g)),
        slip(slip_slopes(e, q, p)),
        frame(e, q, vary.dual.template topRows<D - 1>())
  {
  }

  /// @brief How fields change along the slave facet, from their values at the
  /// displacement's nodes.
  template <int R>
  [[nodiscard]] Mat<R, F::tdim> along(const Mat<R, F::dofs>& nodal) const
  {
    return nodal * geometry.dN_s;
  }

private:
  [[nodiscard]] static SlipSlopes<F, is_frictional<Law>>
  slip_slopes(const ElementData<F, L, Law>& e, const ElementPoint<F>& q,
              const HitPoint<F, L, Law>& p)
  {
    if constexpr (is_frictional<Law>)
      return {e.master, e.history.master_old, q, p.old,
              false,    bends_at_master(e)};
    else
      return {};
  }

  [[nodiscard]] static PointGeometry<F>
  geometry_at(const ElementData<F, L, Law>& e, const ElementPoint<F>& q,
              const HitPoint<F, L, Law>& p)
  {
    PointGeometry<F> geometry =
        slave_geometry<F>(p.slave, p.N_s, F::Disp::gradients(q.xi));
    add_master_geometry<F>(geometry, e.master, p.N_m, q.eta);
    return geometry;
  }
};
} // namespace raymortar
