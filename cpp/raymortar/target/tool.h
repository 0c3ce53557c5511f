// Tools: what slave surfaces meet in place of facets.
#pragma once

#include "raymortar/target/pose.h"
#include <memory>
#include <span>
#include <vector>

namespace raymortar
{
class ToolCutter;

/// @brief Ray x + g n of a slave point. In 2D third components are 0.
struct ToolRay
{
  Vec<3> x; ///< length
  Vec<3> n; ///< unit
};

/// @brief Where a ray enters a tool.
struct ToolHit
{
  bool found = false;
  double g = 0.0; ///< along the ray, negative where the point is inside; length
  Vec<3> normal = Vec<3>::Zero(); ///< unit, out of the tool
  /// Derivative of the normal along the surface, one over length: positive on
  /// tangents where the tool is convex
  Mat<3, 3> bend = Mat<3, 3>::Zero();
  bool flat = false; ///< without end
};

/// @brief Surface of a rigid body, in the coordinates it was made in.
///
/// A ray from outside meets the first place where it enters the tool. A point
/// inside meets the last place behind it where its ray has entered.
class Tool
{
public:
  Tool() = default;
  Tool(const Tool&) = delete;
  Tool& operator=(const Tool&) = delete;
  virtual ~Tool() = default;

  /// @param[out] hits One per ray
  virtual void cast(std::span<const ToolRay> rays,
                    std::span<ToolHit> hits) const = 0;

  /// @brief Distance of a point, negative inside. Length
  [[nodiscard]] virtual double distance(const Vec<3>& x) const = 0;

  /// @brief What cuts slave facets where tools of this kind end; null: nothing
  /// does.
  [[nodiscard]] virtual const ToolCutter* cutter() const { return nullptr; }
};

/// @brief A tool where it is, and where it was at the accepted step.
struct PlacedTool
{
  std::shared_ptr<const Tool> tool;
  Pose now, old;

  /// Place of a point of the present tool at the accepted step
  [[nodiscard]] Vec<3> old_place(const Vec<3>& x) const
  {
    return old.point(now.origin(x));
  }
  /// The turn from the accepted step to the present
  [[nodiscard]] Mat<3, 3> turn_back() const
  {
    return old.rotation * now.rotation.transpose();
  }
};
} // namespace raymortar
