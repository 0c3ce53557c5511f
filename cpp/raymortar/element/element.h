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

  /// Rows of derivatives by C dofs, stored as those of A are
  template <int R, int C>
  using Rows =
      Eigen::Matrix<double, R, C, C == 1 ? Eigen::ColMajor : Eigen::RowMajor>;

  /// What t or C varies with, the multiplier aside
  template <int R>
  struct Derivatives
  {
    Mat<R, D> by_n;
    Vec<R> by_g;
    Mat<R, D - 1> by_eta;

    /// With dw = T_0 deta - n_0 dg, the variation of slip_increment
    /// [theory (2.9)]
    void add_slip(const Data& e, const ElementPoint<F>& q,
                  const Mat<R, D>& by_w) requires is_frictional<Law>
    {
      by_g -= by_w * frame_at<F>(e.history.slave_old, q.xi).n;
      by_eta = by_w * (e.history.master_old * F::Node::gradients(q.eta));
    }
  };

  /// Their rows over [slave | master] by the chain rule
  template <int R>
  [[nodiscard]] static Rows<R, 2 * Layout::side>
  chain(const Derivatives<R>& d, const PointGeometry<F>& p,
        const Variations<F>& v)
  {
    Rows<R, 2 * Layout::side> rows = d.by_g * v.dg;
    if constexpr (is_frictional<Law>)
      rows += d.by_eta * v.deta;
    rows.template leftCols<Layout::side>() += turn<R>(d.by_n, p);
    return rows;
  }

  /// by_n dn, which has rank one per node  [theory (2.5)]
  template <int R>
  [[nodiscard]] static Rows<R, Layout::side> turn(const Mat<R, D>& by_n,
                                                  const PointGeometry<F>& p)
  {
    Rows<R, Layout::side> rows;
    for (int a = 0; a < F::dofs; ++a)
      rows.template middleCols<D>(a * D) =
          -(by_n * p.G_s.col(a)) * p.slave.n.transpose();
    return rows;
  }

  template <class Response>
  void add_hit_tangent(const Data& e, const ElementPoint<F>& q,
                       const PointGeometry<F>& p, const Response& r,
                       const MuShape& shape, double w, double gamma)
  {
    const Variations<F> v = vary_hit<F>(p, q.g);
    add_traction_tangent(e, q, p, r, shape, v, w);
    add_slide_tangent(p, r.t, v.deta, w);
    if constexpr (M > 0)
    {
      Derivatives<M> d{r.C_n, r.C_g, {}};
      if constexpr (is_frictional<Law>)
        d.add_slip(e, q, r.C_w);
      Rows<M, 2 * Layout::side> dC = chain<M>(d, p, v);
      if (e.current)
        dC.template leftCols<Layout::side>() += r.C * area_variation(p);
      add_condition_tangent(shape, dC, r.C_lam, w / gamma);
    }
  }

  /// Derivative of t in - t . (v_s - v_m): by what it varies with, see
  /// PointResponse
  template <class Response>
  void add_traction_tangent(const Data& e, const ElementPoint<F>& q,
                            const PointGeometry<F>& p, const Response& r,
                            const MuShape& shape, const Variations<F>& v,
                            double w)
  {
    constexpr int side = Layout::side;
    if (e.current)
      add_work_tangent<side>(p, r.t * area_variation(p), 0, w);
    if constexpr (M == 0)
    {
      Derivatives<D> d{r.t_n, r.t_g, {}};
      if constexpr (is_frictional<Law>)
        d.add_slip(e, q, r.t_w);
      Rows<D, 2 * side> dt = chain<D>(d, p, v);
      if constexpr (is_frictional<Law>)
        dt.template leftCols<side>() +=
            r.t_spring * vary_carried<F>(old_traction(e, p.slave, q), p, q.xi);
      add_work_tangent<2 * side>(p, dt, 0, w);
    }
    else if constexpr (M == 1)
    {
      add_work_tangent<side>(p, turn<D>(r.t_n, p), 0, w);
      add_work_tangent<Layout::multipliers>(p, r.t_lam * shape.transpose(),
                                            side, w);
    }
    else
      for (int k = 0; k < Layout::multipliers; ++k)
        for (int a = 0; a < F::dofs; ++a)
        {
          const int column = side + k * D, m = Layout::master + a * D;
          A.template block<D, D>(a * D, column).diagonal().array() -=
              w * p.N_s[a] * shape[k];
          A.template block<D, D>(m, column).diagonal().array() +=
              w * p.N_m[a] * shape[k];
        }
  }

  /// - dt . (v_s - v_m) over the C columns of dt, the first of which is given
  template <int C>
  void add_work_tangent(const PointGeometry<F>& p, const Rows<D, C>& dt,
                        int column, double w)
  {
    for (int a = 0; a < F::dofs; ++a)
      for (int i = 0; i < D; ++i)
      {
        A.row(a * D + i).template segment<C>(column) -=
            (w * p.N_s[a]) * dt.row(i);
        A.row(Layout::master + a * D + i).template segment<C>(column) +=
            (w * p.N_m[a]) * dt.row(i);
      }
  }

  /// v_m(eta) is taken at another point of the master
  void add_slide_tangent(const PointGeometry<F>& p, const Vec<D>& t,
                         const Rows<D - 1, 2 * Layout::side>& deta, double w)
  {
    constexpr int side = Layout::side;
    for (int a = 0; a < F::dofs; ++a)
    {
      const Rows<1, 2 * side> slide = (w * p.dN_m.row(a)) * deta;
      for (int i = 0; i < D; ++i)
      {
        const int row = Layout::master + a * D + i;
        A.row(row).template head<side>() += t[i] * slide.template head<side>();
        A.row(row).template tail<side>() += t[i] * slide.template tail<side>();
      }
    }
  }

  /// dC . mu / gamma; dC over [slave | master]
  void add_condition_tangent(const MuShape& shape,
                             const Rows<M, 2 * Layout::side>& dC,
                             const Mat<M, M>& C_lam, double w)
  {
    constexpr int side = Layout::side;
    for (int k = 0; k < Layout::multipliers; ++k)
    {
      const double test = w * shape[k];
      for (int i = 0; i < M; ++i)
      {
        auto row = A.row(side + k * M + i);
        row.template head<side>() += test * dC.row(i).template head<side>();
        row.template tail<side>() += test * dC.row(i).template tail<side>();
        for (int j = 0; j < Layout::multipliers; ++j)
          row.template segment<M>(side + j * M) +=
              (test * shape[j]) * C_lam.row(i);
      }
    }
  }

  void add_miss_tangent(const Data& e, const PointGeometry<F>& p,
                        const MuShape& shape, const Vec<M>& C, double w)
  {
    Rows<M, 2 * Layout::side> dC = Rows<M, 2 * Layout::side>::Zero();
    if (e.current)
      dC.template leftCols<Layout::side>() = C * area_variation(p);
    add_condition_tangent(shape, dC, -Mat<M, M>::Identity(), w);
  }

  /// d log |m| over the slave's dofs  [theory (2.4)]
  [[nodiscard]] static Rows<1, Layout::side>
  area_variation(const PointGeometry<F>& p)
  {
    return Eigen::Map<const Rows<1, Layout::side>>(p.G_s.data());
  }
};
} // namespace raymortar
