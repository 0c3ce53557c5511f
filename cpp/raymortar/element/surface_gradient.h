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
  Vec<Layout::size> f;
  Mat<Layout::size, F::tdim> f_xi;
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
  [[nodiscard]] static Integrand<F, L, Law>
  hit(const Data& e, const ElementPoint<F>& q, const HitPoint<F, L, Law>& p,
      const HitSlopes<F, L, Law>& slopes)
  {
    const Place at(e, q.xi, p, slopes.geometry);
    const auto& r = p.response;
    const Rates rate = rates(e, q, p, slopes, at);
    Mat<D, T> t = r.t_n * rate.n + r.t_g * rate.scaled_g + r.t_lam * rate.lam;
    Mat<M, T> C = r.C_n * rate.n + r.C_g * rate.scaled_g + r.C_lam * rate.lam;
    if constexpr (is_frictional<Law>)
    {
      t += r.t_w * rate.scaled_w;
      if constexpr (M > 0)
        C += r.C_w * rate.scaled_w + r.C_spring * rate.spring +
             r.C_coefficient * rate.coefficient - r.C_rate * at.log_gamma;
      else
        t += r.t_spring * rate.spring + r.t_coefficient * rate.coefficient -
             r.t_rate * at.log_gamma;
    }
    t += r.t * at.log_jacobian;
    Integrand<F, L, Law> out;
    add_work(p, slopes.geometry, at, t, rate.eta, out);
    add_condition(p, at, r.C, C, out);
    return out;
  }

  /// @brief Of a point without a hit.
  [[nodiscard]] static Integrand<F, L, Law>
  miss(const Data& e, const ElementPoint<F>& q, const SlavePoint<F, L, Law>& p)
  {
    Integrand<F, L, Law> out;
    out.f.setZero();
    out.f_xi.setZero();
    if constexpr (M > 0)
    {
      const Place at(e, q.xi, p,
                     slave_geometry<F>(p.slave, p.N_s,
                                       p.at_xi.displacement_gradients(q.xi)));
      add_condition(p, at, Law::template without_hit<D>(p.lam),
                    -(e.lam * at.shape_xi), out);
    }
    return out;
  }

