// Residual and tangent of a flux on one element, over the field's nodes.
#pragma once

#include "raymortar/element/segment_motion.h"
#include "raymortar/flux/flux_point.h"

namespace raymortar
{
/// @brief Accumulates the rows of one element: those of the slave's nodes of
/// the field first; those of the target's stand where its displacements do.
template <int D, class Law>
class FluxElement : public AnyElement<D, Law>
{
public:
  using Base = AnyElement<D, Law>;
  using Base::M;
  using Base::T;
  using Data = typename Base::Data;
  using Shapes = typename Base::Shapes;
  template <bool Slopes>
  using Hit = typename Base::template Hit<Slopes>;
  using HitTangent = typename Base::HitTangent;

  /// Most nodes of the field on both sides
  static constexpr int most_nodes = D == 2 ? 6 : 18;
  std::array<double, most_nodes> r;
  /// Tangent by the field, (nodes, nodes) row-major; by all else it is `A`
  std::array<double, static_cast<std::size_t>(most_nodes* most_nodes)> by_field;

  void clear_residual(const FluxAt<D>& field)
  {
    std::fill_n(r.begin(), field.nodes(), 0.0);
  }

  void clear_tangent(const FluxAt<D>& field, const Shapes& at)
  {
    std::fill_n(by_field.begin(), field.nodes() * field.nodes(), 0.0);
    Base::clear_tangent(at.size());
  }

  /// @brief Row of `A` that a node of the field has.
  [[nodiscard]] static int row_of(int node, const FluxAt<D>& field,
                                  const Shapes& at)
  {
    const int n = field.slave_nodes();
    return node < n ? node : at.alone() + node - n;
  }

  void add_residual(const Hit<false>& p, const FluxAt<D>& field,
                    const FluxValues& flux, std::size_t k, bool has_springs)
  {
    const Vec<2> h = p.weight * leaving(p, flux, k, has_springs);
    const int n = field.slave_nodes();
    for (int a = 0; a < n; ++a)
      r[place(a)] += field.slave_value(a) * h[0];
    for (int m = 0; m < field.target_nodes(); ++m)
      r[place(n + m)] += field.target_value(m) * h[1];
  }

  /// @brief Tangent at a fixed point.
  void add_tangent(const Data& e, const Hit<true>& p, const HitTangent& by,
                   const FluxSlopes<D, M>& d, const Vec<2>& h,
                   const FluxAt<D>& field, const Shapes& at)
  {
    add_by_field(p.weight, d, field);
    UnknownRows<2, D> rows = vary(e, p, by, d, h, at);
    const UnknownRows<T, D> eta = this->slide_rows(this->vary_eta(p, by), at);
    const int size = at.size();
    for (std::size_t side = 0; side < 2; ++side)
      for (std::size_t i = 0; i < T; ++i)
        add_row(d.by_target[int(side)] * field.target_eta[int(i)], eta[i], size,
                rows[side].data());
    for (int a = 0; a < field.slave_nodes(); ++a)
      add_row(p.weight * field.slave_value(a), rows[0], size,
              this->A.data() + a * size);
    for (int m = 0; m < field.target_nodes(); ++m)
    {
      double* const out = this->A.data() + (at.alone() + m) * size;
      add_row(p.weight * field.target_value(m), rows[1], size, out);
      const Vec<T> slide = p.weight * h[1] * field.target_gradient(m);
      for (std::size_t i = 0; i < T; ++i)
        add_row(slide[int(i)], eta[i], size, out);
    }
  }

  /// @brief Integrand per unit of weight, and its change along the slave.
  static void set_integrand(const Data& e, const ElementPoint& q,
                            const Hit<true>& p, const HitTangent& by,
                            const FluxSlopes<D, M>& d, const Vec<2>& h,
                            const Vec<T>& law_xi, const FluxAt<D>& field,
                            const Shapes& at, AnyIntegrand<D>& out)
  {
    using Columns = FacetColumns<D, Law>;
    const typename TaylorGradient<D, Law>::Place along(e, p, by.dual);
    const Mat<1, T> no_gamma = Mat<1, T>::Zero();
    const Mat<M, T> no_lam = Mat<M, T>::Zero();
    const Mat<M, T> lam = e.lam.template block<M, T>(0, 1);
    const Columns geometry(e, q, p, by, along.bend, no_gamma, no_lam);
    const Columns of_traction(e, q, p, by, along.bend, along.log_gamma, lam);
    const Mat<T, T> eta_xi = geometry.eta();
    Mat<2, T> h_xi = chain<2>(Geometric(d).slopes(), p, by, geometry) +
                     d.by_t * chain<D>(traction_slopes(p), p, by, of_traction) +
                     d.by_slave * field.slave_xi.transpose() +
                     d.by_target * (field.target_eta.transpose() * eta_xi) +
                     d.sides * law_xi.transpose() + h * along.area.log_jacobian;
    if (d.cone)
      h_xi += d.by_cone * (chain<1>(d.cone->slopes(), p, by, of_traction) -
                           d.cone->value * along.log_gamma);
    clear(at.size(), out);
    const double area = along.area.jacobian;
    for (int a = 0; a < field.slave_nodes(); ++a)
      set(out, a, area, field.slave_value(a), h[0], h_xi.row(0),
          field.slave_gradient(a).transpose());
    for (int m = 0; m < field.target_nodes(); ++m)
      set(out, at.alone() + m, area, field.target_value(m), h[1], h_xi.row(1),
          field.target_gradient(m).transpose() * eta_xi);
  }

private:
  /// Derivatives by the quantities that vary with contact's geometry, at a
  /// fixed traction
  struct Geometric
  {
    const FluxSlopes<D, M>& d;
    Mat<2, M> no_lam = Mat<2, M>::Zero();
    Mat<2, D> no_spring = Mat<2, D>::Zero();
    Vec<2> none = Vec<2>::Zero();

