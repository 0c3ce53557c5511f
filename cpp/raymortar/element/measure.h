// The area that counts in integrals over the slave surface.
#pragma once

#include "raymortar/geometry/curvature.h"
#include "raymortar/geometry/revolution.h"

namespace raymortar
{
/// Of revolution: the area of a full turn of a 2D surface about the axis r = 0,
/// in coordinates (r, z)
enum class Measure : std::int8_t
{
  reference, ///< area of the undeformed surface
  current,   ///< area of the deformed one
  reference_of_revolution,
  current_of_revolution
};

/// @brief Whether the area changes with the displacement.
[[nodiscard]] constexpr bool moves(Measure measure)
{
  return measure == Measure::current or
         measure == Measure::current_of_revolution;
}

/// @brief Whether 2D surfaces stand for surfaces of revolution.
[[nodiscard]] constexpr bool revolves(Measure measure)
{
  return measure == Measure::reference_of_revolution or
         measure == Measure::current_of_revolution;
}

/// @brief Area that a point stands for [theory (2.12)].
/// @param[in] weight Of the point in reference coordinates
/// @param[in] area The same times the reference Jacobian, and the reference
/// circumference in measures of revolution
template <int D>
[[nodiscard]] double area_of(Measure measure, double weight, double area,
                             const Frame<D>& slave)
{
  if (not moves(measure))
    return area;
  const double moved = weight * slave.jacobian;
  if constexpr (D == 2)
    if (revolves(measure))
      return moved * circumference(slave.x);
  return moved;
}

/// @brief Add that the area varies with the slave, by which f is multiplied,
/// where it moves [theory (2.4), (2.13)].
/// @param[in] dual Of the slave's tangents
/// @param[in,out] rows By its position and by each tangent
template <int R, int D>
void add_area(Measure measure, const Frame<D>& slave, const Mat<D, D - 1>& dual,
              const Vec<R>& f, std::array<Mat<R, D>, D>& rows)
{
  if (not moves(measure))
    return;
  for (int j = 0; j < D - 1; ++j)
    rows[static_cast<std::size_t>(1 + j)] += f * column(dual, j).transpose();
  if constexpr (D == 2)
    if (revolves(measure))
      rows[0].col(0) += f / slave.x[0];
}

/// @brief Area per reference area, and how it changes along the facet.
template <int D>
struct AreaAlong
{
  double jacobian;
  Mat<1, D - 1> log_jacobian; ///< derivative of the logarithm by xi
};

/// @param[in] frame, bend Of the surface whose area counts
template <int D>
[[nodiscard]] AreaAlong<D> area_along(Measure measure, const Frame<D>& frame,
                                      const Curvature<D>& bend)
{
  AreaAlong<D> area{frame.jacobian, bend.log_jacobian.transpose()};
  if constexpr (D == 2)
    if (revolves(measure))
    {
      area.jacobian *= circumference(frame.x);
      area.log_jacobian += frame.t.row(0) / frame.x[0];
    }
  return area;
}

/// @param[in] reference Undeformed nodes, (gdim, nodes). Length
/// @param[in] slave, bend Of the deformed facet at xi
template <class F>
[[nodiscard]] AreaAlong<F::gdim>
area_along(Measure measure, const typename F::NodeMatrix& reference,
           const typename F::RefPoint& xi, const Frame<F::gdim>& slave,
           const Curvature<F::gdim>& bend)
{
  if (moves(measure))
    return area_along<F::gdim>(measure, slave, bend);
  const Frame<F::gdim> frame = frame_at<F>(reference, xi);
  return area_along<F::gdim>(measure, frame,
                             curvature_at<F>(reference, xi, frame));
}
} // namespace raymortar
