// Ray from a slave point to one master facet:  x_s + g n = x_m(eta)   (1).
#pragma once

#include "raymortar/geometry/frame.h"
#include "raymortar/geometry/predicates.h"
#include <cmath>

namespace raymortar
{
enum class RayStatus : std::int8_t
{
  hit,       ///< on the facet (or just outside: see RayHit::outside)
  parallel,  ///< the ray runs along the facet, or the facet has no normal
  diverged,  ///< Newton did not settle
  no_facet,  ///< left the surface over its rim
  back_face, ///< n . n_m >= 0: the surfaces do not face each other
  too_far,   ///< g > reach
  too_deep   ///< g < -depth
};

/// @brief Where a ray meets the (extended) master facet.
template <class F>
struct RayHit
{
  RayStatus status = RayStatus::diverged;
  typename F::RefPoint eta = F::RefPoint::Zero(); ///< reference coordinates
  double g = 0.0;                                 ///< signed distance along n
  Violation outside;                              ///< of the reference facet
};

/// @brief Reference coordinates to start the ray's Newton from: the hit on
/// the flat facet through the first corners.
template <class F>
[[nodiscard]] typename F::RefPoint
flat_guess(const typename F::Point& x_s, const typename F::Point& n,
           const typename F::NodeMatrix& master)
{
  Mat<F::gdim, F::gdim> A;
  for (int j = 0; j < F::tdim; ++j)
    A.col(j) = master.col(j + 1) - master.col(0);
  A.col(F::tdim) = -n;
  const typename F::Point z = A.inverse() * (x_s - master.col(0));
  return z.template head<F::tdim>();
}

/// @brief Intersection of the line x_s + g n with one master facet.
///
/// Newton on (eta, g) on the true facet, unconstrained: eta may leave the
/// reference facet, which `outside` tells, so that the caller can walk to the
/// neighbour. Exact after one step on affine facets.
/// @param[in] x_s Ray origin. Length
/// @param[in] n Unit direction
/// @param[in] master Deformed master nodes, (gdim, nodes). Length
/// @param[in] eta Starting point
/// @return status hit, parallel or diverged; eta and g valid if hit
/// @complexity At most 25 steps of a gdim x gdim solve, no allocation
template <class F>
[[nodiscard]] RayHit<F>
intersect(const typename F::Point& x_s, const typename F::Point& n,
          const typename F::NodeMatrix& master, typename F::RefPoint eta)
{
  constexpr int max_steps = 25;
  // Beyond this the polynomial facet has folded: give up rather than wander
  constexpr double far = 8.0;
  // From the ray's origin, where positions lose no digits to an offset: the
  // facets of an edge must agree on the side that the ray passes
  const typename F::NodeMatrix nodes = master.colwise() - x_s;
  RayHit<F> hit;
  hit.eta = eta;
  hit.g = n.dot(nodes * F::Node::values(eta));
  for (int step = 0; step < max_steps; ++step)
  {
    Mat<F::gdim, F::gdim> A;
    const typename F::Point r = hit.g * n - nodes * F::Node::values(hit.eta);
    A.template leftCols<F::tdim>() = nodes * F::Node::gradients(hit.eta);
    A.col(F::tdim) = -n;
    const double volume = std::abs(A.determinant());
    const double area =
        normal_of(Mat<F::gdim, F::tdim>(A.template leftCols<F::tdim>())).norm();
    // Without a normal, as where corners coincide, small steps mean nothing
    const double extent =
        A.template leftCols<F::tdim>().colwise().squaredNorm().maxCoeff();
    const bool has_normal =
        F::gdim == 2 or area > tolerance::degenerate * extent;
    if (not(has_normal and volume > tolerance::parallel * area))
    {
      hit.status = RayStatus::parallel;
      return hit;
    }
    const typename F::Point dz = A.inverse() * r;
    hit.eta += dz.template head<F::tdim>();
    hit.g += dz[F::tdim];
    const double move = dz.template head<F::tdim>().cwiseAbs().maxCoeff();
    // Eigen's maxCoeff may pass over a NaN: each component is asked
    if (not((hit.eta.array().abs() < far).all() and std::isfinite(hit.g)))
      return hit;
    if (F::affine or move < tolerance::ray_step)
    {
      hit.status = RayStatus::hit;
      hit.outside = violation<F::shape>(hit.eta);
      return hit;
    }
  }
  return hit;
}
} // namespace raymortar
