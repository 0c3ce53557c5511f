// Derivative of the integrand along the slave facet. Moving integration points
// add it to the tangent.
#pragma once

#include "raymortar/element/any_element.h"

namespace raymortar
{
/// @brief Integrand of one point per unit of its weight, and its derivative by
/// each coordinate of the slave facet, over the unknowns of the element.
template <int D>
struct AnyIntegrand
{
  using Row = std::array<double, PointShapes<D>::most>;
  Row f;
  std::array<Row, static_cast<std::size_t>(D - 1)> f_xi;
};

/// @brief Differentiates the integrand along the slave surface.
///
/// The chain rule is the one of the element's tangent: along xi the slave
/// varies by its own tangents, the target not at all  [theory (3.11)].
template <int D, class Law>
class TaylorGradient
{
public:
  using Kernel = AnyElement<D, Law>;
  using Data = typename Kernel::Data;
  using Hit = typename Kernel::template Hit<true>;
  static constexpr int T = D - 1;
  static constexpr int M = Kernel::M;

  /// @brief How what does not depend on the target changes along the slave.
  struct Place
  {
    Curvature<D> bend;
    AreaAlong<D> area; ///< in the measure of integration
    Mat<1, T> log_gamma;

    Place(const Data& e, const SlavePoint<D, Law>& p, const Mat<D, T>& dual)
        : bend(e.slave_bends ? curvature_of<D>(e.slave, p.slave, dual)
                             : no_curvature<D>()),
          area(area_of(e, p)),
          log_gamma(e.gamma.template tail<T>().transpose() / p.gamma)
    {
    }

  private:
    [[nodiscard]] AreaAlong<D> area_of(const Data& e,
                                       const SlavePoint<D, Law>& p) const
    {
      if (moves(e.measure))
        return area_along<D>(e.measure, p.slave, bend);
      Frame<D> frame;
      frame.x = e.reference.col(0);
      frame.t = e.reference.template middleCols<T>(1);
      set_normal(frame);
      return area_along<D>(
          e.measure, frame,
          e.slave_bends
              ? curvature_of<D>(e.reference, frame, dual_tangents<D>(frame))
              : no_curvature<D>());
    }
  };

  /// @brief Of a point with a hit.
  static void hit(const Data& e, const ElementPoint& q, const Hit& p,
                  const HitSlopes<D, Law>& slopes, const PointShapes<D>& at,
                  AnyIntegrand<D>& out)
  {
    const Place along(e, p, slopes.dual);
    const Mat<M, T> lam = e.lam.template block<M, T>(0, 1);
    const FacetColumns<D, Law> columns(e, q, p, slopes, along.bend,
                                       along.log_gamma, lam);
    const auto& r = p.response;
    const Mat<D, T> t = chain<D>(traction_slopes(p), p, slopes, columns) +
                        r.t * along.area.log_jacobian;
    set_work(r.t, t, columns.eta(), along.area.jacobian, at, out);
    if (p.of_target)
      add_arms(e, p, slopes, along, columns, t, at, out);
    else if constexpr (is_frictional<Law>)
    {
      if (p.has_couple())
        add_couple(p, slopes, along, r.t, t, at, out);
    }
    if constexpr (Kernel::has_condition)
      set_condition(p, along, r.C,
                    chain<M>(condition_slopes(p), p, slopes, columns), at, out);
  }

  /// @brief Of a point without a hit.
  static void miss(const Data& e, const SlavePoint<D, Law>& p,
                   const PointShapes<D>& at, AnyIntegrand<D>& out)
  {
    std::fill_n(out.f.begin(), at.size(), 0.0);
    for (auto& rate : out.f_xi)
      std::fill_n(rate.begin(), at.size(), 0.0);
    if constexpr (M > 0)
      set_condition(p, Place(e, p, dual_tangents<D>(p.slave)),
                    Law::template without_hit<D>(p.lam),
                    -e.lam.template block<M, T>(0, 1), at, out);
  }

private:
  /// Set the rows of one node
  static void set(AnyIntegrand<D>& out, int row, const Vec<D>& f,
                  const Mat<D, T>& f_xi)
  {
    for (int i = 0; i < D; ++i)
    {
      const auto r = static_cast<std::size_t>(row + i);
      out.f[r] = f[i];
      for (int j = 0; j < T; ++j)
        out.f_xi[static_cast<std::size_t>(j)][r] = f_xi(i, j);
    }
  }

