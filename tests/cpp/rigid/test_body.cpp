#include "raymortar/rigid/body.h"
#include "raymortar/rigid/turning.h"
#include <cmath>
#include <gtest/gtest.h>
#include <numbers>

namespace raymortar
{
namespace
{
/// A body that is free along x, about y and about z
RigidBody top()
{
  RigidBody body;
  body.centre = {0.3, -0.2, 0.5};
  body.moved = {0.0, 0.1, 0.2};
  body.turned = {0.4, 0.0, 0.0};
  body.axis = {0, 1, 2};
  body.turns = {false, true, true};
  body.stiffness = {3.0, 0.5, 0.0};
  body.damping = {0.2, 0.0, 0.7};
  body.values = {0.05, 0.3, -0.6};
  body.accepted = {0.02, 0.1, 0.4};
  body.accepted_turn = rotation_matrix({0.1, 0.2, 0.3});
  body.lever = 2.0;
  body.dt = 0.25;
  body.force = {1.5, 0.0, 0.0};
  body.moment = {0.0, -0.4, 0.9};
  return body;
}

/// A body that turns about all axes in a time step
RigidBody spinning_top()
{
  RigidBody body;
  body.axis = {2, 0, 1, 2};
  body.turns = {false, true, true, true};
  body.stiffness = {3.0, 0.5, 0.0, 0.2};
  body.damping = {0.2, 0.0, 0.7, 0.0};
  body.values = {0.05, 0.3, -0.6, 0.4};
  body.accepted = {0.02, 0.1, 0.4, -0.3};
  body.lever = 2.0;
  body.dt = 0.25;
  body.moment = {0.3, -0.4, 0.9};
  SpinInertia spin;
  spin.J << 3.0, 0.2, -0.1, 0.2, 2.0, 0.3, -0.1, 0.3, 1.5;
  spin.whole = 2.0;
  spin.factor = 4.0;
  spin.rate = 8.0;
  spin.start = {0.7, -1.0, 2.0};
  spin.kept = {-3.0, 1.0, 2.0};
  body.spin = spin;
  return body;
}

/// The same body with one unknown of the coupled system changed
RigidBody changed(RigidBody body, std::size_t j, double step)
{
  body.values[j] += step * body.unit(j);
  return body;
}

/// Where a point of the body is
Vec<3> place(const RigidBody& body)
{
  return pose_of(body.centre, body.motion()).point({0.7, 0.4, -0.3});
}

constexpr double step = 1e-5;

TEST(Turning, DerivativesAreThoseOfTheRotation)
{
  for (const double size : {1e-3, 0.5, 1.5, 3.0})
  {
    const Vec<3> v = size * Vec<3>(0.6, -0.48, 0.64);
    const Turning at = turning(v);
    EXPECT_NEAR((at.R - rotation_matrix(v)).norm(), 0.0, 1e-14);
    for (std::size_t i = 0; i < 3; ++i)
    {
      const Vec<3> way = step * Vec<3>::Unit(static_cast<Eigen::Index>(i));
      const Turning up = turning(v + way), down = turning(v - way);
      EXPECT_NEAR((at.first[i] - (up.R - down.R) / (2.0 * step)).norm(), 0.0,
                  1e-9);
      for (std::size_t j = 0; j < 3; ++j)
        EXPECT_NEAR(
            (at.second[i][j] - (up.first[j] - down.first[j]) / (2.0 * step))
                .norm(),
            0.0, 1e-9);
    }
  }
}

TEST(Turning, HalfATurnGoesBack)
{
  const Mat<3, 3> R = rotation_matrix({0.0, 0.0, std::numbers::pi});
  EXPECT_NEAR((R * Vec<3>(1.0, 2.0, 3.0) - Vec<3>(-1.0, -2.0, 3.0)).norm(), 0.0,
              1e-15);
}

TEST(RigidBody, RatesAreThoseOfItsPoints)
{
  const RigidBody body = top();
  const Freedom free = body.freedom();
  for (std::size_t j = 0; j < body.size(); ++j)
  {
    const Vec<3> change =
        (place(changed(top(), j, step)) - place(changed(top(), j, -step)));
    const Vec<3> rate = velocity<3>(free, static_cast<Index>(j), place(body));
    EXPECT_NEAR((change / (2.0 * step) - rate).norm(), 0.0, 1e-9);
  }
}

TEST(RigidBody, SlopesAreThoseOfItsForces)
{
  const BodyForces at = top().forces();
  for (std::size_t j = 0; j < 3; ++j)
  {
    const Eigen::VectorXd change = changed(top(), j, step).forces().forces -
                                   changed(top(), j, -step).forces().forces;
    EXPECT_NEAR(
        (change / (2.0 * step) + at.slope.col(static_cast<Eigen::Index>(j)))
            .norm(),
        0.0, 1e-8);
  }
}

TEST(RigidBody, SlopesAreThoseOfInertia)
{
  const BodyForces at = spinning_top().forces();
  for (std::size_t j = 0; j < 4; ++j)
  {
    // The error of central differences falls with the square of the step
    double errors[2];
    for (int i = 0; i < 2; ++i)
    {
      const double h = i == 0 ? 2e-3 : 1e-3;
      const Eigen::VectorXd change =
          changed(spinning_top(), j, h).forces().forces -
          changed(spinning_top(), j, -h).forces().forces;
      errors[i] =
          (change / (2.0 * h) + at.slope.col(static_cast<Eigen::Index>(j)))
              .norm();
    }
    if (j == 0) // linear
      EXPECT_NEAR(errors[1], 0.0, 1e-9);
    else
      EXPECT_NEAR(std::log2(errors[0] / errors[1]), 2.0, 0.05);
  }
}

TEST(RigidBody, InertiaTurnsWithTheBody)
{
  RigidBody body = spinning_top();
  body.values[0] = body.accepted[0] = 0.0;
  const SpinInertia& spin = *body.spin;
  const Vec<3> theta = body.theta();
  const Vec<3> inertia = spin.factor * rotation_matrix(2.0 * theta) * spin.J *
                             (spin.rate * theta + spin.start) +
                         spin.kept;
  // A moment that balances inertia, springs and dampers leaves no force
  body.moment = inertia + Vec<3>(0.5 * (0.1 + 0.3), 0.0, 0.2 * (-0.3 + 0.4));
  body.moment[1] += 0.7 / body.dt * theta[1];
  EXPECT_NEAR(body.forces().forces.norm(), 0.0, 1e-12);
}

TEST(RigidBody, AcceptingMovesNothing)
{
  RigidBody body = top();
  const Vec<3> before = place(body);
  body.accept();
  EXPECT_NEAR((place(body) - before).norm(), 0.0, 1e-15);
  EXPECT_EQ(body.values, (std::vector<double>{0.05, 0.0, 0.0}));
  EXPECT_DOUBLE_EQ(body.accepted[2], -0.2);
}

TEST(RigidBody, LoadsDoNotDependOnUnknowns)
{
  EXPECT_EQ(top().loads(), changed(top(), 1, 0.5).loads());
  RigidBody body = top();
  body.force[0] = 2.0;
  EXPECT_NE(body.loads(), top().loads());
}
} // namespace
} // namespace raymortar
