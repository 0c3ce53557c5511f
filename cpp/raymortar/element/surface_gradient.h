// Derivative of the integrand along the slave facet. Moving integration points
// add it to the tangent.
#pragma once

#include "raymortar/element/element.h"
#include "raymortar/geometry/curvature.h"

namespace raymortar
{
/// @brief Integrand of one point per unit of its weight, and its derivative by
/// xi at fixed unknowns, over the rows of the element.
template <class F, class Layout>
struct Integrand
{
  Vec<Layout::size> f;
  Mat<Layout::size, F::tdim> f_xi;
};

/// @brief Differentiates the integrand along the slave surface.
///
/// The chain rule is the one of the element's tangent: along xi the slave
/// varies by its own tangents, the master not at all  [theory (3.11)].
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
  [[nodiscard]] static Integrand<F, Layout>
  hit(const Data& e, const ElementPoint<F>& q, const HitPoint<F, L, Law>& p,
      const HitSlopes<F, L, Law>& slopes)
  {
    const Place at(e, q.xi, p, slopes.geometry);
    Mat<M, T> lam;
    if constexpr (M > 0)
      lam = e.lam * at.shape_xi;
    const FacetColumns<F, L, Law> columns(e, q, p, slopes, at.bend,
                                          at.log_gamma, lam);
    const auto& r = p.response;
    const Mat<D, T> t = chain<D>(traction_slopes(p), p, slopes, columns) +
                        r.t * at.area.log_jacobian;
    Integrand<F, Layout> out;
    add_work(p, slopes.geometry, at, t, columns.eta(), out);
    if constexpr (is_frictional<Law>)
      if (p.has_couple())
        add_couple(p, slopes, at, r.t, t, out);
    if constexpr (M > 0)
      add_condition(p, at, r.C,
                    chain<M>(condition_slopes(p), p, slopes, columns), out);
    return out;
  }

  /// @brief Of a point without a hit.
  [[nodiscard]] static Integrand<F, Layout>
  miss(const Data& e, const ElementPoint<F>& q, const SlavePoint<F, L, Law>& p)
  {
    Integrand<F, Layout> out;
    out.f.setZero();
    out.f_xi.setZero();
    if constexpr (M > 0)
    {
      const Place at(
          e, q.xi, p,
          slave_geometry<F>(p.slave, p.N_s, F::Disp::gradients(q.xi)));
      add_condition(p, at, Law::template without_hit<D>(p.lam),
                    -(e.lam * at.shape_xi), out);
    }
    return out;
  }

private:
  /// Derivatives along the slave of quantities without the master
  struct Place
  {
    Curvature<D> bend;
    Mat<Layout::multipliers, T> shape_xi;
    AreaAlong<D> area; ///< in the measure of integration
    Mat<1, T> log_gamma;

    Place(const Data& e, const typename F::RefPoint& xi,
          const SlavePoint<F, L, Law>& p, const PointGeometry<F>& geometry)
        : bend(curvature_at<F>(e.slave, xi, p.slave, geometry.dual)),
          area(area_along<F>(e.measure, e.reference, xi, p.slave, bend)),
          log_gamma(e.gamma.transpose() * geometry.dN_s / p.gamma)
    {
      if constexpr (L > 0)
        shape_xi = e.lam_scale * F::template Basis<L>::gradients(xi);
    }
  };

  /// - t . (v_s - v_m), with t_xi including the change of area
  static void add_work(const HitPoint<F, L, Law>& p,
                       const PointGeometry<F>& geometry, const Place& at,
                       const Mat<D, T>& t_xi, const Mat<T, T>& eta_xi,
                       Integrand<F, Layout>& out)
  {
    const Vec<D>& t = p.response.t;
    const Mat<F::dofs, T> N_m_xi = geometry.dN_m * eta_xi;
    const double w = at.area.jacobian;
    for (int a = 0; a < F::dofs; ++a)
      for (int i = 0; i < D; ++i)
      {
        const int s = a * D + i, m = Layout::master + s;
        out.f[s] = -w * p.N_s[a] * t[i];
        out.f[m] = w * p.N_m[a] * t[i];
        for (int j = 0; j < T; ++j)
        {
          out.f_xi(s, j) =
              -w * (p.N_s[a] * t_xi(i, j) + t[i] * geometry.dN_s(a, j));
          out.f_xi(m, j) = w * (p.N_m[a] * t_xi(i, j) + t[i] * N_m_xi(a, j));
        }
      }
  }

  /// - t . g dn  [theory (4.21)]
  static void add_couple(const HitPoint<F, L, Law>& p,
                         const HitSlopes<F, L, Law>& slopes, const Place& at,
                         const Vec<D>& t, const Mat<D, T>& t_xi,
                         Integrand<F, Layout>& out)
  {
    const PointGeometry<F>& geometry = slopes.geometry;
    const Vec<D>& n = p.slave.n;
    const Vec<T> along = geometry.dual.transpose() * t;
    const Vec<F::dofs> turn = geometry.dN_s * along;
    const Mat<1, D> along_ray = slopes.vary.dual.row(D - 1);
    const Mat<1, T> g_xi = -(along_ray * (p.slave.t + p.g * at.bend.n));
    Mat<D, T> change = t_xi - dot<D>(n, t) * at.bend.n;
    for (int j = 0; j < T; ++j)
      set_column(change, j,
                 column(change, j) -
                     at.bend.t[static_cast<std::size_t>(j)] * along);
    Mat<F::dofs, T> turn_xi = geometry.G_s.transpose() * (p.g * change);
    turn_xi += turn * g_xi;
    const auto bends = SecondGradients<F::shape, F::degree>::at(p.xi);
    const double w = at.area.jacobian;
    for (int a = 0; a < F::dofs; ++a)
      for (int j = 0; j < T; ++j)
      {
        for (int i = 0; i < T; ++i)
          turn_xi(a, j) += p.g * along[i] * bends(a, i + j);
        for (int i = 0; i < D; ++i)
          out.f_xi(a * D + i, j) +=
              w * (n[i] * turn_xi(a, j) + p.g * turn[a] * at.bend.n(i, j));
      }
    for (int a = 0; a < F::dofs; ++a)
      add_scaled<D>(w * p.g * turn[a], n.data(), out.f.data() + a * D);
  }

  /// C . mu / gamma
  static void add_condition(const SlavePoint<F, L, Law>& p, const Place& at,
                            const Vec<M>& C, const Mat<M, T>& C_xi,
                            Integrand<F, Layout>& out)
  {
    if constexpr (M > 0)
    {
      const double w = at.area.jacobian / p.gamma;
      const Mat<M, T> change = C_xi + C * (at.area.log_jacobian - at.log_gamma);
      for (int k = 0; k < Layout::multipliers; ++k)
        for (int i = 0; i < M; ++i)
        {
          const int r = Layout::side + k * M + i;
          out.f[r] = w * p.shape[k] * C[i];
          for (int j = 0; j < T; ++j)
            out.f_xi(r, j) =
                w * (p.shape[k] * change(i, j) + C[i] * at.shape_xi(k, j));
        }
    }
  }
};
} // namespace raymortar
