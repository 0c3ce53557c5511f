// Tangential traction carried along with the slave surface from the accepted
// step: what the springs of the elastic penalty start from.
#pragma once

#include "raymortar/element/kinematics.h"
#include "raymortar/geometry/curvature.h"

namespace raymortar
{
/// @brief a x b; in 2D it stands on the plane and leaves no vector in it.
[[nodiscard]] inline Vec<2> cross(const Vec<2>&, const Vec<2>&)
{
  return Vec<2>::Zero();
}
[[nodiscard]] inline Vec<3> cross(const Vec<3>& a, const Vec<3>& b)
{
  return a.cross(b);
}

/// @brief The traction v of the old surface, turned with the surface.
///
/// Let A = sum_i t_i (x) t_0^i take old tangent vectors to present ones. The
/// rotation of its polar decomposition is A v - n x A (n_0 x v), but for the
/// length: in two dimensions A + cof A is a multiple of it. Neither drilling
/// nor tilting of the surface is lost, and stretch does not change the length
/// [theory (4.9)].
template <int D>
struct CarriedTraction
{
  double length;     ///< |v|; where it is 0, nothing else is set
  Vec<D - 1> along;  ///< components of v on the old tangents
  Vec<D - 1> across; ///< of n_0 x v, which is 0 in 2D
  Vec<D> direction;  ///< of the turned traction, of any length

  [[nodiscard]] Vec<D> value() const
  {
    if (length == 0.0)
      return Vec<D>::Zero();
    return length * direction.normalized();
  }
};

/// @param[in] old Frame at the accepted step
/// @param[in] now Frame of the same material point
/// @param[in] traction What there is along the old normal drops out
template <int D>
[[nodiscard]] CarriedTraction<D>
carry_traction(const Frame<D>& old, const Frame<D>& now, const Vec<D>& traction)
{
  CarriedTraction<D> c;
  const Vec<D> v = traction - old.n.dot(traction) * old.n;
  c.length = v.norm();
  if (c.length == 0.0)
    return c;
  const Mat<D, D - 1> dual = dual_tangents<D>(old.t);
  c.along = dual.transpose() * v;
  c.across = dual.transpose() * cross(old.n, v);
  const Vec<D> turned = now.t * c.across;
  c.direction = now.t * c.along - cross(now.n, turned);
  return c;
}

/// @brief Variation of value() as rows over the slave's displacement dofs.
template <class F>
[[nodiscard]] Mat<F::gdim, Variations<F>::side>
vary_carried(const CarriedTraction<F::gdim>& c, const PointGeometry<F>& p)
{
  constexpr int D = F::gdim;
  Mat<D, Variations<F>::side> rows;
  rows.setZero();
  if (c.length == 0.0)
    return rows;
  const Vec<D> n = p.slave.n;
  const Vec<D> across = p.slave.t * c.across;
  const Vec<D> along = c.direction.normalized();
  const Mat<D, D> normalise =
      c.length / c.direction.norm() *
      (Mat<D, D>::Identity() - along * along.transpose());
  for (int a = 0; a < F::dofs; ++a)
  {
    const double by_along = p.dN_s.row(a).dot(c.along);
    const double by_across = p.dN_s.row(a).dot(c.across);
    // d direction = dt along - n x (dt across) + (t across) x dn
    const Vec<D> by_n = -cross(across, Vec<D>(p.G_s.col(a)));
    for (int i = 0; i < D; ++i)
    {
      const Vec<D> e = Vec<D>::Unit(i);
      rows.col(a * D + i) =
          normalise * (by_along * e - by_across * cross(n, e) + by_n * n[i]);
    }
  }
  return rows;
}

/// @brief Frame of a material point with its derivatives along the facet.
template <int D>
struct BentFrame
{
  Frame<D> frame;
  Curvature<D> bend;
};

/// @brief Derivative by xi of what carry_traction makes of a field.
/// @param[in] c What it makes of it
/// @param[in] old, now Of the same material point
/// @param[in] traction, traction_xi The field and its derivative by xi
template <int D>
[[nodiscard]] Mat<D, D - 1>
carried_along_facet(const CarriedTraction<D>& c, const BentFrame<D>& old,
                    const BentFrame<D>& now, const Vec<D>& traction,
                    const Mat<D, D - 1>& traction_xi)
{
  Mat<D, D - 1> rate = Mat<D, D - 1>::Zero();
  if (c.length == 0.0)
    return rate;
  const Vec<D> n_0 = old.frame.n;
  const Mat<D, D - 1>& t_0 = old.frame.t;
  const Mat<D - 1, D - 1> metric = (t_0.transpose() * t_0).inverse();
  const double normal = n_0.dot(traction);
  const Vec<D> v = traction - normal * n_0;
  const Vec<D> along = c.direction.normalized();
  const Vec<D> turned = now.frame.t * c.across;
  for (int j = 0; j < D - 1; ++j)
  {
    const auto k = static_cast<std::size_t>(j);
    const Mat<D, D - 1>&dt_0 = old.bend.t[k], &dt = now.bend.t[k];
    const Vec<D> dn_0 = old.bend.n.col(j), dn = now.bend.n.col(j);
    const Vec<D> dtraction = traction_xi.col(j);
    const Vec<D> dv = dtraction - normal * dn_0 -
                      (dn_0.dot(traction) + n_0.dot(dtraction)) * n_0;
    // Of the components a of a vector u on the tangents: (t^T t) a = t^T u
    const auto components = [&](const Vec<D>& u, const Vec<D>& du,
                                const Vec<D - 1>& a) -> Vec<D - 1>
    {
      const Vec<D> rest = u - t_0 * a;
      return metric *
             (dt_0.transpose() * rest + t_0.transpose() * (du - dt_0 * a));
    };
    const Vec<D - 1> dalong = components(v, dv, c.along);
    const Vec<D - 1> dacross =
        components(cross(n_0, v), cross(dn_0, v) + cross(n_0, dv), c.across);
    const Vec<D> dturned = dt * c.across + now.frame.t * dacross;
    const Vec<D> ddirection = dt * c.along + now.frame.t * dalong -
                              cross(dn, turned) - cross(now.frame.n, dturned);
    rate.col(j) = v.dot(dv) / c.length * along +
                  c.length / c.direction.norm() *
                      (ddirection - along.dot(ddirection) * along);
  }
  return rate;
}
} // namespace raymortar
