// Quantities computed once at a point of an element. Residual, tangent and the
// derivative along the facet share them.
#pragma once

#include "raymortar/element/old_point.h"

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
        weight(area_of(e.measure, q.weight, q.area, slave))
  {
    set_multiplier(e, q);
  }

  /// @param[in] frame Of the slave
  /// @param[in] N Its shape functions
  SlavePoint(const Data& e, const ElementPoint<F>& q, const Frame<D>& frame,
             const Vec<F::dofs>& N)
      : slave(frame), N_s(N), gamma(N_s.dot(e.gamma)),
        weight(area_of(e.measure, q.weight, q.area, slave))
  {
    set_multiplier(e, q);
  }

  /// @brief A field there, from its values at the displacement's nodes.
  [[nodiscard]] double value(const Vec<F::dofs>& nodal) const
  {
    return N_s.dot(nodal);
  }
  [[nodiscard]] Vec<D> value(const Mat<D, F::dofs>& nodal) const
  {
    return nodal * N_s;
  }

private:
  void set_multiplier(const Data& e, const ElementPoint<F>& q)
  {
    if constexpr (L > 0)
    {
      shape = e.lam_scale * F::template Basis<L>::values(q.xi);
      lam = e.lam * shape;
    }
  }
};

/// @brief A point with a hit, and the law's response there.
/// @tparam Slopes With the derivatives of friction's response, which residuals
/// do without
template <class F, int L, class Law, bool Slopes = true>
struct HitPoint : SlavePoint<F, L, Law>, TargetFrame<F>
{
  using Target = TargetFrame<F>;
  using Target::of_target;
  using Base = SlavePoint<F, L, Law>;
  using Base::D;
  using Base::M;
  using typename Base::Data;
  using Response = std::conditional_t<
      not is_frictional<Law>, PointResponse<D, M>,
      std::conditional_t<Slopes, FrictionResponse<D, M>, PointValue<D, M>>>;

  typename F::RefPoint xi; ///< on the slave
  double g;                ///< length of the ray from slave to master
  Vec<F::dofs> N_m;        ///< master shape functions at eta
  double offset;           ///< added to gaps, length
  Vec<D> normal;           ///< of the frame: n, or -n_m  [theory (2.14)]
  double gap;              ///< of the law: along that normal, with the offset
  OldPoint<F, is_frictional<Law>> old;
  Response response;

  using States = ElementStates<F, is_frictional<Law>>;

  HitPoint(const Data& e, const ElementPoint<F>& q) : HitPoint(e, States(e), q)
  {
  }

  /// @param[in] states Of this element: the same for all of its points
  HitPoint(const Data& e, const States& states,
           const ElementPoint<F>& q) requires is_frictional<Law>
      : HitPoint(e, states, q, NodeShapes<F>(q.xi))
  {
  }
  HitPoint(const Data& e, const States&, const ElementPoint<F>& q)
      : Base(e, q), Target(frame_of_target(e)), xi(q.xi), g(q.g),
        N_m(F::Disp::values(q.eta)), offset(this->value(e.offset)),
        normal(of_target ? Vec<D>(-master_frame(e, q).n) : this->slave.n),
        gap(law_gap()), response(respond(e, q))
  {
  }

  /// @brief Whether friction makes a couple over the gap  [theory (3)].
  [[nodiscard]] bool has_couple() const
  {
    return is_frictional<Law> and has_arm();
  }

  /// @brief Whether the pressure acts on the target at the slave point's foot,
  /// and not where the ray hits  [theory (4.22)].
  [[nodiscard]] bool has_foot() const { return of_target and has_arm(); }

  /// @brief Traction along the normal of the frame.
  [[nodiscard]] double pressure() const { return dot<D>(normal, response.t); }

  /// @brief How that changes along some columns with traction and normal.
  template <class Matrix>
  [[nodiscard]] auto pressure_change(const Matrix& dt, const Matrix& dnu) const
  {
    return Mat<1, Matrix::ColsAtCompileTime>(normal.transpose() * dt +
                                             response.t.transpose() * dnu);
  }
  /// @brief The same of the part of the traction across the normal.
  template <class Matrix>
  [[nodiscard]] Matrix across_change(const Matrix& dt, const Matrix& dnu) const
  {
    return dt - pressure() * dnu - normal * pressure_change(dt, dnu);
  }

  /// @brief Part of a traction that makes a couple: in the frame of the target
  /// the part along its normal acts on both sides along one line.
  [[nodiscard]] Vec<D> turning(const Vec<D>& t) const
  {
    return of_target ? along_surface(t) : t;
  }

