// How the integrand of an element changes along the slave facet: what moving
// integration points add to the tangent.
#pragma once

#include "raymortar/element/element.h"
#include "raymortar/geometry/curvature.h"

namespace raymortar
{
/// @brief Integrand of one point per unit of its weight, and its derivative by
/// xi at fixed unknowns, over the rows of the element.
template <class F, int L, class Law>
struct Integrand
{
  using Layout = ElementLayout<F, L, Law>;
  Vec<Layout::size> f = Vec<Layout::size>::Zero();
  Mat<Layout::size, F::tdim> f_xi = Mat<Layout::size, F::tdim>::Zero();
};

/// @brief Differentiates the integrand along the slave surface.
///
/// The chain is that of the element's tangent: along xi the slave varies by
/// its own tangents, the master not at all  [theory (3.11)].
template <class F, int L, class Law>
class SurfaceGradient
{
public:
  using Kernel = Element<F, L, Law>;
  using Layout = typename Kernel::Layout;
  using Data = typename Kernel::Data;
  static constexpr int D = F::gdim;
  static constexpr int T = F::tdim;
  static constexpr int M = Layout::components;

  /// @brief Of a point with a hit.
  [[nodiscard]] static Integrand<F, L, Law> hit(const Data& e,
                                                const ElementPoint<F>& q)
  {
    const Place at(e, q.xi);
    PointGeometry<F> p = at.p;
    add_master_geometry<F>(p, e.master, q.eta);
    const auto r = Kernel::respond(e, p.slave, q);
    const Rates rate = rates(e, q, p, at);
    Mat<D, T> t = r.t_n * rate.n + r.t_g * rate.scaled_g + r.t_lam * rate.lam;
    Mat<M, T> C = r.C_n * rate.n + r.C_g * rate.scaled_g + r.C_lam * rate.lam;
    if constexpr (is_frictional<Law>)
    {
      t += r.t_w * rate.scaled_w;
      if constexpr (M > 0)
        C += r.C_w * rate.scaled_w;
      else
        t += r.t_spring * spring_rate(e, q, at);
    }
    t += r.t * at.log_jacobian;
    Integrand<F, L, Law> out;
    add_work(p, at, r.t, t, rate.eta, out);
    add_condition(at, r.C, C, out);
    return out;
  }

  /// @brief Of a point without a hit.
  [[nodiscard]] static Integrand<F, L, Law> miss(const Data& e,
                                                 const ElementPoint<F>& q)
  {
    Integrand<F, L, Law> out;
    if constexpr (M > 0)
    {
      const Place at(e, q.xi);
      const Vec<M> lam = e.lam * at.shape;
      add_condition(at, Law::template without_hit<D>(lam),
                    -(e.lam * at.shape_xi), out);
    }
    return out;
  }

private:
  /// What of a slave point does not depend on the master
  struct Place
  {
    PointGeometry<F> p;
    Curvature<D> bend;
    Mat<F::dofs, T> N_xi;
    Vec<Layout::multipliers> shape;
    Mat<Layout::multipliers, T> shape_xi;
    double jacobian; ///< of the measure of integration
    double gamma;
    Mat<1, T> log_jacobian; ///< its derivative by xi
    Mat<1, T> log_gamma;

    Place(const Data& e, const typename F::RefPoint& xi)
        : p(slave_geometry<F>(e.slave, xi)),
          bend(curvature_at<F>(e.slave, xi, p.slave)),
          N_xi(F::Disp::gradients(xi)), shape(Kernel::multiplier_shape(e, xi)),
          gamma(p.N_s.dot(e.gamma))
    {
      if constexpr (L > 0)
        shape_xi = e.lam_scale * Lagrange<F::shape, L>::gradients(xi);
      log_gamma = e.gamma.transpose() * N_xi / gamma;
      jacobian = p.slave.jacobian;
      log_jacobian = bend.log_jacobian.transpose();
      if (not e.current)
      {
        const Frame<D> reference = frame_at<F>(e.reference, xi);
        jacobian = reference.jacobian;
        log_jacobian = curvature_at<F>(e.reference, xi, reference)
                           .log_jacobian.transpose();
      }
    }
  };