private:
  /// How what does not depend on the master changes along the slave
  struct Place
  {
    Curvature<D> bend;
    Mat<Layout::multipliers, T> shape_xi;
    double jacobian;        ///< of the measure of integration
    Mat<1, T> log_jacobian; ///< its derivative by xi
    Mat<1, T> log_gamma;

    Place(const Data& e, const typename F::RefPoint& xi,
          const SlavePoint<F, L, Law>& p, const PointGeometry<F>& geometry)
        : bend(curvature_at<F>(e.slave, xi, p.slave, geometry.dual))
    {
      if constexpr (L > 0)
        shape_xi = e.lam_scale * Lagrange<F::shape, L>::gradients(xi);
      log_gamma = e.gamma.transpose() * geometry.dN_s / p.gamma;
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
  /// and slip, so that a change of gamma counts as one of these; what a law of
  /// the slip rate takes of the slip has no such factor
  struct Rates
  {
    Mat<D, T> n;
    Mat<T, T> eta;
    Mat<1, T> scaled_g; ///< d(gamma g) / gamma
    Mat<M, T> lam;
    Mat<D, T> scaled_w; ///< d(gamma w) / gamma; friction only
    Mat<D, T> spring;   ///< traction; friction only
    Mat<1, T> coefficient = Mat<1, T>::Zero(); ///< of the friction law
  };

  [[nodiscard]] static Rates rates(const Data& e, const ElementPoint<F>& q,
                                   const HitPoint<F, L, Law>& p,
                                   const HitSlopes<F, L, Law>& slopes,
                                   const Place& at)
  {
    Rates r;
    r.n = at.bend.n;
    // (2.7), (2.8) with the tangents for du_s and nothing for du_m
    const Mat<D, T> z = slopes.vary.dual * (p.slave.t + q.g * r.n);
    r.eta = z.template topRows<T>();
    const Mat<1, T> offset = e.offset.transpose() * slopes.geometry.dN_s;
    const Mat<1, T> g = offset - z.row(T);
    r.scaled_g = g + (q.g + p.offset) * at.log_gamma;
    if constexpr (M > 0)
      r.lam = e.lam * at.shape_xi;
    if constexpr (is_frictional<Law>)
    {
      const Frame<D>& old = p.old.frame;
      const OldPoint<F, true>& was = p.old;
      const Curvature<D> bend =
          curvature_at<F>(e.history.slave_old, q.xi, old, was.dual);
      Mat<1, T> by_gap = was.closing.by_old * offset + was.closing.by_now * g;
      r.scaled_w = slopes.slip.by_eta * r.eta -
                   slopes.slip.by_distance * old.t + was.w * at.log_gamma;
      if constexpr (not F::affine)
      {
        // The old normal, which tells slide and gap apart, turns as well
        const Mat<1, T> by_turn = was.distance.transpose() * bend.n;
        const Mat<D, T> turned =
            old.n.dot(was.distance) * bend.n + old.n * by_turn;
        r.scaled_w += was.closing.length * bend.n - slopes.slip.carry * turned;
        by_gap += 0.5 * was.closing.by_old * by_turn;
      }
      r.scaled_w += old.n * by_gap;
      if (e.history.has_coefficient)
        r.coefficient =
            e.history.coefficient.transpose() * slopes.geometry.dN_s;
      if (was.spring.is_zero())
        r.spring.setZero();
      else
        r.spring = carried_along_facet<D, F::affine>(
            was.spring, {old, bend}, was.dual, {p.slave, at.bend}, was.accepted,
            e.history.traction_old * slopes.geometry.dN_s);
      if constexpr (M > 0)
        r.spring =
            p.gamma * (r.spring + was.spring.value() * at.log_gamma).eval();
    }
    return r;
  }

  /// - t . (v_s - v_m), with t_xi including the change of area
  static void add_work(const HitPoint<F, L, Law>& p,
                       const PointGeometry<F>& geometry, const Place& at,
                       const Mat<D, T>& t_xi, const Mat<T, T>& eta_xi,
                       Integrand<F, L, Law>& out)
  {
    const Vec<D>& t = p.response.t;
    const Mat<F::dofs, T> N_m_xi = geometry.dN_m * eta_xi;
    for (int a = 0; a < F::dofs; ++a)
    {
      const int m = Layout::master + a * D;
      out.f.template segment<D>(a * D) = -at.jacobian * p.N_s[a] * t;
      out.f.template segment<D>(m) = at.jacobian * p.N_m[a] * t;
      out.f_xi.template middleRows<D>(a * D) =
          -at.jacobian * (p.N_s[a] * t_xi + t * geometry.dN_s.row(a));
      out.f_xi.template middleRows<D>(m) =
          at.jacobian * (p.N_m[a] * t_xi + t * N_m_xi.row(a));
    }
  }

  /// C . mu / gamma
  static void add_condition(const SlavePoint<F, L, Law>& p, const Place& at,
                            const Vec<M>& C, const Mat<M, T>& C_xi,
                            Integrand<F, L, Law>& out)
  {
    if constexpr (M > 0)
    {
      const double w = at.jacobian / p.gamma;
      const Mat<M, T> change = C_xi + C * (at.log_jacobian - at.log_gamma);
      for (int k = 0; k < Layout::multipliers; ++k)
      {
        out.f.template segment<M>(Layout::side + k * M) = w * p.shape[k] * C;
        out.f_xi.template middleRows<M>(Layout::side + k * M) =
            w * (p.shape[k] * change + C * at.shape_xi.row(k));
      }
    }
  }
};
} // namespace raymortar