  /// @brief Tangential traction of the law.
  [[nodiscard]] Vec<D> friction() const requires is_frictional<Law>
  {
    Vec<D> t = response.t;
    if constexpr (M > 0)
      t += response.C;
    return along_surface(t);
  }

  /// @brief Slip along the surface, T_n w of (2): what the traction works on.
  [[nodiscard]] Vec<D> slip() const requires is_frictional<Law>
  {
    return along_surface(old.w);
  }

private:
  /// A multiplier closes gaps in the mean, but for what the offset leaves open
  [[nodiscard]] bool has_arm() const { return M == 0 or offset != 0.0; }

  [[nodiscard]] double law_gap() const
  {
    return (of_target ? g * dot<D>(normal, this->slave.n) : g) + offset;
  }

  [[nodiscard]] Vec<D> along_surface(const Vec<D>& v) const
  {
    return v - dot<D>(normal, v) * normal;
  }

  HitPoint(const Data& e, const States& states, const ElementPoint<F>& q,
           const NodeShapes<F>& shapes) requires is_frictional<Law>
      : HitPoint(e, states, q, shapes, states.slave.at(shapes))
  {
  }

  HitPoint(const Data& e, const States& states, const ElementPoint<F>& q,
           const NodeShapes<F>& shapes,
           const TwoFrames<D>& frames) requires is_frictional<Law>
      : Base(e, q, frames.now, shapes.displacement(q.xi)),
        Target(frame_of_target(e)),
        xi(q.xi),
        g(q.g),
        offset(this->value(e.offset))
  {
    const NodeShapes<F> at_eta(q.eta);
    N_m = at_eta.displacement(q.eta);
    old.frame = frames.old;
    old.dual = frames.old_dual;
    states.master.set(old.master, at_eta);
    states.set_spin(old.spin, frames, old.master);
    set_normals();
    gap = law_gap();
    set_slip();
    set_spring(e);
    response = respond(e, q);
  }

  void set_normals() requires is_frictional<Law>
  {
    normal = of_target ? Vec<D>(-old.master.now.n) : this->slave.n;
    old.normal = of_target ? Vec<D>(-old.master.old.n) : old.frame.n;
  }

  /// [theory (2)]
  void set_slip() requires is_frictional<Law>
  {
    const TwoFrames<D>& master = old.master;
    old.distance = master.old.x - old.frame.x;
    const Vec<D>& n_0 = old.normal;
    old.across = 0.5 * (n_0 - master.old.n);
    old.closing = closed_part(dot<D>(old.across, old.distance) + offset, gap);
    old.ahead = old.distance;
    // In the frame of the target the arm has a part across its normal
    if (of_target and has_couple())
      old.ahead -= g * old.frame.n;
    old.slide = convect<D>(master.old, master.old_dual, master.now,
                           old.ahead - dot<D>(n_0, old.ahead) * n_0);
    old.w = old.spin.turned(old.slide.value) + old.closing.length * n_0;
    // Along the surface: means of the slip at nodes have another normal
    if (of_target and not has_couple())
      old.w -= g * along_surface(this->slave.n);
  }

  void set_spring(const Data& e) requires is_frictional<Law>
  {
    if (not e.history.has_springs)
      return;
    old.accepted = this->value(e.history.traction_old);
    old.spring = carry_traction<D>(old.frame, old.dual, this->slave,
                                   old.accepted, of_target);
  }

  [[nodiscard]] Response respond(const Data& e, const ElementPoint<F>& q) const
  {
    const PointState<D, M> state{normal, gap, this->lam, this->gamma, e.touch};
    if constexpr (not is_frictional<Law>)
      return Law::template evaluate<D>(state);
    else
    {
      Vec<D> spring = old.spring.value();
      if constexpr (M > 0)
      {
        spring *= this->gamma;
        if (e.history.has_kept)
          spring += this->value(e.history.kept);
      }
      return Law::template evaluate<D, Response>(
          FrictionState<D, M>{state, old.w, spring, friction_law(e, q)});
    }
  }

  [[nodiscard]] FrictionLaw friction_law(const Data& e,
                                         const ElementPoint<F>& q) const
  {
    const auto& history = e.history;
    if (history.has_coefficient)
      return with_coefficient(history.friction,
                              this->value(history.coefficient));
    if (std::holds_alternative<PointBound>(history.friction))
      return q.bound;
    return history.friction;
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
