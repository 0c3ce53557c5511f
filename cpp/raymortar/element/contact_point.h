// Quantities computed once at a point of an element. Residual, tangent and the
// derivative along the facet share them.
#pragma once

#include "raymortar/element/old_point.h"
#include "raymortar/law/frictional.h"

namespace raymortar
{
/// @brief Slave, multiplier and measure at a point with a hit or without.
template <int D, class Law>
struct SlavePoint
{
  static constexpr int M = Law::template multiplier_size<D>;

  const Frame<D>& slave;
  Vec<M> lam;
  double gamma;
  double weight; ///< area in the measure of integration

  /// @param[in] e Has to live as long as the point
  SlavePoint(const TaylorData<D>& e, const ElementPoint& q)
      : slave(e.slave_frames.now), lam(e.lam.template block<M, 1>(0, 0)),
        gamma(e.gamma[0]), weight(area_of(e.measure, q.weight, q.area, slave))
  {
  }
};

/// @brief A point with a hit, and the law's response there.
/// @tparam Slopes With the derivatives of friction's response, which residuals
/// do without
template <int D, class Law, bool Slopes = true>
struct HitPoint : SlavePoint<D, Law>
{
  using Base = SlavePoint<D, Law>;
  using Base::M;
  using Response = std::conditional_t<
      not is_frictional<Law>, PointResponse<D, M>,
      std::conditional_t<Slopes, FrictionResponse<D, M>, PointValue<D, M>>>;
  using Old = OldPoint<D, is_frictional<Law>>;

  bool of_target; ///< the law uses the target's frame, not the slave's
  double g;       ///< length of the ray from slave to master
  double offset;  ///< added to gaps, length
  /// Whether tractions act over the gap. A multiplier closes gaps in the mean,
  /// but for what the offset leaves open
  bool has_arm;
  Vec<D> normal; ///< of the frame: n, or -n_m  [theory (2.14)]
  double gap;    ///< of the law: along that normal, with the offset
  Old old;
  Response response;

  HitPoint(const TaylorData<D>& e, const ElementPoint& q)
      : Base(e, q), of_target(e.frame_of_target), g(q.g), offset(e.offset[0]),
        has_arm(e.has_arm),
        normal(of_target ? Vec<D>(-e.master_frames.now.n) : this->slave.n),
        gap(law_gap()), old(old_point(e)), response(respond(e, q))
  {
  }

  /// @brief Whether friction makes a couple over the gap  [theory (3)].
  [[nodiscard]] bool has_couple() const
  {
    return is_frictional<Law> and has_arm;
  }

  /// @brief Whether the pressure acts on the target at the slave point's foot,
  /// and not where the ray hits  [theory (4.22)].
  [[nodiscard]] bool has_foot() const { return of_target and has_arm; }

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

  /// @brief Whether springs hold lengths, and no tractions.
  [[nodiscard]] bool springs_hold_lengths() const requires is_frictional<Law>
  {
    return M > 0 or old.elastic_slip > 0.0;
  }

  /// @brief Traction per unit of what springs hold.
  [[nodiscard]] double spring_scale() const requires is_frictional<Law>
  {
    return springs_hold_lengths() ? this->gamma : 1.0;
  }

  /// @brief Traction that friction of a penalty projects on the cone.
  [[nodiscard]] Vec<D> trial() const requires(has_cone_at_points<Law>and M == 0)
  {
    return spring_scale() * old.spring.value() - this->gamma * old.w;
  }

  /// @brief Elastic slip of a law that has it, along the traction: what the
  /// springs of the next step hold  [theory (4.51)].
  [[nodiscard]] Vec<D> elastic_slip() const requires has_cone_at_points<Law>
  {
    if constexpr (M > 0)
      return (response.held - friction()) / this->gamma;
    else
      return response.held / this->gamma;
  }

