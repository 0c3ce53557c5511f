// A flux at one point and its derivatives by the law's arguments.
#pragma once

#include "raymortar/element/any_points.h"
#include "raymortar/flux/flux.h"
#include "raymortar/law/penalty.h"
#include "raymortar/nodes/nodal.h"

namespace raymortar
{
/// @brief Traction that a flux sees of contact with a scalar multiplier,
/// t = lam n. Laws without friction know no slip: this has it.
struct ScalarTraction
{
  template <int D>
  static constexpr int multiplier_size = 1;

  template <int D, class Response>
  [[nodiscard]] static Response evaluate(const FrictionState<D, 1>& s)
  {
    Response r;
    r.status = ContactStatus::open;
    r.p = s.lam[0];
    r.t = s.lam[0] * s.n;
    if constexpr (has_slopes<Response>)
    {
      r.t_n.diagonal().setConstant(s.lam[0]);
      r.t_lam = s.n;
    }
    return r;
  }
};

template <>
inline constexpr bool is_frictional<ScalarTraction> = true;

/// @brief Call `fn.template operator()<Law>()` with what gives the traction of
/// a zone: its multiplier, or its penalty.
template <class Fn>
decltype(auto) with_traction(const ContactState& s, Fn&& fn)
{
  switch (s.multipliers.components)
  {
  case 0:
    return fn.template operator()<FrictionalPenalty>();
  case 1:
    return fn.template operator()<ScalarTraction>();
  default:
    if (s.friction and not s.has_law_at_nodes())
      return fn.template operator()<FrictionalAugmentedLagrangian>();
    return fn.template operator()<Nodal<FrictionalAugmentedLagrangian>>();
  }
}

/// @brief The field on both sides at one point after the other.
template <int D>
class FluxAt
{
public:
  static constexpr int T = D - 1;

  FluxAt(const ContactState& s, const FluxFields& fields)
      : _state(s), _fields(fields), _slave(s.slave.shape, fields.slave.degree),
        _master(s.master.shape, fields.master.degree)
  {
  }

  void take(std::size_t element)
  {
    const auto facet = static_cast<std::size_t>(_state.elements.slave[element]);
    _first_slave = facet * static_cast<std::size_t>(_slave.nodes());
    const Index hit = _state.master_of(element);
    _has_master = hit != no_index;
    _first_master = _has_master ? static_cast<std::size_t>(hit) *
                                      static_cast<std::size_t>(_master.nodes())
                                : 0;
  }

  void place(std::size_t q)
  {
    _slave.first(_state.points.xi[q].template head<T>(), _N_s);
    sum(_fields.slave, _first_slave, _slave.nodes(), _N_s, slave, slave_xi);
    target = _fields.tool;
    target_eta.setZero();
    if (not _has_master)
      return;
    _master.first(_state.hits.eta[q].template head<T>(), _N_m);
    sum(_fields.master, _first_master, _master.nodes(), _N_m, target,
        target_eta);
  }

  [[nodiscard]] int slave_nodes() const { return _slave.nodes(); }
  /// Nodes of what is hit that have unknowns
  [[nodiscard]] int target_nodes() const
  {
    return _has_master ? _master.nodes() : 0;
  }
  [[nodiscard]] int nodes() const { return slave_nodes() + target_nodes(); }

  /// Rows of the slave's nodes, then of those of what is hit
  [[nodiscard]] GlobalIndex row(int k) const
  {
    const int n = slave_nodes();
    return k < n ? _fields.slave.rows[_first_slave + std::size_t(k)]
                 : _fields.master.rows[_first_master + std::size_t(k - n)];
  }

  [[nodiscard]] double slave_value(int a) const { return _N_s[at(a)][0]; }
  [[nodiscard]] double target_value(int a) const { return _N_m[at(a)][0]; }
  [[nodiscard]] Vec<T> slave_gradient(int a) const
  {
    return Eigen::Map<const Vec<T>>(_N_s[at(a)].data() + 1);
  }
  [[nodiscard]] Vec<T> target_gradient(int a) const
  {
    return Eigen::Map<const Vec<T>>(_N_m[at(a)].data() + 1);
  }

  double slave = 0.0, target = 0.0;
  Vec<T> slave_xi, target_eta; ///< gradients on the facets

private:
  [[nodiscard]] static std::size_t at(int k)
  {
    return static_cast<std::size_t>(k);
  }

  static void sum(const FluxSide& side, std::size_t first, int nodes,
                  const ShapeRows<T>& N, double& value, Vec<T>& gradient)
  {
    value = 0.0;
    gradient.setZero();
    for (std::size_t a = 0; a < at(nodes); ++a)
    {
      const double nodal = side.values[first + a];
      value += N[a][0] * nodal;
      for (int i = 0; i < T; ++i)
        gradient[i] += N[a][at(1 + i)] * nodal;
    }
  }

