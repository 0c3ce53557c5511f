// Derivative of an element's residual by what it depends on besides unknowns.
#pragma once

#include "raymortar/adjoint/old_slopes.h"
#include "raymortar/adjoint/parameter.h"
#include "raymortar/nodes/nodal_element.h"

namespace raymortar
{
/// @brief Sums blocks of derivatives by a parameter, point by point
/// [theory (8.6)].
///
/// The residual is linear in traction and condition of a point, so that the
/// kernel's rows serve for their derivatives: what varies here is a
/// `TaylorRows` as that of a tangent, of a field on the slave or of positions.
/// @tparam Kernel That of the tangent
template <int D, class Law, class Kernel>
class ParameterElement : public Kernel
{
public:
  using Base = AnyElement<D, Law>;
  static constexpr int T = D - 1;
  static constexpr int M = Kernel::M;
  using Shapes = typename Kernel::Shapes;
  using Data = typename Kernel::Data;
  using Slave = typename Kernel::Slave;
  using Hit = typename Base::template Hit<true>;
  using HitTangent = typename Kernel::HitTangent;
  using Columns = typename Kernel::Columns;

  explicit ParameterElement(const Parameter& by) : _by(by) {}

  /// @brief Add the point that is placed.
  /// @param[in] points Of the tangent, see PointsOf
  /// @param[in] target Of the element
  template <class Points>
  void add(const Points& points, Index target)
  {
    if (not points.has_target)
      add_miss(points.data, Slave(points.data, points.at), points.shapes);
    else if (_by.kind != Parameter::Kind::tool or target == _by.tool)
      add_hit(points, Hit(points.data, points.at));
  }

protected:
  /// A point with its data
  struct Point
  {
    const Data& e;
    const Hit& p;
    HitTangent by;
  };

  template <class Points>
  void add_hit(const Points& points, const Hit& p)
  {
    const Data& e = points.data;
    const Shapes& at = points.shapes;
    // All that an open point does is what its multiplier does
    if (M == 0 and p.response.status == ContactStatus::open)
      return;
    const Point here{e, p, HitTangent(e, p)};
    const auto dt = vary<D>(traction_slopes(p), p.response.t, here);
    add_work(p.weight, dt, at);
    add_arms(here, dt, at);
    if constexpr (Kernel::has_condition)
      add_condition(p.weight / p.gamma,
                    vary<M>(condition_slopes(p), p.response.C, here), at);
    if constexpr (not holds_at_points<Law>)
      for (int k = 0; k < points.nodes->size(); ++k)
      {
        const RowAtPoint<D, M> row = points.nodes->row(e, p, k);
        const PointSlopes<D, Law> by_point(points.nodes->at(k), row);
        UnknownRows<M, D> rows{};
        expand<M, D>(at, vary<M>(by_point.slopes(), row.value, here),
                     part_of(at), rows);
        this->add_rows(p.weight * at.scale, k, rows, at);
      }
  }

  /// Add a point without a hit: its area alone varies
  void add_miss(const Data& e, const Slave& p, const Shapes& at)
  {
    if constexpr (Kernel::has_condition)
      if (_by.kind == Parameter::Kind::reference)
      {
        TaylorRows<M, D> rows = none<M>();
        add_undeformed_area<M>(e, Law::template without_hit<D>(p.lam), rows);
        add_condition(p.weight / p.gamma, rows, at);
      }
  }

  [[nodiscard]] static Frame<D> reference_frame(const Data& e)
  {
    Frame<D> frame;
    frame.x = e.reference.col(0);
    frame.t = e.reference.template middleCols<T>(1);
    set_normal(frame);
    return frame;
  }

  template <int R>
  [[nodiscard]] static TaylorRows<R, D> none()
  {
    TaylorRows<R, D> rows;
    rows.slave.fill(Mat<R, D>::Zero());
    rows.target.fill(Mat<R, D>::Zero());
    return rows;
  }

  /// Columns of a target's facet; tools have none here
  [[nodiscard]] static TargetPart part_of(const Shapes& at)
  {
    return at.target_nodes > 0 ? TargetPart::all : TargetPart::none;
  }