  /// @brief Energy per area that friction takes in the step: the work on the
  /// slip, with a penalty on that beyond the cone, of which springs give
  /// nothing back  [theory (4.39)], with elastic slip on what that leaves
  /// [theory (4.55)].
  /// @param[in] has_springs Whether the law keeps the rest of the slip
  [[nodiscard]] double
  dissipated(bool has_springs) const requires is_frictional<Law>
  {
    if constexpr (has_cone_at_points<Law> and M == 0)
      if (has_springs)
      {
        if (response.status != ContactStatus::slip)
          return 0.0;
        return dot<D>(along_surface(response.t), trial() - response.held) /
               this->gamma;
      }
    double work = -dot<D>(response.t, slip());
    if constexpr (has_cone_at_points<Law> and M > 0)
      if (old.elastic_slip > 0.0)
      {
        const auto was = carry_traction<D>(old.slave.old, old.slave.old_dual,
                                           this->slave, old.elastic);
        work -= dot<D>(response.t, elastic_slip() - along_surface(was.value()));
      }
    return work;
  }

private:
  [[nodiscard]] double law_gap() const
  {
    return (of_target ? g * dot<D>(normal, this->slave.n) : g) + offset;
  }

  [[nodiscard]] Vec<D> along_surface(const Vec<D>& v) const
  {
    return v - dot<D>(normal, v) * normal;
  }

  [[nodiscard]] Old old_point(const TaylorData<D>& e) const
  {
    if constexpr (is_frictional<Law>)
    {
      Old was(e);
      set_slip(was);
      was.elastic_slip = e.history.elastic_slip;
      if (was.elastic_slip > 0.0)
        was.elastic = e.history.rest;
      if (e.history.has_springs)
      {
        was.accepted = e.history.traction_old.col(0);
        was.spring = carry_traction<D>(was.slave.old, was.slave.old_dual,
                                       this->slave, was.accepted, of_target);
      }
      return was;
    }
    else
      return {};
  }

  /// [theory (2)]
  void set_slip(Old& was) const requires is_frictional<Law>
  {
    const TwoFrames<D>& master = was.master;
    was.normal = of_target ? Vec<D>(-master.old.n) : was.slave.old.n;
    was.distance = master.old.x - was.slave.old.x;
    const Vec<D>& n_0 = was.normal;
    was.across = 0.5 * (n_0 - master.old.n);
    was.closing = closed_part(dot<D>(was.across, was.distance) + offset, gap);
    was.ahead = was.distance;
    // In the frame of the target the arm has a part across its normal
    if (of_target and has_couple())
      was.ahead -= g * was.slave.old.n;
    was.slide = convect<D>(master.old, master.old_dual, master.now,
                           was.ahead - dot<D>(n_0, was.ahead) * n_0);
    was.tilt.set(was.slave.old.n, this->slave.n, master, of_target);
    was.w = was.tilt.lengthened(was.spin.turned(was.slide.value)) +
            was.closing.length * n_0;
    // Along the surface: means of the slip at nodes have another normal
    if (of_target and not has_couple())
      was.w -= g * along_surface(this->slave.n);
  }

  [[nodiscard]] auto state_of_law(const TaylorData<D>& e,
                                  const ElementPoint& q) const
  {
    const PointState<D, M> state{normal, gap, this->lam, this->gamma, e.touch};
    if constexpr (not is_frictional<Law>)
      return state;
    else
    {
      Vec<D> spring = spring_scale() * old.spring.value();
      if constexpr (M > 0)
        if (e.history.has_kept)
          spring += e.history.kept.col(0);
      return FrictionState<D, M>{state, old.w, spring, friction_law(e, q)};
    }
  }

  [[nodiscard]] Response respond(const TaylorData<D>& e,
                                 const ElementPoint& q) const
  {
    if constexpr (M > 0 and holds_at_points<Law>)
      if (q.changes)
        return respond_elsewhere(state_of_law(e, q), q.changes);
    if constexpr (not is_frictional<Law>)
      return Law::template evaluate<D>(state_of_law(e, q));
    else
      return Law::template evaluate<D, Response>(state_of_law(e, q));
  }

