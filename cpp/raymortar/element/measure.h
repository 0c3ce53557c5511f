// What area counts in integrals over the slave surface.
#pragma once

#include "raymortar/element/kinematics.h"
#include "raymortar/geometry/curvature.h"

namespace raymortar
{
enum class Measure : std::int8_t
{
  reference, ///< area of the undeformed surface
  current    ///< area of the deformed one
};

/// @brief Area that a point stands for.
/// @param[in] weight Of the point in reference coordinates
/// @param[in] area The same times the reference Jacobian
template <int D>
[[nodiscard]] double area_of(Measure measure, double weight, double area,
                             const Frame<D>& slave)
{
  return measure == Measure::current ? weight * slave.jacobian : area;
}

/// @brief Whether the area changes with the displacement.
[[nodiscard]] constexpr bool moves(Measure measure)
{
  return measure == Measure::current;
}

/// @brief Variation of the logarithm of the area by the slave's displacement
/// dofs, where it moves [theory (2.4)].
template <class F>
[[nodiscard]] SideRows<F, 1> area_variation(const PointGeometry<F>& p)
{
  return Eigen::Map<const SideRows<F, 1>>(p.G_s.data());
}

/// @brief Area per reference area, and how it changes along the facet.
template <int D>
struct AreaAlong
{
  double jacobian;
  Mat<1, D - 1> log_jacobian; ///< derivative of the logarithm by xi
};

/// @param[in] reference Undeformed nodes, (gdim, nodes). Length
/// @param[in] slave, bend Of the deformed facet at xi
template <class F>
[[nodiscard]] AreaAlong<F::gdim>
area_along(Measure measure, const typename F::NodeMatrix& reference,
           const typename F::RefPoint& xi, const Frame<F::gdim>& slave,
           const Curvature<F::gdim>& bend)
{
  if (measure == Measure::current)
    return {slave.jacobian, bend.log_jacobian.transpose()};
  const Frame<F::gdim> frame = frame_at<F>(reference, xi);
  return {frame.jacobian,
          curvature_at<F>(reference, xi, frame).log_jacobian.transpose()};
}
} // namespace raymortar