  /// Derivative of R numbers that a law gives, per area
  template <int R, class Slopes>
  [[nodiscard]] TaylorRows<R, D> vary(const Slopes& law, const Vec<R>& value,
                                      const Point& here) const
  {
    TaylorRows<R, D> rows = none<R>();
    switch (_by.kind)
    {
    case Parameter::Kind::fields:
      add_fields<R>(law, here, rows);
      break;
    case Parameter::Kind::gamma:
      set_column(rows.slave[0], 0, by_log_gamma<R>(law, here.p));
      break;
    case Parameter::Kind::old:
      rows = by_old<R>(law, here);
      break;
    case Parameter::Kind::springs:
      if constexpr (requires { law.by_w; })
        rows.slave[0] =
            law.by_spring *
            spring_by_held<D>(here.p.old, here.p.slave, here.p.of_target);
      break;
    case Parameter::Kind::unknowns:
      rows = chain<R>(law, here.p, here.by, Columns(here.p, here.by, true));
      break;
    case Parameter::Kind::reference:
      add_undeformed_area<R>(here.e, value, rows);
      break;
    case Parameter::Kind::tool:
    {
      const Columns columns(here.p, here.by, true);
      const auto now = chain<R>(law, here.p, here.by, columns);
      add_motion<R>(_by.now, here.e.master_frames.now, now, rows);
      if constexpr (is_frictional<Law>)
        add_motion<R>(_by.old, here.e.master_frames.old, by_old<R>(law, here),
                      rows);
      break;
    }
    }
    return rows;
  }

  /// Offset and coefficient are added in the first two columns
  template <int R, class Slopes>
  static void add_fields(const Slopes& law, const Point& here,
                         TaylorRows<R, D>& rows)
  {
    Vec<R> by_offset = law.by_g;
    if constexpr (requires { law.by_w; })
    {
      const auto& was = here.p.old;
      by_offset +=
          (was.closing.by_now + was.closing.by_old) * (law.by_w * was.normal);
      set_column(rows.slave[0], 1, Vec<R>(law.by_coefficient));
    }
    set_column(rows.slave[0], 0, by_offset);
  }

  /// See FacetColumns::add_fields
  template <int R, class Slopes>
  [[nodiscard]] static Vec<R> by_log_gamma(const Slopes& law, const Hit& p)
  {
    Vec<R> by = p.gap * law.by_g;
    if constexpr (requires { law.by_w; })
      by += law.by_w * p.old.w - law.by_rate;
    return by;
  }

  template <int R, class Slopes>
  [[nodiscard]] static TaylorRows<R, D> by_old(const Slopes& law,
                                               const Point& here)
  {
    TaylorRows<R, D> rows = none<R>();
    if constexpr (requires { law.by_w; })
    {
      const Hit& p = here.p;
      const double arm = p.has_couple() ? p.g : 0.0;
      const auto slip = OldSlopes<D>(p.old, here.by.slip, p.slave,
                                     here.e.frame_of_target, arm)
                            .rows();
      for (std::size_t k = 0; k < D; ++k)
      {
        rows.slave[k] = law.by_w * slip.slave[k];
        rows.target[k] = law.by_w * slip.target[k];
      }
      if (not p.old.spring.is_zero())
        for (int j = 0; j < T; ++j)
          rows.slave[static_cast<std::size_t>(1 + j)] +=
              law.by_spring * spring_by_old_tangent<D>(p.old, p.slave, j);
    }
    return rows;
  }

  /// The undeformed area varies as the deformed one does  [theory (2.4)]
  template <int R>
  static void add_undeformed_area(const Data& e, const Vec<R>& f,
                                  TaylorRows<R, D>& rows)
  {
    if (moves(e.measure))
      return;
    const Frame<D> frame = reference_frame(e);
    const Mat<D, T> dual = dual_tangents<D>(frame);
    for (int j = 0; j < T; ++j)
      rows.slave[static_cast<std::size_t>(1 + j)] +=
          f * column(dual, j).transpose();
    if constexpr (D == 2)
      if (revolves(e.measure))
        rows.slave[0].col(0) += f / frame.x[0];
  }

