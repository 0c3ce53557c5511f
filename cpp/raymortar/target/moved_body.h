// A body in place of a master's facets, as the coupled system sees it.
#pragma once

#include "raymortar/target/freedom.h"
#include <array>

namespace raymortar
{
/// @brief A body whose tool slaves meet; where it is free it has unknowns.
class MovedBody
{
public:
  MovedBody() = default;
  MovedBody(const MovedBody&) = default;
  MovedBody& operator=(const MovedBody&) = default;
  virtual ~MovedBody() = default;

  /// @brief Number of unknowns.
  [[nodiscard]] virtual std::size_t size() const = 0;

  /// @brief Their values, in units of the body: see `unit`.
  [[nodiscard]] virtual std::span<double> unknowns() = 0;
  [[nodiscard]] virtual std::span<const double> unknowns() const = 0;

  /// @brief Value of a unit of the coupled system's unknown.
  [[nodiscard]] virtual double unit(std::size_t j) const = 0;

  /// @brief Where it is; from now on contact is paired there.
  [[nodiscard]] virtual Pose take_pose() = 0;

  /// @brief Motion of its points by the unknowns of the coupled system.
  [[nodiscard]] virtual Freedom freedom() const = 0;

  /// @brief Forces along the unknowns other than contact, (size,).
  [[nodiscard]] virtual std::vector<double> own_forces() const = 0;

  /// @brief What prescribes its position and its forces.
  [[nodiscard]] virtual std::array<double, 12> loads() const = 0;
};
} // namespace raymortar
