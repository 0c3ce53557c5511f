// Residual and tangent of one contact element: a slave facet with the master
// facet its points hit, or with none.
#pragma once

#include "raymortar/element/kinematics.h"
#include "raymortar/law/point_law.h"

namespace raymortar
{
/// @brief Dof layout of an element: [slave u | multiplier | master u].
///
/// The multiplier is first of the optional parts so that an element without
/// master uses the leading block.
/// @tparam L Degree of the multiplier, 0 without
template <class F, int L, class Law>
struct ElementLayout
{
  static constexpr int D = F::gdim;
  static constexpr int components = Law::template multiplier_size<D>;
  static constexpr int side = F::dofs * D;
  static constexpr int multipliers = L == 0 ? 0 : Lagrange < F::shape,
                       L == 0 ? 1 : L > ::nodes;
  static constexpr int multiplier_dofs = multipliers * components;
  static constexpr int master = side + multiplier_dofs;
  static constexpr int size = 2 * side + multiplier_dofs;
  static constexpr int alone = side + multiplier_dofs;
};

/// @brief Data of one element besides its points.
template <class F, int L, class Law>
struct ElementData
{
  using Layout = ElementLayout<F, L, Law>;
  typename F::NodeMatrix slave;
  typename F::NodeMatrix master;
  Mat<Layout::components, Layout::multipliers>
      lam;              ///< nodal unknowns ell = lam / lam_scale
  Vec<F::dofs> gamma;   ///< nodal coefficient on the slave facet
  double lam_scale = 1; ///< traction per unit of the multiplier unknown
  double touch = 0;     ///< see PointState, length
  bool current = false; ///< integrate over the deformed slave surface
};

/// @brief One integration point of an element.
template <class F>
struct ElementPoint
{
  typename F::RefPoint xi;
  typename F::RefPoint eta;
  double weight; ///< in reference coordinates
  double area;   ///< times the reference Jacobian
  double g;
};

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

  Vector b;
  Matrix A;

  void reset(bool tangent)
  {
    b.setZero();
    if (tangent)
      A.setZero();
  }

  /// @brief Point with a hit: contact work (3) and condition (4).
  void add_hit(const Data& e, const ElementPoint<F>& q, bool tangent)
  {
    PointGeometry<F> p = slave_geometry<F>(e.slave, q.xi);
    add_master_geometry<F>(p, e.master, q.eta);
    const MuShape shape = multiplier_shape(e, q.xi);
    const double gamma = p.N_s.dot(e.gamma);
    const PointResponse<D, M> r = respond(e, p.slave.n, q);
    const double w = e.current ? q.weight * p.slave.jacobian : q.area;
    add_work(p, r.t, w);
    add_condition(shape, r.C, w / gamma);
    if (tangent)
      add_hit_tangent(e, p, r, shape, q.g, w, gamma);
  }

  /// @brief The law at a point with a hit.
  [[nodiscard]] static PointResponse<D, M>
  respond(const Data& e, const Vec<D>& n, const ElementPoint<F>& q)
  {
    return Law::template evaluate<D>(
        PointState<D, M>{n, q.g, lam_at(e, multiplier_shape(e, q.xi)),
                         F::Disp::values(q.xi).dot(e.gamma), e.touch});
  }

  /// @brief Point without a hit: the multiplier is driven to zero.
  void add_miss(const Data& e, const ElementPoint<F>& q, bool tangent)
  {
    if constexpr (M > 0)
    {
      const PointGeometry<F> p = slave_geometry<F>(e.slave, q.xi);
      const MuShape shape = multiplier_shape(e, q.xi);
      const double w = (e.current ? q.weight * p.slave.jacobian : q.area) /
                       p.N_s.dot(e.gamma);
      const Vec<M> C = Law::template without_hit<D>(lam_at(e, shape));
      add_condition(shape, C, w);
      if (tangent)
        add_miss_tangent(e, p, shape, C, w);
    }
  }

private:
  using MuShape = Vec<Layout::multipliers>;
  using Row = Mat<1, Layout::size>;

  [[nodiscard]] static MuShape multiplier_shape(const Data& e,
                                                const typename F::RefPoint& xi)
  {
    if constexpr (L == 0)
      return {};
    else
      return e.lam_scale * Lagrange<F::shape, L>::values(xi);
  }

  [[nodiscard]] static Vec<M> lam_at(const Data& e, const MuShape& shape)
  {
    if constexpr (L == 0)
      return {};
    else
      return e.lam * shape;
  }

