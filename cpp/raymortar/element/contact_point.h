// What is computed once at a point of an element: its residual, its tangent and
// the derivative along the facet take it from here.
#pragma once

#include "raymortar/element/carried.h"
#include "raymortar/element/convected.h"
#include "raymortar/element/element_data.h"

namespace raymortar
{
/// @brief Slave, multiplier and measure at a point with a hit or without.
template <class F, int L, class Law>
struct SlavePoint
{
  using Layout = ElementLayout<F, L, Law>;
  using Data = ElementData<F, L, Law>;
  static constexpr int D = F::gdim;
  static constexpr int M = Layout::components;

  Frame<D> slave;
  Vec<F::dofs> N_s;
  Vec<Layout::multipliers> shape; ///< test functions of its unknowns
  Vec<M> lam;
  double gamma;
  double weight; ///< area in the measure of integration

  SlavePoint(const Data& e, const ElementPoint<F>& q)
      : slave(frame_at<F>(e.slave, q.xi)), N_s(F::Disp::values(q.xi)),
        gamma(N_s.dot(e.gamma)),
        weight(e.current ? q.weight * slave.jacobian : q.area)
  {
    if constexpr (L > 0)
    {
      shape = e.lam_scale * F::template Basis<L>::values(q.xi);
      lam = e.lam * shape;
    }
  }
};

/// @brief The accepted step at a point; nothing without friction.
template <class F, bool Frictional>
struct OldPoint
{
};

template <class F>
struct OldPoint<F, true>
{
  Frame<F::gdim> frame;  ///< of the slave
  Frame<F::gdim> master; ///< of the point that is hit now
  Frame<F::gdim> master_now;
  Vec<F::gdim> distance; ///< from the slave's point to the master's
  /// Mean of the slave's normal and the master's reversed one. The distance
  /// between two points of one circle has no part along it, so that curvature
  /// is not taken for a gap
  Vec<F::gdim> across;
  Closing closing;
  ConvectedVector<F::gdim> slide;  ///< distance along the slave, carried along
  Vec<F::gdim> w;                  ///< slip increment (2)
  Vec<F::gdim> accepted;           ///< of springs, see ContactState
  CarriedTraction<F::gdim> spring; ///< made of it
};

/// @brief A point with a hit, and the law's response there.
template <class F, int L, class Law>
struct HitPoint : SlavePoint<F, L, Law>
{
  using Base = SlavePoint<F, L, Law>;
  using Base::D;
  using Base::M;
  using typename Base::Data;
  using Response =
      std::conditional_t<is_frictional<Law>, FrictionResponse<D, M>,
                         PointResponse<D, M>>;

  Vec<F::dofs> N_m; ///< master shape functions at eta
  double offset;    ///< added to gaps, length
  OldPoint<F, is_frictional<Law>> old;
  Response response;

  HitPoint(const Data& e, const ElementPoint<F>& q)
      : Base(e, q), N_m(F::Disp::values(q.eta)),
        offset(this->N_s.dot(e.offset)), old(old_point(e, q)),
        response(respond(e, q))
  {
  }

  /// @brief Tangential traction of the law.
  [[nodiscard]] Vec<D> friction() const requires is_frictional<Law>
  {
    Vec<D> t = response.t;
    if constexpr (M > 0)
      t += response.C;
    return t - this->slave.n.dot(t) * this->slave.n;
  }

private:
  [[nodiscard]] OldPoint<F, is_frictional<Law>>
  old_point(const Data& e, const ElementPoint<F>& q) const
  {
    OldPoint<F, is_frictional<Law>> was;
    if constexpr (is_frictional<Law>)
    {
      was.frame = frame_at<F>(e.history.slave_old, q.xi);
      was.master = frame_at<F>(e.history.master_old, q.eta);
      was.master_now = frame_at<F>(e.master, q.eta);
      was.distance = was.master.x - was.frame.x;
      const Vec<D>& n_0 = was.frame.n;
      const double g_0 = n_0.dot(was.distance);
      was.across = 0.5 * (n_0 - was.master.n);
      was.closing =
          closed_part(was.across.dot(was.distance) + offset, q.g + offset);
      was.slide =
          convect<D>(was.master, was.master_now, was.distance - g_0 * n_0);
      was.w = was.slide.value + was.closing.length * n_0;
      was.accepted = e.history.traction_old * this->N_s;
      was.spring = carry_traction<D>(was.frame, this->slave, was.accepted);
    }
    return was;
  }

