// Residual and tangent of one contact element: a slave facet with the master
// facet its points hit, or with none.
#pragma once

#include "raymortar/element/rates.h"
#include "raymortar/element/turning.h"

namespace raymortar
{
/// @brief Accumulates residual and tangent of one element, point by point.
///
/// The unknown multiplier is ell = lam / lam_scale and its test function is
/// scaled likewise, so that both blocks of the residual are forces.
template <class F, int L, class Law>
class Element
{
public:
  using Layout = ElementLayout<F, L, Law>;
  using Data = ElementData<F, L, Law>;
  static constexpr int D = F::gdim;
  static constexpr int M = Layout::components;
  using Vector = Vec<Layout::size>;
  using Matrix =
      Eigen::Matrix<double, Layout::size, Layout::size, Eigen::RowMajor>;

  Vector b; ///< to be set to zero before the first point, as A
  Matrix A;

  /// @brief Residual of a point with a hit: contact work (3), condition (4).
  template <bool Slopes>
  void add_hit(const HitPoint<F, L, Law, Slopes>& p)
  {
    add_work(p, p.response.t);
    add_condition(p, p.response.C);
  }

  /// @brief Residual of a point without: the multiplier is driven to zero.
  void add_miss(const SlavePoint<F, L, Law>& p)
  {
    if constexpr (M > 0)
      add_condition(p, Law::template without_hit<D>(p.lam));
  }

  /// @brief Tangent of a point with a hit.
  void add_hit_tangent(const Data& e, const HitPoint<F, L, Law>& p,
                       const HitSlopes<F, L, Law>& at)
  {
    add_traction_tangent(e, p, at);
    add_slide_tangent(at.geometry, p.response.t, at.vary.deta, p.weight);
    if constexpr (M > 0)
    {
      Rows<M, both> dC = chain<M>(condition_slopes(p), p, at, Columns(p, at));
      if (moves(e.measure))
        add_area<M>(p.response.C, area_variation<F>(e.measure, at.geometry),
                    dC);
      add_condition_tangent(p, dC, p.response.C_lam);
    }
  }

  /// @brief Tangent of a point without a hit.
  void add_miss_tangent(const Data& e, const ElementPoint<F>& q,
                        const SlavePoint<F, L, Law>& p)
  {
    if constexpr (M > 0)
    {
      Rows<M, both> dC = Rows<M, both>::Zero();
      if (moves(e.measure))
        add_area<M>(Law::template without_hit<D>(p.lam),
                    area_variation<F>(
                        e.measure, slave_geometry<F>(p.slave, p.N_s,
                                                     F::Disp::gradients(q.xi))),
                    dC);
      add_condition_tangent(p, dC, -Mat<M, M>::Identity());
    }
  }

private:
  static constexpr int side = Layout::side;
  static constexpr int both = 2 * side;
  using Columns = DofColumns<F, L, Law>;
  template <int R, int C>
  using Rows = typename Columns::template Rows<R, C>;

  /// The entries of row i of A from some column on
  [[nodiscard]] double* row(int i, int column = 0)
  {
    return A.data() + i * Layout::size + column;
  }

  /// Add numbers by [slave | master] to row i of A
  void add_row(int i, double factor, const double* from)
  {
    add_scaled<side>(factor, from, row(i));
    add_scaled<side>(factor, from + side, row(i, Layout::master));
  }

  /// - int t . (v_s + g dn - v_m) dG
  template <bool Slopes>
  void add_work(const HitPoint<F, L, Law, Slopes>& p, const Vec<D>& t)
  {
    double* const slave = b.data();
    double* const master = b.data() + Layout::master;
    for (int a = 0; a < F::dofs; ++a)
    {
      add_scaled<D>(-p.weight * p.N_s[a], t.data(), slave + a * D);
      add_scaled<D>(p.weight * p.N_m[a], t.data(), master + a * D);
    }
    if constexpr (is_frictional<Law>)
      if (p.has_couple())
      {
        const Vec<D - 1> along = dual_tangents<D>(p.slave).transpose() * t;
        const Vec<F::dofs> turn = F::Disp::gradients(p.xi) * along;
        for (int a = 0; a < F::dofs; ++a)
          add_scaled<D>(p.weight * p.g * turn[a], p.slave.n.data(),
                        slave + a * D);
      }
  }

