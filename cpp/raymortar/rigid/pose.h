// Where a rigid body is: how it has turned and moved since it was made.
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

  /// Where a point has got to
  [[nodiscard]] Vec<3> point(const Vec<3>& X) const
  {
    return rotation * X + shift;
  }
  /// Where a point has come from
  [[nodiscard]] Vec<3> origin(const Vec<3>& x) const
  {
    return rotation.transpose() * (x - shift);
  }

  [[nodiscard]] bool operator==(const Pose&) const = default;
};
} // namespace raymortar