  /// Add to the rows of one node
  static void add(AnyIntegrand<D>& out, int row, const Vec<D>& f,
                  const Mat<D, T>& f_xi)
  {
    for (int i = 0; i < D; ++i)
    {
      const auto r = static_cast<std::size_t>(row + i);
      out.f[r] += f[i];
      for (int j = 0; j < T; ++j)
        out.f_xi[static_cast<std::size_t>(j)][r] += f_xi(i, j);
    }
  }

  /// - t . (v_s - v_m), with t_xi including the change of area
  static void set_work(const Vec<D>& t, const Mat<D, T>& t_xi,
                       const Mat<T, T>& eta_xi, double area,
                       const PointShapes<D>& at, AnyIntegrand<D>& out)
  {
    const Vec<D> force = area * t;
    const Mat<D, T> change = area * t_xi;
    for (int a = 0; a < at.slave_nodes; ++a)
    {
      const double N = at.slave[static_cast<std::size_t>(a)][0];
      set(out, D * a, -N * force,
          -N * change - force * at.slave_gradient(a).transpose());
    }
    for (int a = 0; a < at.target_nodes; ++a)
    {
      const double N = at.target[static_cast<std::size_t>(a)][0];
      const Mat<1, T> rate = at.target_gradient(a).transpose() * eta_xi;
      set(out, at.alone() + D * a, N * force, N * change + force * rate);
    }
    for (int k = 0; k < at.body_unknowns; ++k)
    {
      const auto moves = at.body.col(k);
      const auto row = static_cast<std::size_t>(at.alone() + k);
      Mat<1, T> rate = moves.template head<D>().transpose() * change;
      for (int i = 0; i < T; ++i)
        rate +=
            moves.template segment<D>(D * (1 + i)).dot(force) * eta_xi.row(i);
      out.f[row] = moves.template head<D>().dot(force);
      for (int j = 0; j < T; ++j)
        out.f_xi[static_cast<std::size_t>(j)][row] = rate[j];
    }
  }

  /// Add the moments of tractions at the ends of arms, in the target's frame
  /// @param[in] t_xi With the change of area
  static void add_arms(const Data& e, const Hit& p,
                       const HitSlopes<D, Law>& slopes, const Place& along,
                       const FacetColumns<D, Law>& columns,
                       const Mat<D, T>& t_xi, const PointShapes<D>& at,
                       AnyIntegrand<D>& out)
  {
    const Mat<D, D>& by_ends = slopes.frame.by_ends;
    const Mat<D, T> nu_xi = columns.template ray<D>(-p.g * by_ends, by_ends);
    if constexpr (is_frictional<Law>)
      if (p.has_couple())
        add_couple(p, slopes, along, p.turning(p.response.t),
                   p.across_change(t_xi, nu_xi), at, out);
    if (p.has_foot() and at.has_target())
      add_foot(e, p, slopes, along, columns.eta(),
               p.pressure_change(t_xi, nu_xi), at, out);
  }

