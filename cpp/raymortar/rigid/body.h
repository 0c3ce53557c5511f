// A rigid body: where it is, how it moves where it is free, the forces on it.
#pragma once

#include "raymortar/target/moved_body.h"
#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

namespace raymortar
{
/// Everything that determines a body's position: its translation, the
/// prescribed rotation vector, and the free rotation matrix by rows
using Motion = std::array<double, 15>;

/// @brief Forces along the unknowns of a body other than contact, and minus
/// their derivative, (n,) and (n, n).
struct BodyForces
{
  Eigen::VectorXd forces;
  Eigen::MatrixXd slope;
};

/// @brief Inertia of a rotation about all axes in a time step, as the moment
/// factor exp(whole theta) J (rate theta + start) + kept  [theory (6.16)].
///
/// The step turns a body by `whole` theta, with the unknown theta. Springs and
/// dampers of its rotations are moments about the axes of space.
struct SpinInertia
{
  Mat<3, 3> J = Mat<3, 3>::Zero(); ///< inertia tensor at the accepted step
  double whole = 1.0;
  double factor = 0.0, rate = 0.0; ///< per time
  Vec<3> start = Vec<3>::Zero();   ///< radians per time
  Vec<3> kept = Vec<3>::Zero();    ///< moment
};

/// @brief A body that prescribed motions or forces move.
///
/// Unknowns are translations since the body was made, and the components of a
/// rotation vector theta since the last accepted step: the body has turned by
/// exp(theta) Q P, with the free rotation Q of all accepted steps and the
/// prescribed rotation P. In the coupled system a rotation is a length, theta
/// times `lever`, and its equation is a force.
struct RigidBody final : MovedBody
{
  using Matrix = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

  Vec<3> centre = Vec<3>::Zero(); ///< before any motion. Length
  Vec<3> moved = Vec<3>::Zero();  ///< prescribed translation. Length
  Vec<3> turned = Vec<3>::Zero(); ///< prescribed rotation vector. Radians
  Vec<3> force = Vec<3>::Zero();
  Vec<3> moment = Vec<3>::Zero();            ///< about the centre
  std::vector<int> axis;                     ///< of each unknown
  std::vector<bool> turns;                   ///< whether it is a rotation
  std::vector<double> stiffness, damping;    ///< of each unknown
  std::vector<double> values, accepted;      ///< lengths and radians; the sums
                                             ///< of all accepted rotations
  Matrix accepted_turn = Matrix::Identity(); ///< Q
  double lever = 1.0;                        ///< length of a radian
  double dt = 1.0;                           ///< time of the step, for dampers
  std::optional<SpinInertia> spin; ///< where all three rotations are free
  Motion seen{};                   ///< at the last pairing

  [[nodiscard]] std::size_t size() const override { return axis.size(); }
  [[nodiscard]] std::span<double> unknowns() override { return values; }
  [[nodiscard]] std::span<const double> unknowns() const override
  {
    return values;
  }

  /// Lengths or radians of a unit of the coupled system's unknown
  [[nodiscard]] double unit(std::size_t j) const override
  {
    return turns[j] ? 1.0 / lever : 1.0;
  }

  /// Translation, or sum of rotations over all steps
  [[nodiscard]] double total(std::size_t j) const
  {
    return (turns[j] ? accepted[j] : 0.0) + values[j];
  }

  /// Rotation vector since the accepted step
  [[nodiscard]] Vec<3> theta() const;
  /// Free translation since the body was made
  [[nodiscard]] Vec<3> translation() const;
  /// Free rotation exp(theta) Q
  [[nodiscard]] Matrix turn() const;
  [[nodiscard]] Motion motion() const;
  [[nodiscard]] Pose take_pose() override;
  /// Prescribed position and forces: `moved`, `turned`, force, moment
  [[nodiscard]] std::array<double, 12> loads() const override;
  /// Motion of its points by the unknowns of the coupled system
  [[nodiscard]] Freedom freedom() const override;
  [[nodiscard]] BodyForces forces() const;
  [[nodiscard]] std::vector<double> own_forces() const override;
  /// Take the present position as that of the accepted step
  void accept();
};

/// @brief Where a motion takes a body.
[[nodiscard]] Pose pose_of(const Vec<3>& centre, const Motion& motion);
} // namespace raymortar