  [[nodiscard]] Response respond(const Data& e, const ElementPoint<F>& q) const
  {
    const PointState<D, M> state{this->slave.n, q.g + offset, this->lam,
                                 this->gamma, e.touch};
    if constexpr (not is_frictional<Law>)
      return Law::template evaluate<D>(state);
    else
    {
      Vec<D> spring = old.spring.value();
      if constexpr (M > 0)
        spring *= this->gamma;
      return Law::template evaluate<D>(
          FrictionState<D, M>{state, old.w, spring, friction_law(e, q)});
    }
  }

  [[nodiscard]] FrictionLaw friction_law(const Data& e,
                                         const ElementPoint<F>& q) const
  {
    const auto& history = e.history;
    if (history.has_coefficient)
      return with_coefficient(history.friction,
                              this->N_s.dot(history.coefficient));
    if (std::holds_alternative<PointBound>(history.friction))
      return q.bound;
    return history.friction;
  }
};

/// @brief How the slip changes with the point that is hit, and with its master.
template <class F, bool Frictional>
struct SlipSlopes
{
};

template <class F>
struct SlipSlopes<F, true>
{
  static constexpr int D = F::gdim;
  Mat<D, F::tdim> dual; ///< of the master's tangents
  Mat<D, D> by_distance;
  Mat<D, F::tdim> by_eta;

  /// [theory (2.9)]
  SlipSlopes(const typename F::NodeMatrix& master_nodes,
             const typename F::NodeMatrix& master_old, const ElementPoint<F>& q,
             const OldPoint<F, true>& was)
      : dual(dual_tangents<D>(was.master_now.t)),
        by_distance(was.slide.carry -
                    was.slide.carry * was.frame.n * was.frame.n.transpose() +
                    was.closing.by_old * was.frame.n * was.across.transpose()),
        by_eta(by_distance * was.master.t)
  {
    if constexpr (not F::affine)
    {
      const Curvature<D> old = curvature_at<F>(master_old, q.eta, was.master);
      by_eta += convected_along_master<F>(
          was.slide, old,
          curvature_at<F>(master_nodes, q.eta, was.master_now, dual));
      by_eta -= 0.5 * was.closing.by_old * was.frame.n *
                (was.distance.transpose() * old.n);
    }
  }
};

/// @brief Tangents and variations at a point with a hit: what tangents take
/// besides.
template <class F, int L, class Law>
struct HitSlopes
{
  PointGeometry<F> geometry;
  Variations<F> vary;
  SlipSlopes<F, is_frictional<Law>> slip;

  HitSlopes(const ElementData<F, L, Law>& e, const ElementPoint<F>& q,
            const HitPoint<F, L, Law>& p)
      : geometry(geometry_at(e, q, p)), vary(vary_hit<F>(geometry, q.g)),
        slip(slip_slopes(e, q, p))
  {
  }

private:
  [[nodiscard]] static SlipSlopes<F, is_frictional<Law>>
  slip_slopes(const ElementData<F, L, Law>& e, const ElementPoint<F>& q,
              const HitPoint<F, L, Law>& p)
  {
    if constexpr (is_frictional<Law>)
      return {e.master, e.history.master_old, q, p.old};
    else
      return {};
  }

  [[nodiscard]] static PointGeometry<F>
  geometry_at(const ElementData<F, L, Law>& e, const ElementPoint<F>& q,
              const HitPoint<F, L, Law>& p)
  {
    PointGeometry<F> geometry = slave_geometry<F>(p.slave, p.N_s, q.xi);
    add_master_geometry<F>(geometry, e.master, p.N_m, q.eta);
    return geometry;
  }
};
} // namespace raymortar
