// Pose of a rigid body: its rotation and displacement since it was made.
#pragma once

#include "raymortar/core/types.h"

namespace raymortar
{
/// @brief Motion x = rotation X + shift of a rigid body. In 2D the third
/// component is 0.
struct Pose
{
  Mat<3, 3> rotation = Mat<3, 3>::Identity();
  Vec<3> shift = Vec<3>::Zero(); ///< length

  /// Present place of a point
  [[nodiscard]] Vec<3> point(const Vec<3>& X) const
  {
    return rotation * X + shift;
  }
  /// Original place of a point
  [[nodiscard]] Vec<3> origin(const Vec<3>& x) const
  {
    return rotation.transpose() * (x - shift);
  }

  [[nodiscard]] bool operator==(const Pose&) const = default;
};
} // namespace raymortar
