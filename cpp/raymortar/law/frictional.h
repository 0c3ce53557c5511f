// Laws with friction: (2), (4) of the design, and the frictional penalty.
#pragma once

#include "raymortar/law/elastic_disc.h"
#include "raymortar/law/point_law.h"

namespace raymortar
{
/// @brief State of a point where there is friction.
///
/// Slips shorter than `touch` are stick, as are gaps closed.
template <int D, int M>
struct FrictionState : PointState<D, M>
{
  Vec<D> w; ///< slip increment since the accepted step (2), length
  /// Tangential traction that the step starts from; with a multiplier, how
  /// much more than it. May be zero
  Vec<D> spring;
  FrictionLaw friction;
};

/// @brief Response with the derivatives by slip increment and spring.
template <int D, int M>
struct FrictionResponse : PointResponse<D, M>
{
  Mat<D, D> t_w = Mat<D, D>::Zero();
  Mat<D, D> t_spring = Mat<D, D>::Zero();
  Mat<M, D> C_w = Mat<M, D>::Zero();
  Mat<M, D> C_spring = Mat<M, D>::Zero();
  /// By the coefficient of the friction law
  Vec<D> t_coefficient = Vec<D>::Zero();
  Vec<M> C_coefficient = Vec<M>::Zero();
  /// By the logarithm of gamma: the part through gap, slip and springs less the
  /// whole derivative. Zero but for laws of the slip rate and of elastic slip
  Vec<D> t_rate = Vec<D>::Zero();
  Vec<M> C_rate = Vec<M>::Zero();
};

/// @brief The trial traction of a closed point on its disc.
template <int D, int M>
struct OnDisc
{
  FrictionBound bound;
  ElasticDisc disc;
  Vec<D> z;
  DiscProjection<D> projected;

  /// @param[in] p Normal traction
  OnDisc(const FrictionState<D, M>& s, double p)
      : bound(bound_at(s.friction, p)), disc(bound, s.gamma, M > 0),
        z(trial(s)), projected(s.n, z, disc.radius, s.gamma * s.touch)
  {
  }

  [[nodiscard]] Vec<D> traction() const { return disc.share * projected.value; }

  [[nodiscard]] ContactStatus status() const
  {
    return projected.stick ? ContactStatus::stick : ContactStatus::slip;
  }

  [[nodiscard]] TangentialProjection<D> slopes(const Vec<D>& n) const
  {
    auto f = slopes_of<D>(projected, n, z);
    if (bound.elastic_slip > 0.0)
      take_share<D>(disc, f);
    return f;
  }

private:
  [[nodiscard]] static Vec<D> trial(const FrictionState<D, M>& s)
  {
    if constexpr (M > 0)
      return s.lam + s.spring - s.gamma * s.w;
    else
      return s.spring - s.gamma * s.w;
  }
};

/// @brief Length of the slip along the surface, and its direction there; of no
/// slip, none.
template <int D>
struct SlipAlong
{
  double length;
  Vec<D> direction = Vec<D>::Zero();

  SlipAlong(const Vec<D>& n, const Vec<D>& w)
  {
    const Vec<D> along = w - dot<D>(n, w) * n;
    length = raymortar::length<D>(along);
    if (length > 0.0)
      direction = along / length;
  }

  /// @brief How the length changes with the slip increment, and with n.
  [[nodiscard]] Eigen::Matrix<double, 1, D> by_w() const
  {
    return direction.transpose();
  }
  [[nodiscard]] Eigen::Matrix<double, 1, D> by_n(const Vec<D>& n,
                                                 const Vec<D>& w) const
  {
    return -dot<D>(n, w) * direction.transpose();
  }
};

/// @brief The friction law of the state `at`, as it is at the state `there`.
/// Both have a multiplier.
template <int D, class State>
[[nodiscard]] FrictionLaw friction_at(const State& there, const State& at)
{
  const auto pressure = [](const State& s)
  { return std::min(0.0, dot<D>(s.lam, s.n) + s.gamma * s.g); };
  const auto slip = [](const State& s)
  { return SlipAlong<D>(s.n, s.w).length; };
  return nearby(at.friction, pressure(there) - pressure(at),
                slip(there) - slip(at));
}

/// @brief Add what a bound does that depends on the slip's length, and set what
/// gamma does less than slips.
/// @param[in] f Of the traction
/// @param[in,out] by_w, by_n Derivatives by slip and normal
/// @param[out] by_rate See FrictionResponse
template <int D>
void add_slip_rate(const Vec<D>& n, const Vec<D>& w, const FrictionBound& bound,
                   const TangentialProjection<D>& f, Mat<D, D>& by_w,
                   Mat<D, D>& by_n, Vec<D>& by_rate)
{
  by_rate = -f.by_gamma;
  if (bound.s_slip == 0.0)
    return;
  const SlipAlong<D> slip(n, w);
  const Vec<D> by_slip = bound.s_slip * f.by_s;
  by_w += by_slip * slip.by_w();
  by_n += by_slip * slip.by_n(n, w);
  by_rate += slip.length * by_slip;
}

/// @brief Whether a response has derivatives, or is a PointValue.
template <class Response>
inline constexpr bool has_slopes = requires(Response r)
{
  r.t_n;
};

/// @brief Augmented Lagrangian with friction, vector multiplier.
///
/// t = lam,  C = p n + P_s(T_n (lam + spring - gamma w)) - lam,
/// p = min(0, lam . n + gamma g)   [theory (4.7)], with elastic slip (4.52)
struct FrictionalAugmentedLagrangian
{
  template <int D>
  static constexpr int multiplier_size = D;