  /// (1/gamma) int C . mu dG
  void add_condition(const SlavePoint<F, L, Law>& p, const Vec<M>& C)
  {
    if constexpr (M > 0)
    {
      const double w = p.weight / p.gamma;
      for (int k = 0; k < Layout::multipliers; ++k)
        add_scaled<M>(w * p.shape[k], C.data(), b.data() + side + k * M);
    }
  }

  /// Add that the area varies with the slave, by which f is multiplied
  template <int R>
  static void add_area(const Vec<R>& f, const Rows<1, side>& area,
                       Rows<R, both>& rows)
  {
    for (int i = 0; i < R; ++i)
      add_scaled<side>(f[i], area.data(), rows.data() + i * both);
  }

  /// Derivative of t in - t . (v_s + g dn - v_m), and of g dn: by what they
  /// vary with, see PointResponse
  void add_traction_tangent(const Data& e, const HitPoint<F, L, Law>& p,
                            const HitSlopes<F, L, Law>& at)
  {
    const auto& r = p.response;
    const PointGeometry<F>& geometry = at.geometry;
    if constexpr (M == 0)
    {
      const double w = p.weight;
      Rows<D, both> dt = chain<D>(traction_slopes(p), p, at, Columns(p, at));
      if constexpr (is_frictional<Law>)
        if (p.has_couple())
          add_couple_tangent(e, p, at, &dt);
      if (moves(e.measure))
        add_area<D>(r.t, area_variation<F>(e.measure, geometry), dt);
      for (int a = 0; a < F::dofs; ++a)
        for (int i = 0; i < D; ++i)
        {
          const double* const change = dt.data() + i * both;
          add_row(a * D + i, -w * p.N_s[a], change);
          add_row(Layout::master + a * D + i, w * p.N_m[a], change);
        }
    }
    else
    {
      if (moves(e.measure))
      {
        const Rows<1, side> area = area_variation<F>(e.measure, geometry);
        for (int i = 0; i < D; ++i)
          add_work_row<side>(p, i, p.weight * r.t[i], area.data(), 0);
      }
      if constexpr (M == 1)
        add_normal_tangent(p, geometry);
      else
        add_vector_tangent(p);
    }
    if constexpr (is_frictional<Law> and M > 0)
      if (p.has_couple())
        add_couple_tangent(e, p, at);
  }

  /// - dt_i (v_s - v_m)_i over C columns from one on, dt_i = factor * from
  template <int C>
  void add_work_row(const HitPoint<F, L, Law>& p, int i, double factor,
                    const double* from, int column)
  {
    for (int a = 0; a < F::dofs; ++a)
    {
      add_scaled<C>(-factor * p.N_s[a], from, row(a * D + i, column));
      add_scaled<C>(factor * p.N_m[a], from,
                    row(Layout::master + a * D + i, column));
    }
  }

  /// The traction is lam n, and n varies by one vector per node  [theory (2.5)]
  void add_normal_tangent(const HitPoint<F, L, Law>& p,
                          const PointGeometry<F>& geometry)
  {
    const auto& r = p.response;
    for (int i = 0; i < D; ++i)
    {
      Rows<1, side> turn;
      for (int a = 0; a < F::dofs; ++a)
      {
        double by_node = 0.0;
        for (int j = 0; j < D; ++j)
          by_node -= r.t_n(i, j) * geometry.G_s(j, a);
        put<D>(by_node * geometry.slave.n, turn.data() + a * D);
      }
      add_work_row<side>(p, i, p.weight, turn.data(), 0);
      add_work_row<Layout::multipliers>(p, i, p.weight * r.t_lam(i, 0),
                                        p.shape.data(), side);
    }
  }

  /// The traction is the multiplier
  void add_vector_tangent(const HitPoint<F, L, Law>& p)
  {
    for (int a = 0; a < F::dofs; ++a)
      for (int k = 0; k < Layout::multipliers; ++k)
      {
        const double s = p.weight * p.N_s[a] * p.shape[k];
        const double m = p.weight * p.N_m[a] * p.shape[k];
        for (int i = 0; i < D; ++i)
        {
          *row(a * D + i, side + k * D + i) -= s;
          *row(Layout::master + a * D + i, side + k * D + i) += m;
        }
      }
  }

