// Derivatives of what springs hold at points by what they have been fitted to.
#pragma once

#include "raymortar/element/assembler.h"

namespace raymortar
{
/// @brief Weights of what springs hold at their points: of the traction there,
/// of the coordinates, and of the area that a point stands for.
template <int D>
struct SpringWeights
{
  Vec<D> held;
  Vec<D - 1> xi;
  double area;

  static constexpr int width = 2 * D;

  /// @param[in] all (spring points, width)
  SpringWeights(std::span<const double> all, std::size_t number)
  {
    const double* const row = all.data() + number * width;
    held = Eigen::Map<const Vec<D>>(row);
    xi = Eigen::Map<const Vec<D - 1>>(row + D);
    area = row[width - 1];
  }
};

/// @brief Go back through (4.13), from weights of the traction at integration
/// points to those of the spring points  [theory (8.11)].
/// @param[in] at_points (integration points, gdim)
/// @return (spring points, width)
[[nodiscard]] std::vector<double>
spring_weights(const ContactState& s, std::span<const double> at_points);
} // namespace raymortar
