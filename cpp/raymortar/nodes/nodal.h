// Laws that hold at nodes: integration points have the multiplier's traction
// alone, and what they give to the means that the law takes.
#pragma once

#include "raymortar/law/augmented.h"
#include "raymortar/law/frictional.h"

namespace raymortar
{
/// @brief A law at nodes, as its integration points see it: t = lam n or lam,
/// without a condition.
/// @tparam Law Evaluated at the nodes
template <class Law>
struct Nodal
{
  using AtNodes = Law;

  template <int D>
  static constexpr int multiplier_size = Law::template multiplier_size<D>;

  template <int D, int M>
  [[nodiscard]] static PointResponse<D, M> evaluate(const PointState<D, M>& s)
  {
    PointResponse<D, M> r;
    set<D>(s, r);
    return r;
  }

  /// With friction
  template <int D, class Response>
  [[nodiscard]] static Response evaluate(const FrictionState<D, D>& s)
  {
    Response r;
    set<D>(s, r);
    return r;
  }

private:
  template <int D, int M, class Response>
  static void set(const PointState<D, M>& s, Response& r)
  {
    r.status = ContactStatus::open; // until the nodes tell
    r.C.setZero();
    if constexpr (M == D)
    {
      r.t = s.lam;
      r.p = s.lam.dot(s.n);
    }
    else
    {
      r.t = s.lam[0] * s.n;
      r.p = s.lam[0];
    }
    if constexpr (has_slopes<Response>)
    {
      if constexpr (M == D)
        r.t_lam.setIdentity();
      else
      {
        r.t_n.diagonal().setConstant(s.lam[0]);
        r.t_lam = s.n;
      }
    }
  }
};

template <>
inline constexpr bool is_frictional<Nodal<FrictionalAugmentedLagrangian>> =
    true;

template <class Law>
inline constexpr bool holds_at_points<Nodal<Law>> = false;
} // namespace raymortar