  /// Derivative of - t . g dn  [theory (4.21)]
  /// @param[in] dt That of t, over [slave | master]; null if it is the
  /// multiplier
  void add_couple_tangent(const Data& e, const HitPoint<F, L, Law>& p,
                          const HitSlopes<F, L, Law>& at,
                          const Rows<D, both>* dt = nullptr)
  {
    const PointGeometry<F>& geometry = at.geometry;
    const Vec<D>& n = p.slave.n;
    const Vec<D> t = p.weight * p.response.t;
    const double w = p.weight * p.g;
    // Derivative of g t, times the area
    Rows<D, both> moment;
    const Rows<1, both> dg = vary_arm(e, p, at);
    for (int i = 0; i < D; ++i)
      for (int c = 0; c < both; ++c)
      {
        double& entry = moment.data()[i * both + c];
        entry = t[i] * dg[c];
        if constexpr (M == 0)
          entry += w * dt->data()[i * both + c];
      }
    for (int a = 0; a < F::dofs; ++a)
    {
      Rows<1, both> by_node;
      for (int c = 0; c < both; ++c)
      {
        by_node[c] = geometry.G_s(0, a) * moment.data()[c];
        for (int i = 1; i < D; ++i)
          by_node[c] += geometry.G_s(i, a) * moment.data()[i * both + c];
      }
      for (int i = 0; i < D; ++i)
      {
        add_row(a * D + i, n[i], by_node.data());
        if constexpr (M > 0)
          for (int k = 0; k < Layout::multipliers; ++k)
            for (int j = 0; j < D; ++j)
              *row(a * D + i, side + k * D + j) +=
                  w * p.shape[k] * n[i] * geometry.G_s(j, a);
      }
    }
    add_turning_tangent<D>(geometry.G_s, n, p.g * t, A);
  }

  /// Derivative of the ray's length times the area, per area
  [[nodiscard]] static Rows<1, both> vary_arm(const Data& e,
                                              const HitPoint<F, L, Law>& p,
                                              const HitSlopes<F, L, Law>& at)
  {
    const Mat<1, D> by_ends = at.vary.dual.row(D - 1);
    Rows<1, both> dg = Columns(p, at).template ray<1>(-p.g * by_ends, by_ends);
    if (moves(e.measure))
      add_area<1>(Vec<1>(p.g), area_variation<F>(e.measure, at.geometry), dg);
    return dg;
  }

  /// v_m(eta) is taken at another point of the master
  void add_slide_tangent(const PointGeometry<F>& p, const Vec<D>& t,
                         const Rows<D - 1, both>& deta, double w)
  {
    for (int a = 0; a < F::dofs; ++a)
    {
      Rows<1, both> by_node;
      for (int c = 0; c < both; ++c)
      {
        by_node[c] = w * p.dN_m(a, 0) * deta.data()[c];
        if constexpr (D == 3)
          by_node[c] += w * p.dN_m(a, 1) * deta.data()[both + c];
      }
      for (int i = 0; i < D; ++i)
        add_row(Layout::master + a * D + i, t[i], by_node.data());
    }
  }

  /// dC . mu / gamma; dC over [slave | master]
  void add_condition_tangent(const SlavePoint<F, L, Law>& p,
                             const Rows<M, both>& dC, const Mat<M, M>& C_lam)
  {
    const double w = p.weight / p.gamma;
    for (int k = 0; k < Layout::multipliers; ++k)
    {
      const double test = w * p.shape[k];
      for (int i = 0; i < M; ++i)
      {
        const int r = side + k * M + i;
        add_row(r, test, dC.data() + i * both);
        const Vec<M> by_lam = row_of(C_lam, i);
        for (int j = 0; j < Layout::multipliers; ++j)
          add_scaled<M>(test * p.shape[j], by_lam.data(), row(r, side + j * M));
      }
    }
  }
};
} // namespace raymortar