  /// @tparam Response With derivatives, or a PointValue
  template <int D, class Response = FrictionResponse<D, D>>
  [[nodiscard]] static Response evaluate(const FrictionState<D, D>& s)
  {
    Response r;
    const double trial = s.lam.dot(s.n) + s.gamma * s.g;
    const bool closed = trial <= s.gamma * s.touch;
    r.status = ContactStatus::open;
    r.t = s.lam;
    r.C = -s.lam;
    r.held.setZero();
    if constexpr (has_slopes<Response>)
    {
      r.t_lam.setIdentity();
      r.C_lam.diagonal().setConstant(-1.0);
    }
    if (closed)
      add_closed<D>(s, trial, r);
    return r;
  }

  template <int D>
  [[nodiscard]] static Vec<D> without_hit(const Vec<D>& lam)
  {
    return -lam;
  }

private:
  template <int D, class Response>
  static void add_closed(const FrictionState<D, D>& s, double p, Response& r)
  {
    const OnDisc<D, D> at(s, p);
    r.status = at.status();
    r.p = p;
    r.C += p * s.n + at.traction();
    r.held = at.projected.value;
    if constexpr (has_slopes<Response>)
      add_slopes<D>(s, at.bound, at.slopes(s.n), r);
  }

  template <int D>
  static void
  add_slopes(const FrictionState<D, D>& s, const FrictionBound& bound,
             const TangentialProjection<D>& f, FrictionResponse<D, D>& r)
  {
    // Derivative by p: along n, and by the radius of the disc
    const Vec<D> by_p = s.n + bound.s_p * f.by_s;
    r.C_lam += by_p * s.n.transpose() + f.by_z;
    r.C_n = by_p * s.lam.transpose() + f.by_n;
    add_to_diagonal(r.C_n, r.p);
    r.C_g = s.gamma * by_p;
    r.C_w = -s.gamma * f.by_z;
    r.C_spring = f.by_z;
    r.C_coefficient = bound.s_coefficient * f.by_s;
    add_slip_rate<D>(s.n, s.w, bound, f, r.C_w, r.C_n, r.C_rate);
  }
};

/// @brief Penalty with friction.
///
/// t = p n + P_s(T_n (spring - gamma w)), p = gamma min(0, g)   [theory (4.8)],
/// with elastic slip (4.52).
/// With spring = 0 the tangential part is a viscous regularisation.
struct FrictionalPenalty
{
  template <int D>
  static constexpr int multiplier_size = 0;

  /// @tparam Response With derivatives, or a PointValue
  template <int D, class Response = FrictionResponse<D, 0>>
  [[nodiscard]] static Response evaluate(const FrictionState<D, 0>& s)
  {
    Response r;
    r.status = ContactStatus::open;
    r.t.setZero();
    r.held.setZero();
    if (s.g > s.touch)
      return r;
    r.p = s.gamma * s.g;
    const OnDisc<D, 0> at(s, r.p);
    r.status = at.status();
    r.t = r.p * s.n + at.traction();
    r.held = at.projected.value;
    if constexpr (has_slopes<Response>)
      add_slopes<D>(s, at.bound, at.slopes(s.n), r);
    return r;
  }

  template <int D>
  [[nodiscard]] static Vec<0> without_hit(const Vec<0>&)
  {
    return {};
  }

private:
  template <int D>
  static void
  add_slopes(const FrictionState<D, 0>& s, const FrictionBound& bound,
             const TangentialProjection<D>& f, FrictionResponse<D, 0>& r)
  {
    r.t_g = s.gamma * (s.n + bound.s_p * f.by_s);
    r.t_n = f.by_n;
    add_to_diagonal(r.t_n, r.p);
    r.t_w = -s.gamma * f.by_z;
    r.t_spring = f.by_z;
    r.t_coefficient = bound.s_coefficient * f.by_s;
    add_slip_rate<D>(s.n, s.w, bound, f, r.t_w, r.t_n, r.t_rate);
  }
};

/// @brief Whether a law takes a FrictionState.
template <class Law>
inline constexpr bool is_frictional = false;
template <>
inline constexpr bool is_frictional<FrictionalAugmentedLagrangian> = true;
template <>
inline constexpr bool is_frictional<FrictionalPenalty> = true;

/// @brief Whether a law projects tractions on the cone of friction at points.
template <class Law>
inline constexpr bool has_cone_at_points = false;
template <>
inline constexpr bool has_cone_at_points<FrictionalAugmentedLagrangian> = true;
template <>
inline constexpr bool has_cone_at_points<FrictionalPenalty> = true;
} // namespace raymortar