  const ContactState& _state;
  const FluxFields& _fields;
  ShapeFunctions<T> _slave, _master;
  ShapeRows<T> _N_s, _N_m;
  std::size_t _first_slave = 0, _first_master = 0;
  bool _has_master = false;
};

/// @brief What leaves both sides at a point: the flux less the heat that
/// friction brings  [theory (7.1)].
/// @param[in] has_springs See HitPoint::dissipated
template <class Hit>
[[nodiscard]] Vec<2> leaving(const Hit& p, const FluxValues& flux,
                             std::size_t k, bool has_springs)
{
  const double work = p.dissipated(has_springs);
  return {flux.q[k] - flux.slave_heat * work,
          -flux.q[k] - flux.target_heat * work};
}

/// @brief The derivatives of the energy that slip beyond the cone takes, of a
/// penalty: M = 0  [theory (7.10)].
template <int D, int M>
struct ConeSlopes
{
  double value; ///< that energy
  Mat<1, D> by_n, by_w, by_spring;
  Vec<1> by_g, by_coefficient, by_rate;
  Mat<1, M> by_lam;

  /// @param[in] p On the cone
  template <class Hit>
  explicit ConeSlopes(const Hit& p) : value(p.dissipated(true))
  {
    const auto& r = p.response;
    const Vec<D> P = p.friction(), z = p.trial();
    const double z_n = dot<D>(p.normal, z);
    const Vec<D> q = z - z_n * p.normal;
    const double t_n = dot<D>(p.normal, r.t);
    const Vec<D> t = (r.t - t_n * p.normal) / p.gamma;
    const Mat<1, D> by_t = ((q - P) / p.gamma).transpose();
    const Mat<1, D> by_P = -t.transpose(), by_z = t.transpose();
    by_n = (r.p - z_n) * by_z - t_n * by_t;
    by_w = -p.gamma * by_z;
    by_spring = by_z;
    const Mat<1, D> by_both = by_t + by_P;
    by_n += by_both * r.t_n;
    by_g = by_both * r.t_g;
    by_w += by_both * r.t_w;
    by_spring += by_both * r.t_spring;
    by_coefficient = by_both * r.t_coefficient;
    by_rate = by_both * r.t_rate;
  }

  [[nodiscard]] LawSlopes<1, D, M, true> slopes() const
  {
    return {by_n, by_g, by_lam, by_w, by_spring, by_coefficient, by_rate};
  }
};

/// @brief The derivatives of `leaving` by what the law takes  [theory (7.3)].
template <int D, int M>
struct FluxSlopes
{
  Mat<2, D> by_t, by_n, by_w;
  Vec<2> by_g;
  Vec<2> by_slave, by_target;      ///< by the field
  Vec<2> sides{1.0, -1.0};         ///< by the flux
  Vec<2> by_cone = Vec<2>::Zero(); ///< by the energy of the cone, if there is
  std::optional<ConeSlopes<D, M>> cone;

  /// @param[in] has_springs See HitPoint::dissipated
  template <class Hit>
  FluxSlopes(const Hit& p, const FluxValues& flux, std::size_t k,
             bool has_springs)
  {
    const double* const q = flux.slopes.data() + 5 * k;
    const Vec<D>&t = p.response.t, &nu = p.normal, &w = p.old.w;
    const SlipAlong<D> slip(nu, w);
    Vec<2> heat(-flux.slave_heat, -flux.target_heat);
    if constexpr (M == 0)
      if (has_springs)
      {
        if (p.response.status == ContactStatus::slip)
        {
          cone.emplace(p);
          by_cone = heat;
        }
        heat.setZero();
      }
    const double along_w = nu.dot(w), along_t = nu.dot(t);
    // p = - nu . t where that is positive
    const Vec<2> by_pressure =
        along_t < 0.0 ? Vec<2>(-q[2] * sides) : Vec<2>(Vec<2>::Zero());
    const Vec<2> by_slip = q[4] * sides;
    by_slave = q[0] * sides;
    by_target = q[1] * sides;
    by_g = q[3] * sides;
    by_t = by_pressure * nu.transpose() - heat * p.slip().transpose();
    by_n = by_pressure * t.transpose() + by_slip * slip.by_n(nu, w) +
           heat * (along_w * t + along_t * w).transpose();
    by_w = by_slip * slip.by_w() - heat * (t - along_t * nu).transpose();
  }
};
} // namespace raymortar
