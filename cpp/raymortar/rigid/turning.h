// Rotations by a vector, with their derivatives.
#pragma once

#include "raymortar/core/types.h"
#include <array>

namespace raymortar
{
/// @brief The vector v whose cross product is the skew part of a matrix.
[[nodiscard]] Vec<3> axial(const Mat<3, 3>& matrix);

/// @brief Rotation about the direction of a vector by its length in radians.
///
/// Rodrigues' formula.
[[nodiscard]] Mat<3, 3> rotation_matrix(const Vec<3>& rotation);

/// @brief A rotation and its derivatives by the components of its vector.
struct Turning
{
  Mat<3, 3> R;
  std::array<Mat<3, 3>, 3> first;
  std::array<std::array<Mat<3, 3>, 3>, 3> second;
};

/// @brief A rotation with its first and second derivatives.
[[nodiscard]] Turning turning(const Vec<3>& rotation);
} // namespace raymortar