  /// - int t . (v_s - v_m) dG
  void add_work(const PointGeometry<F>& p, const Vec<D>& t, double w)
  {
    for (int a = 0; a < F::dofs; ++a)
    {
      b.template segment<D>(a * D) -= w * p.N_s[a] * t;
      b.template segment<D>(Layout::master + a * D) += w * p.N_m[a] * t;
    }
  }

  /// (1/gamma) int C . mu dG, w includes 1/gamma
  void add_condition(const MuShape& shape, const Vec<M>& C, double w)
  {
    if constexpr (M > 0)
      for (int k = 0; k < Layout::multipliers; ++k)
        b.template segment<M>(Layout::side + k * M) += w * shape[k] * C;
  }

  /// Row over all element dofs from a row over [slave | master]
  template <int R>
  [[nodiscard]] static Mat<R, Layout::size>
  spread(const Mat<R, 2 * Layout::side>& rows)
  {
    Mat<R, Layout::size> all = Mat<R, Layout::size>::Zero();
    all.template leftCols<Layout::side>() =
        rows.template leftCols<Layout::side>();
    all.template rightCols<Layout::side>() =
        rows.template rightCols<Layout::side>();
    return all;
  }

  /// Derivative rows of t or C by the chain rule
  template <int R>
  [[nodiscard]] static Mat<R, Layout::size>
  chain(const Mat<R, D>& by_n, const Vec<R>& by_g, const Mat<R, M>& by_lam,
        const Variations<F>& v, const MuShape& shape)
  {
    Mat<R, 2 * Layout::side> rows = by_g * v.dg;
    rows.template leftCols<Layout::side>() += by_n * v.dn;
    Mat<R, Layout::size> all = spread<R>(rows);
    if constexpr (M > 0)
      for (int k = 0; k < Layout::multipliers; ++k)
        all.template middleCols<M>(Layout::side + k * M) = shape[k] * by_lam;
    return all;
  }

  void add_hit_tangent(const Data& e, const PointGeometry<F>& p,
                       const PointResponse<D, M>& r, const MuShape& shape,
                       double g, double w, double gamma)
  {
    Variations<F> v;
    vary_slave<F>(p, v);
    vary_hit<F>(p, g, v);
    Mat<D, Layout::size> dt = chain<D>(r.t_n, r.t_g, r.t_lam, v, shape);
    if (e.current)
      dt.template leftCols<Layout::side>() += r.t * v.dlog_area;
    add_work_tangent(p, dt, r.t, spread<D - 1>(v.deta), w);
    if constexpr (M > 0)
    {
      Mat<M, Layout::size> dC = chain<M>(r.C_n, r.C_g, r.C_lam, v, shape);
      if (e.current)
        dC.template leftCols<Layout::side>() += r.C * v.dlog_area;
      add_condition_tangent(shape, dC, w / gamma);
    }
  }

  /// Derivative of - t . (v_s - v_m(eta)): the traction changes, and v_m is
  /// taken at another point of the master
  void add_work_tangent(const PointGeometry<F>& p,
                        const Mat<D, Layout::size>& dt, const Vec<D>& t,
                        const Mat<D - 1, Layout::size>& deta, double w)
  {
    for (int a = 0; a < F::dofs; ++a)
    {
      const Row slide = (w * p.dN_m.row(a)) * deta;
      for (int i = 0; i < D; ++i)
      {
        A.row(a * D + i) -= (w * p.N_s[a]) * dt.row(i);
        A.row(Layout::master + a * D + i) +=
            (w * p.N_m[a]) * dt.row(i) + t[i] * slide;
      }
    }
  }

  void add_condition_tangent(const MuShape& shape,
                             const Mat<M, Layout::size>& dC, double w)
  {
    for (int k = 0; k < Layout::multipliers; ++k)
      A.template middleRows<M>(Layout::side + k * M) += (w * shape[k]) * dC;
  }

  void add_miss_tangent(const Data& e, const PointGeometry<F>& p,
                        const MuShape& shape, const Vec<M>& C, double w)
  {
    Mat<M, Layout::size> dC = Mat<M, Layout::size>::Zero();
    for (int k = 0; k < Layout::multipliers; ++k)
      dC.template middleCols<M>(Layout::side + k * M)
          .diagonal()
          .setConstant(-shape[k]);
    if (e.current)
    {
      Variations<F> v;
      vary_slave<F>(p, v);
      dC.template leftCols<Layout::side>() += C * v.dlog_area;
    }
    add_condition_tangent(shape, dC, w);
  }
};
} // namespace raymortar