  /// p g n . d(nu)  [theory (4.22)]
  static void add_foot(const Data& e, const Hit& p,
                       const HitSlopes<D, Law>& slopes, const Place& along,
                       const Mat<T, T>& eta_xi, const Mat<1, T>& p_xi,
                       const PointShapes<D>& at, AnyIntegrand<D>& out)
  {
    const Vec<D>&n = p.slave.n, &n_m = slopes.frame.n;
    const Mat<D, T>& dual = slopes.frame.dual;
    const double area = along.area.jacobian, arm = area * p.g * p.pressure();
    const Vec<T> share = dual.transpose() * n;
    const Vec<T> foot = arm * share;
    Mat<T, T> foot_xi =
        area * share *
            (p.g * p_xi + p.pressure() * ray_along(p, slopes, along)) +
        dual.transpose() * (arm * along.bend.n);
    if (e.master_bends)
      foot_xi +=
          along_facet<D>(turned_by<D>(dual, n_m, arm * n), e.master) * eta_xi;
    const Mat<D, T> bend_xi = slopes.frame.bend * eta_xi;
    for (int a = 0; a < at.target_nodes; ++a)
    {
      const double turn = at.target_gradient(a).dot(foot);
      Mat<1, T> turn_xi = at.target_gradient(a).transpose() * foot_xi;
      if (e.master_bends)
        turn_xi += (at.target_second(a) * foot).transpose() * eta_xi;
      add(out, at.alone() + D * a, turn * n_m, n_m * turn_xi + turn * bend_xi);
    }
    for (int k = 0; k < at.body_unknowns; ++k)
    {
      Vec<D> moved = Vec<D>::Zero();
      for (int j = 0; j < T; ++j)
        moved += foot[j] * at.body.col(k).template segment<D>(D * (1 + j));
      const auto row = static_cast<std::size_t>(at.alone() + k);
      const Mat<1, T> rate = at.body_rates(k, n_m).transpose() * foot_xi +
                             moved.transpose() * bend_xi;
      out.f[row] += n_m.dot(moved);
      for (int j = 0; j < T; ++j)
        out.f_xi[static_cast<std::size_t>(j)][row] += rate[j];
    }
  }

  /// Derivative of the ray's length
  [[nodiscard]] static Mat<1, T>
  ray_along(const Hit& p, const HitSlopes<D, Law>& slopes, const Place& along)
  {
    const Mat<1, D> along_ray = slopes.ray.row(D - 1);
    return -(along_ray * (p.slave.t + p.g * along.bend.n));
  }

  /// - t . g dn  [theory (4.21)]
  static void add_couple(const Hit& p, const HitSlopes<D, Law>& slopes,
                         const Place& along, const Vec<D>& t,
                         const Mat<D, T>& t_xi, const PointShapes<D>& at,
                         AnyIntegrand<D>& out)
  {
    const Vec<D>& n = p.slave.n;
    const double w = along.area.jacobian;
    const Vec<T> by_gradient = slopes.dual.transpose() * t;
    const Mat<1, T> g_xi = ray_along(p, slopes, along);
    Mat<D, T> change = t_xi - dot<D>(n, t) * along.bend.n;
    for (int j = 0; j < T; ++j)
      set_column(change, j,
                 column(change, j) -
                     along.bend.t[static_cast<std::size_t>(j)] * by_gradient);
    const Mat<T, T> rates = slopes.dual.transpose() * (p.g * change);
    for (int a = 0; a < at.slave_nodes; ++a)
    {
      const auto& N = at.slave[static_cast<std::size_t>(a)];
      const double turn = at.slave_gradient(a).dot(by_gradient);
      Mat<1, T> turn_xi =
          at.slave_gradient(a).transpose() * rates + turn * g_xi;
      for (int j = 0; j < T; ++j)
        for (int i = 0; i < T; ++i)
          turn_xi[j] +=
              p.g * by_gradient[i] * N[static_cast<std::size_t>(1 + T + i + j)];
      add(out, D * a, w * p.g * turn * n,
          w * (n * turn_xi + p.g * turn * along.bend.n));
    }
  }

  /// C . mu / gamma
  static void set_condition(const SlavePoint<D, Law>& p, const Place& along,
                            const Vec<M>& C, const Mat<M, T>& C_xi,
                            const PointShapes<D>& at, AnyIntegrand<D>& out)
  {
    const double w = along.area.jacobian / p.gamma * at.scale;
    const Mat<M, T> change =
        C_xi + C * (along.area.log_jacobian - along.log_gamma);
    for (int k = 0; k < at.multipliers; ++k)
    {
      const auto& N = at.multiplier[static_cast<std::size_t>(k)];
      for (int i = 0; i < M; ++i)
      {
        const auto row = static_cast<std::size_t>(at.side() + k * M + i);
        out.f[row] = w * N[0] * C[i];
        for (std::size_t j = 0; j < T; ++j)
          out.f_xi[j][row] =
              w * (N[0] * change(i, static_cast<int>(j)) + C[i] * N[1 + j]);
      }
    }
  }
};
} // namespace raymortar