  /// The law linearised at a state s plus changes y: its derivatives there, and
  /// C(s + y) - C'(s + y) y as its value at s, theory (5.30). The traction is
  /// the multiplier itself, which stays. y has the change of the multiplier,
  /// and of the gap along the normal less the slip across it
  template <class State>
  [[gnu::noinline]] Response respond_elsewhere(const State& at,
                                               const double* y) const
  {
    const Eigen::Map<const Vec<D>> traction(y), way(y + D);
    Vec<M> more;
    if constexpr (M == 1)
      more[0] = dot<D>(normal, traction);
    else
      more = traction;
    const double opening = dot<D>(normal, way);
    const Vec<D> slip = opening * normal - way;
    State there = at;
    there.lam += more;
    there.g += opening;
    auto r = [&]
    {
      if constexpr (is_frictional<Law>)
      {
        there.w += slip;
        if constexpr (M == D)
          there.friction = friction_at<D>(there, at);
        return Law::template evaluate<D, FrictionResponse<D, M>>(there);
      }
      else
        return Law::template evaluate<D>(there);
    }();
    r.C -= r.C_lam * more + r.C_g * opening;
    if constexpr (is_frictional<Law>)
      r.C -= r.C_w * slip;
    if constexpr (M == 1)
    {
      r.t = this->lam[0] * normal;
      r.t_n.diagonal().setConstant(this->lam[0]);
    }
    else
      r.t = this->lam;
    return r;
  }

  [[nodiscard]] static FrictionLaw friction_law(const TaylorData<D>& e,
                                                const ElementPoint& q)
  {
    const auto& history = e.history;
    if (history.has_coefficient)
      return with_coefficient(history.friction, history.coefficient[0]);
    if (std::holds_alternative<PointBound>(history.friction))
      return q.bound;
    return history.friction;
  }
};

/// @brief How the normal of the law's frame turns with what is hit; where it is
/// the slave's nothing is set  [theory (2.14)].
template <int D>
struct FrameSlopes
{
  static constexpr int T = D - 1;
  bool of_target;
  Vec<D> n;          ///< of the master
  Mat<D, T> dual;    ///< of its tangents
  Mat<D, T> bend;    ///< derivative of that normal along the master
  Mat<D, D> by_ends; ///< by what both ends of the ray do, see chain

  /// @param[in] rho Rows of (2.6)
  FrameSlopes(const TaylorData<D>& e, const Mat<T, D>& rho)
      : of_target(e.frame_of_target)
  {
    if (not of_target)
      return;
    const Frame<D>& frame = e.master_frames.now;
    n = frame.n;
    dual = dual_tangents<D>(frame);
    bend.setZero();
    if (e.master_bends)
      bend = curvature_of<D>(e.master, frame, dual).n;
    by_ends = bend * rho;
  }
};

/// @brief Tangents and variations at a point with a hit: what tangents take
/// besides.
template <int D, class Law>
struct HitSlopes
{
  static constexpr int T = D - 1;
  Mat<D, T> dual; ///< of the slave's tangents
  /// Rows rho, dual of the master's tangents, and b of n  [theory (2.6)]
  Mat<D, D> ray;
  SlipSlopes<D, is_frictional<Law>> slip;
  FrameSlopes<D> frame;

  HitSlopes(const TaylorData<D>& e, const HitPoint<D, Law>& p)
      : dual(dual_tangents<D>(p.slave)), ray(dual_of_ray(e, p)),
        slip(slip_slopes(e, p)), frame(e, ray.template topRows<T>())
  {
  }

private:
  [[nodiscard]] static Mat<D, D> dual_of_ray(const TaylorData<D>& e,
                                             const HitPoint<D, Law>& p)
  {
    Mat<D, D> ends;
    ends.template leftCols<T>() = e.master.template middleCols<T>(1);
    ends.col(T) = p.slave.n;
    return ends.inverse();
  }

  [[nodiscard]] static SlipSlopes<D, is_frictional<Law>>
  slip_slopes(const TaylorData<D>& e, const HitPoint<D, Law>& p)
  {
    if constexpr (is_frictional<Law>)
      return {e, p.old};
    else
      return {};
  }
};
} // namespace raymortar
