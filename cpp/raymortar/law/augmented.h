// Augmented Lagrangian laws: theory (4.2), (4.3).
#pragma once

#include "raymortar/law/point_law.h"

namespace raymortar
{
/// @brief Frictionless, scalar multiplier: lam = lam_n n.
///
/// t = lam_n n,  C = min(0, lam_n + gamma g) - lam_n   [theory (4.2)]
struct NormalAugmentedLagrangian
{
  template <int D>
  static constexpr int multiplier_size = 1;

  template <int D>
  [[nodiscard]] static PointResponse<D, 1> evaluate(const PointState<D, 1>& s)
  {
    PointResponse<D, 1> r;
    const double lam_n = s.lam[0];
    const double trial = lam_n + s.gamma * s.g;
    const bool closed = trial <= s.gamma * s.touch;
    r.status = closed ? ContactStatus::slip : ContactStatus::open;
    r.p = closed ? trial : 0.0;
    r.t = lam_n * s.n;
    r.t_n.diagonal().setConstant(lam_n);
    r.t_lam = s.n;
    if (closed)
    {
      r.C[0] = s.gamma * s.g;
      r.C_g[0] = s.gamma;
    }
    else
    {
      r.C[0] = -lam_n;
      r.C_lam(0, 0) = -1.0;
    }
    return r;
  }

  /// C where the point has no hit: the multiplier is driven to 0
  template <int D>
  [[nodiscard]] static Vec<1> without_hit(const Vec<1>& lam)
  {
    return -lam;
  }
};

/// @brief Frictionless, vector multiplier in global coordinates.
///
/// t = lam,  C = min(0, lam . n + gamma g) n - lam   [theory (4.3)]
struct VectorAugmentedLagrangian
{
  template <int D>
  static constexpr int multiplier_size = D;

  template <int D>
  [[nodiscard]] static PointResponse<D, D> evaluate(const PointState<D, D>& s)
  {
    PointResponse<D, D> r;
    const double trial = dot<D>(s.lam, s.n) + s.gamma * s.g;
    const bool closed = trial <= s.gamma * s.touch;
    r.status = closed ? ContactStatus::slip : ContactStatus::open;
    r.p = closed ? trial : 0.0;
    r.t = s.lam;
    r.t_lam.setIdentity();
    r.C = r.p * s.n - s.lam;
    r.C_lam.diagonal().setConstant(-1.0);
    if (closed)
    {
      r.C_lam += s.n * s.n.transpose();
      r.C_n = s.n * s.lam.transpose();
      add_to_diagonal(r.C_n, r.p);
      r.C_g = s.gamma * s.n;
    }
    return r;
  }

  template <int D>
  [[nodiscard]] static Vec<D> without_hit(const Vec<D>& lam)
  {
    return -lam;
  }
};
} // namespace raymortar