    explicit Geometric(const FluxSlopes<D, M>& slopes) : d(slopes) {}

    [[nodiscard]] LawSlopes<2, D, M, true> slopes() const
    {
      return {d.by_n, d.by_g, no_lam, d.by_w, no_spring, none, none};
    }
  };

  /// Variation of the flux that leaves both sides with the unknowns of contact,
  /// at a fixed field
  [[nodiscard]] static UnknownRows<2, D> vary(const Data& e, const Hit<true>& p,
                                              const HitTangent& by,
                                              const FluxSlopes<D, M>& d,
                                              const Vec<2>& h, const Shapes& at)
  {
    const typename Base::Columns columns(p, by, at.has_target());
    const Geometric geometric(d);
    auto varied = chain<2>(geometric.slopes(), p, by, columns);
    const auto dt = chain<D>(traction_slopes(p), p, by, columns);
    for (std::size_t k = 0; k < D; ++k)
    {
      varied.slave[k] += d.by_t * dt.slave[k];
      varied.target[k] += d.by_t * dt.target[k];
    }
    if (d.cone)
    {
      const auto dissipated = chain<1>(d.cone->slopes(), p, by, columns);
      for (std::size_t k = 0; k < D; ++k)
      {
        varied.slave[k] += d.by_cone * dissipated.slave[k];
        varied.target[k] += d.by_cone * dissipated.target[k];
      }
    }
    Base::template add_area<2>(e, p, by.dual, h, varied);
    UnknownRows<2, D> rows;
    expand<2, D>(at, varied,
                 at.has_target() ? TargetPart::all : TargetPart::none, rows);
    if constexpr (M > 0)
    {
      const Mat<2, M> by_lam = d.by_t * p.response.t_lam;
      for (int k = 0; k < at.multipliers; ++k)
        for (int i = 0; i < M; ++i)
          for (int side = 0; side < 2; ++side)
            rows[place(side)][place(at.side() + k * M + i)] =
                at.multiplier_value(k) * by_lam(side, i);
    }
    return rows;
  }

  void add_by_field(double w, const FluxSlopes<D, M>& d, const FluxAt<D>& field)
  {
    const int n = field.slave_nodes(), all = field.nodes();
    const auto value = [&](int k)
    { return k < n ? field.slave_value(k) : field.target_value(k - n); };
    for (int a = 0; a < all; ++a)
    {
      const int side = a < n ? 0 : 1;
      for (int c = 0; c < all; ++c)
        by_field[place(a * all + c)] +=
            w * value(a) * (c < n ? d.by_slave : d.by_target)[side] * value(c);
    }
  }

  static void add_row(double by, const typename AnyIntegrand<D>::Row& row,
                      int count, double* __restrict out)
  {
    for (int k = 0; k < count; ++k)
      out[k] += by * row[place(k)];
  }

  static void clear(int size, AnyIntegrand<D>& out)
  {
    std::fill_n(out.f.begin(), size, 0.0);
    for (auto& rate : out.f_xi)
      std::fill_n(rate.begin(), size, 0.0);
  }

  static void set(AnyIntegrand<D>& out, int row, double area, double N,
                  double h, const Mat<1, T>& h_xi, const Mat<1, T>& N_xi)
  {
    out.f[place(row)] = area * N * h;
    for (int j = 0; j < T; ++j)
      out.f_xi[place(j)][place(row)] = area * (N * h_xi[j] + h * N_xi[j]);
  }

  [[nodiscard]] static std::size_t place(int k)
  {
    return static_cast<std::size_t>(k);
  }
};
} // namespace raymortar
