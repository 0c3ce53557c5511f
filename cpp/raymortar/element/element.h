// Residual and tangent of one contact element: a slave facet with the master
// facet its points hit, or with none.
#pragma once

#include "raymortar/element/carried.h"
#include "raymortar/law/frictional.h"

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

/// @brief What friction needs of the accepted step; nothing without it.
template <class F, bool Frictional>
struct FrictionData
{
};

template <class F>
struct FrictionData<F, true>
{
  typename F::NodeMatrix slave_old;
  typename F::NodeMatrix master_old;
  Mat<F::gdim, F::dofs> traction_old; ///< nodal, of the elastic penalty
  FrictionLaw friction;
};

/// @brief Data of one element besides its points.
template <class F, int L, class Law>
struct ElementData
{
  using Layout = ElementLayout<F, L, Law>;
  typename F::NodeMatrix slave;
  typename F::NodeMatrix master;
  typename F::NodeMatrix reference; ///< undeformed slave; moving segments only
  Mat<Layout::components, Layout::multipliers>
      lam;              ///< nodal unknowns ell = lam / lam_scale
  Vec<F::dofs> gamma;   ///< nodal coefficient on the slave facet
  double lam_scale = 1; ///< traction per unit of the multiplier unknown
  double touch = 0;     ///< see PointState, length
  bool current = false; ///< integrate over the deformed slave surface
  FrictionData<F, is_frictional<Law>> history;
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
    const auto r = respond(e, p.slave, q);
    const double w = e.current ? q.weight * p.slave.jacobian : q.area;
    add_work(p, r.t, w);
    add_condition(shape, r.C, w / gamma);
    if (tangent)
      add_hit_tangent(e, q, p, r, shape, w, gamma);
  }

  /// @brief The law at a point with a hit.
  [[nodiscard]] static auto respond(const Data& e, const Frame<D>& slave,
                                    const ElementPoint<F>& q)
  {
    const PointState<D, M> state{slave.n, q.g,
                                 lam_at(e, multiplier_shape(e, q.xi)),
                                 F::Disp::values(q.xi).dot(e.gamma), e.touch};
    if constexpr (is_frictional<Law>)
    {
      Vec<D> spring = Vec<D>::Zero();
      if constexpr (M == 0)
        spring = old_traction(e, slave, q).value();
      return Law::template evaluate<D>(FrictionState<D, M>{
          state, slip_increment(e, q), spring, e.history.friction});
    }
    else
      return Law::template evaluate<D>(state);
  }

  /// @brief w of (2). With the ray x_s + g n = x_m it is
  /// w = x_m0(eta) - x_s0 - g n_0: no difference of large numbers of two
  /// states.
  [[nodiscard]] static Vec<D>
  slip_increment(const Data& e,
                 const ElementPoint<F>& q) requires is_frictional<Law>
  {
    const Frame<D> old = frame_at<F>(e.history.slave_old, q.xi);
    return e.history.master_old * F::Node::values(q.eta) - old.x - q.g * old.n;
  }

  /// @brief Accepted traction of the friction springs on the present surface.
  [[nodiscard]] static CarriedTraction<D>
  old_traction(const Data& e, const Frame<D>& slave,
               const ElementPoint<F>& q) requires is_frictional<Law>
  {
    return carry_traction<D>(frame_at<F>(e.history.slave_old, q.xi), slave,
                             e.history.traction_old * F::Disp::values(q.xi));
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

  using MuShape = Vec<Layout::multipliers>;

  /// @brief Test functions of the multiplier's unknowns.
  [[nodiscard]] static MuShape multiplier_shape(const Data& e,
                                                const typename F::RefPoint& xi)
  {
    if constexpr (L == 0)
      return {};
    else
      return e.lam_scale * Lagrange<F::shape, L>::values(xi);
  }

private:
  using Row = Mat<1, Layout::size>;

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

  /// dw = T_0 deta - n_0 dg: the variation of slip_increment  [theory (2.9)]
  [[nodiscard]] static Mat<D, 2 * Layout::side>
  vary_slip(const Data& e, const ElementPoint<F>& q,
            const Variations<F>& v) requires is_frictional<Law>
  {
    const Mat<D, F::tdim> T_old =
        e.history.master_old * F::Node::gradients(q.eta);
    const Vec<D> n_old = frame_at<F>(e.history.slave_old, q.xi).n;
    return T_old * v.deta - n_old * v.dg;
  }

  template <class Response>
  void add_hit_tangent(const Data& e, const ElementPoint<F>& q,
                       const PointGeometry<F>& p, const Response& r,
                       const MuShape& shape, double w, double gamma)
  {
    Variations<F> v;
    vary_slave<F>(p, v);
    vary_hit<F>(p, q.g, v);
    Mat<D, Layout::size> dt = chain<D>(r.t_n, r.t_g, r.t_lam, v, shape);
    Mat<M, Layout::size> dC = chain<M>(r.C_n, r.C_g, r.C_lam, v, shape);
    if constexpr (is_frictional<Law>)
    {
      const Mat<D, 2 * Layout::side> dw = vary_slip(e, q, v);
      dt += spread<D>(r.t_w * dw);
      if constexpr (M > 0)
        dC += spread<M>(r.C_w * dw);
      else
        dt.template leftCols<Layout::side>() +=
            r.t_spring * vary_carried<F>(old_traction(e, p.slave, q), p, q.xi);
    }
    if (e.current)
    {
      dt.template leftCols<Layout::side>() += r.t * v.dlog_area;
      dC.template leftCols<Layout::side>() += r.C * v.dlog_area;
    }
    add_work_tangent(p, dt, r.t, spread<D - 1>(v.deta), w);
    add_condition_tangent(shape, dC, w / gamma);
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
    if constexpr (M > 0)
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