  /// Add what motions of the target do to its coefficients, each in a column
  template <int R>
  static void add_motion(const std::vector<AffineRate>& motions,
                         const Frame<D>& target, const TaylorRows<R, D>& by,
                         TaylorRows<R, D>& rows)
  {
    for (std::size_t k = 0; k < motions.size(); ++k)
    {
      const Mat<D, D> slope = motions[k].slope.template topLeftCorner<D, D>();
      const Vec<D> shift = motions[k].shift.template head<D>();
      Vec<R> change = by.target[0] * Vec<D>(shift + slope * target.x);
      for (int j = 0; j < T; ++j)
        change += by.target[static_cast<std::size_t>(1 + j)] *
                  Vec<D>(slope * column(target.t, j));
      const auto i = static_cast<int>(k);
      set_column(rows.slave[0], i, Vec<R>(column(rows.slave[0], i) + change));
    }
  }

  /// Rows by the motions of a tool, from rows by displacements
  template <int R>
  [[nodiscard]] TaylorRows<R, D> moved(const TaylorRows<R, D>& by,
                                       const Point& here) const
  {
    TaylorRows<R, D> rows = none<R>();
    if (_by.kind == Parameter::Kind::tool)
      add_motion<R>(_by.now, here.e.master_frames.now, by, rows);
    return rows;
  }

  void add_work(double w, const TaylorRows<D, D>& dt, const Shapes& at)
  {
    UnknownRows<D, D> rows{};
    expand<D, D>(at, dt, part_of(at), rows);
    this->add_work_rows(w, rows, at.size(), at);
  }

  void add_condition(double w, const TaylorRows<M, D>& dC, const Shapes& at)
  {
    UnknownRows<M, D> rows{};
    expand<M, D>(at, dC, part_of(at), rows);
    this->template add_condition_rows<M>(w, rows, at.size(), at);
  }

  /// Derivatives of what tractions do at the ends of arms
  void add_arms(const Point& here, const TaylorRows<D, D>& dt, const Shapes& at)
  {
    const Hit& p = here.p;
    const bool has_foot = p.has_foot() and at.has_target();
    if (not p.has_couple() and not has_foot)
      return;
    const Columns columns(p, here.by, true);
    const auto dg =
        moved<1>(Kernel::vary_gap(here.e, p, here.by, columns), here);
    auto dnu = none<D>();
    if (p.of_target)
      dnu = moved<D>(Kernel::vary_normal(p, here.by, columns), here);
    if constexpr (is_frictional<Law>)
      if (p.has_couple())
      {
        const auto turning = p.of_target ? Kernel::across_rows(p, dt, dnu) : dt;
        const Mat<T, D> across = here.by.dual.transpose();
        add_turn(Side::slave, p, p.slave.n,
                 arm_rows<D>(across, Vec<T>(across * p.turning(p.response.t)),
                             turning, dg, p.g),
                 here.by.dual, at);
      }
    if (not has_foot)
      return;
    const Vec<T> share = here.by.frame.dual.transpose() * p.slave.n;
    add_turn(Side::target, p, here.by.frame.n,
             arm_rows<1>(share, Vec<T>(share * p.pressure()),
                         Kernel::pressure_rows(p, dt, dnu), dg, p.g),
             here.by.frame.dual, at);
  }

  /// Derivative of g times what is made of a force by a matrix
  template <int R>
  [[nodiscard]] static TaylorRows<T, D>
  arm_rows(const Mat<T, R>& take, const Vec<T>& taken,
           const TaylorRows<R, D>& force, const TaylorRows<1, D>& dg, double g)
  {
    TaylorRows<T, D> rows;
    for (std::size_t k = 0; k < D; ++k)
    {
      rows.slave[k] = taken * dg.slave[k] + g * (take * force.slave[k]);
      rows.target[k] = taken * dg.target[k] + g * (take * force.target[k]);
    }
    return rows;
  }

  void add_turn(Side side, const Hit& p, const Vec<D>& n,
                const TaylorRows<T, D>& by, const Mat<D, T>& dual,
                const Shapes& at)
  {
    UnknownRows<T, D> rows{};
    expand<T, D>(at, by, part_of(at), rows);
    this->add_turn_rows(side, p.weight, n, rows, Vec<T>(Vec<T>::Zero()), dual,
                        at);
  }

  const Parameter& _by;
};
} // namespace raymortar