  /// Derivatives by xi of what a law takes. It takes gamma as a factor of gap
  /// and slip only, so that a change of gamma counts as one of these
  struct Rates
  {
    Mat<D, T> n;
    Mat<T, T> eta;
    Mat<1, T> scaled_g; ///< d(gamma g) / gamma
    Mat<M, T> lam;
    Mat<D, T> scaled_w; ///< d(gamma w) / gamma; friction only
  };

  [[nodiscard]] static Rates rates(const Data& e, const ElementPoint<F>& q,
                                   const PointGeometry<F>& p, const Place& at)
  {
    Rates r;
    r.n = at.bend.n;
    Mat<D, D> A;
    A.template leftCols<T>() = p.T;
    A.col(T) = p.slave.n;
    // (2.7), (2.8) with the tangents for du_s and nothing for du_m
    const Mat<D, T> z = A.inverse() * (p.slave.t + q.g * r.n);
    r.eta = z.template topRows<T>();
    const Mat<1, T> g = -z.row(T);
    r.scaled_g = g + q.g * at.log_gamma;
    if constexpr (M > 0)
      r.lam = e.lam * at.shape_xi;
    if constexpr (is_frictional<Law>)
    {
      const Frame<D> old = frame_at<F>(e.history.slave_old, q.xi);
      const Curvature<D> old_bend =
          curvature_at<F>(e.history.slave_old, q.xi, old);
      const Mat<D, T> T_old = e.history.master_old * F::Node::gradients(q.eta);
      r.scaled_w = T_old * r.eta - old.t - old.n * g - q.g * old_bend.n +
                   Kernel::slip_increment(e, q) * at.log_gamma;
    }
    return r;
  }

  [[nodiscard]] static Mat<D, T>
  spring_rate(const Data& e, const ElementPoint<F>& q,
              const Place& at) requires is_frictional<Law>
  {
    const Frame<D> old = frame_at<F>(e.history.slave_old, q.xi);
    const Vec<D> traction = e.history.traction_old * F::Disp::values(q.xi);
    return carried_along_facet<D>(
        {old, curvature_at<F>(e.history.slave_old, q.xi, old)},
        {at.p.slave, at.bend}, traction, e.history.traction_old * at.N_xi);
  }

  /// - t . (v_s - v_m), with t_xi including the change of area
  static void add_work(const PointGeometry<F>& p, const Place& at,
                       const Vec<D>& t, const Mat<D, T>& t_xi,
                       const Mat<T, T>& eta_xi, Integrand<F, L, Law>& out)
  {
    const Mat<F::dofs, T> N_m_xi = p.dN_m * eta_xi;
    for (int a = 0; a < F::dofs; ++a)
    {
      const int m = Layout::master + a * D;
      out.f.template segment<D>(a * D) = -at.jacobian * p.N_s[a] * t;
      out.f.template segment<D>(m) = at.jacobian * p.N_m[a] * t;
      out.f_xi.template middleRows<D>(a * D) =
          -at.jacobian * (p.N_s[a] * t_xi + t * at.N_xi.row(a));
      out.f_xi.template middleRows<D>(m) =
          at.jacobian * (p.N_m[a] * t_xi + t * N_m_xi.row(a));
    }
  }

  /// C . mu / gamma
  static void add_condition(const Place& at, const Vec<M>& C,
                            const Mat<M, T>& C_xi, Integrand<F, L, Law>& out)
  {
    if constexpr (M > 0)
    {
      const double w = at.jacobian / at.gamma;
      const Mat<M, T> change = C_xi + C * (at.log_jacobian - at.log_gamma);
      for (int k = 0; k < Layout::multipliers; ++k)
      {
        out.f.template segment<M>(Layout::side + k * M) = w * at.shape[k] * C;
        out.f_xi.template middleRows<M>(Layout::side + k * M) =
            w * (at.shape[k] * change + C * at.shape_xi.row(k));
      }
    }
  }
};
} // namespace raymortar
