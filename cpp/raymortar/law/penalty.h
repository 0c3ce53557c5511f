// Penalty law: no multiplier.
#pragma once

#include "raymortar/law/point_law.h"

namespace raymortar
{
/// @brief Frictionless penalty: t = gamma min(0, g) n   [theory (4.5)]
struct NormalPenalty
{
  template <int D>
  static constexpr int multiplier_size = 0;

  template <int D>
  [[nodiscard]] static PointResponse<D, 0> evaluate(const PointState<D, 0>& s)
  {
    PointResponse<D, 0> r;
    const bool closed = s.g <= s.touch;
    r.status = closed ? ContactStatus::slip : ContactStatus::open;
    r.p = closed ? s.gamma * s.g : 0.0;
    r.t = r.p * s.n;
    if (closed)
    {
      r.t_n.diagonal().setConstant(r.p);
      r.t_g = s.gamma * s.n;
    }
    return r;
  }

  template <int D>
  [[nodiscard]] static Vec<0> without_hit(const Vec<0>&)
  {
    return {};
  }
};
} // namespace raymortar
