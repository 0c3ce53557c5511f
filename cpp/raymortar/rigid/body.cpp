#include "raymortar/rigid/body.h"
#include "raymortar/rigid/turning.h"
#include <algorithm>

namespace raymortar
{
namespace
{
/// Values along the axes of those unknowns that are rotations, or are not
Vec<3> spread(const RigidBody& body, const std::vector<double>& values,
              bool turns)
{
  Vec<3> vector = Vec<3>::Zero();
  for (std::size_t j = 0; j < body.size(); ++j)
    if (body.turns[j] == turns)
      vector[body.axis[j]] = values[j];
  return vector;
}

/// A moment of inertia about the centre, and its derivatives by theta
struct InertiaMoment
{
  Vec<3> moment = Vec<3>::Zero();
  Mat<3, 3> by_theta = Mat<3, 3>::Zero();
};

InertiaMoment inertia_moment(const SpinInertia& spin, const Vec<3>& theta)
{
  const Turning turning = raymortar::turning(spin.whole * theta);
  const Vec<3> momentum = spin.J * (spin.rate * theta + spin.start);
  InertiaMoment found;
  found.moment = spin.factor * turning.R * momentum + spin.kept;
  found.by_theta = spin.factor * spin.rate * turning.R * spin.J;
  for (std::size_t k = 0; k < 3; ++k)
    found.by_theta.col(static_cast<Eigen::Index>(k)) +=
        spin.factor * spin.whole * turning.first[k] * momentum;
  return found;
}

bool is_turning(const RigidBody& body)
{
  return std::find(body.turns.begin(), body.turns.end(), true) !=
         body.turns.end();
}
} // namespace

Vec<3> RigidBody::theta() const { return spread(*this, values, true); }

Vec<3> RigidBody::translation() const { return spread(*this, values, false); }

RigidBody::Matrix RigidBody::turn() const
{
  if (not is_turning(*this))
    return accepted_turn;
  return rotation_matrix(theta()) * accepted_turn;
}

Motion RigidBody::motion() const
{
  Motion motion;
  Eigen::Map<Vec<3>>(motion.data()) = moved + translation();
  Eigen::Map<Vec<3>>(motion.data() + 3) = turned;
  Eigen::Map<Matrix>(motion.data() + 6) = turn();
  return motion;
}

std::array<double, 12> RigidBody::loads() const
{
  std::array<double, 12> found;
  double* out = found.data();
  for (const Vec<3>* one : {&moved, &turned, &force, &moment})
    out = std::copy_n(one->data(), 3, out);
  return found;
}

Freedom RigidBody::freedom() const
{
  const std::size_t n = size();
  Freedom found;
  found.centre = centre + moved + translation();
  found.rates.resize(n);
  found.bends.assign(n * n, Mat<3, 3>::Zero());
  for (std::size_t j = 0; j < n; ++j)
    if (not turns[j])
      found.rates[j].drift[axis[j]] = 1.0;
  if (not is_turning(*this))
    return found;
  const Turning turning = raymortar::turning(theta());
  const Mat<3, 3> back = turning.R.transpose();
  const auto at = [this](std::size_t j)
  { return static_cast<std::size_t>(axis[j]); };
  for (std::size_t j = 0; j < n; ++j)
  {
    if (not turns[j])
      continue;
    found.rates[j].spin = unit(j) * turning.first[at(j)] * back;
    for (std::size_t k = 0; k < n; ++k)
      if (turns[k])
        found.bends[j * n + k] =
            unit(j) * unit(k) * turning.second[at(j)][at(k)] * back;
  }
  return found;
}

BodyForces RigidBody::forces() const
{
  const Freedom free = freedom();
  const auto n = static_cast<Eigen::Index>(size());
  // Springs and dampers: forces, and their derivatives by lengths and radians
  std::vector<double> resisting(size()), resistance(size());
  for (std::size_t j = 0; j < size(); ++j)
  {
    const double change = values[j] - (turns[j] ? 0.0 : accepted[j]);
    resistance[j] = stiffness[j] + damping[j] / dt;
    resisting[j] = stiffness[j] * total(j) + damping[j] / dt * change;
  }
  // Along the unknowns, or about the axes of space
  const bool along = not spin;
  const InertiaMoment inertia =
      spin ? inertia_moment(*spin, theta()) : InertiaMoment();
  Vec<3> turning_moment = moment - inertia.moment;
  if (spin)
    turning_moment -= spread(*this, resisting, true);
  BodyForces found{Eigen::VectorXd(n), Eigen::MatrixXd(n, n)};
  for (Eigen::Index j = 0; j < n; ++j)
  {
    const auto of = static_cast<std::size_t>(j);
    const Freedom::Rate& rate = free.rates[of];
    const bool is_own = along or not turns[of];
    found.forces[j] = rate.drift.dot(force) +
                      axial(rate.spin).dot(turning_moment) -
                      (is_own ? unit(of) * resisting[of] : 0.0);
    // The direction of a moment is fixed in space: its work depends on the
    // rotation
    for (Eigen::Index k = 0; k < n; ++k)
    {
      const auto by = static_cast<std::size_t>(k);
      const Mat<3, 3>& other = free.rates[by].spin;
      const Mat<3, 3> changed =
          free.bend(static_cast<Index>(j), static_cast<Index>(k)) +
          rate.spin * other.transpose();
      found.slope(j, k) = -axial(changed).dot(turning_moment);
      if (spin and turns[by])
      {
        Vec<3> change = inertia.by_theta.col(axis[by]);
        change[axis[by]] += resistance[by];
        found.slope(j, k) += unit(by) * axial(rate.spin).dot(change);
      }
    }
    if (is_own)
      found.slope(j, j) += unit(of) * unit(of) * resistance[of];
  }
  return found;
}

void RigidBody::accept()
{
  accepted_turn = turn();
  for (std::size_t j = 0; j < size(); ++j)
  {
    accepted[j] = total(j);
    if (turns[j])
      values[j] = 0.0;
  }
}

Pose pose_of(const Vec<3>& centre, const Motion& motion)
{
  using Rows = Eigen::Map<const RigidBody::Matrix>;
  using Part = Eigen::Map<const Vec<3>>;
  const Mat<3, 3> R =
      Rows(motion.data() + 6) * rotation_matrix(Part(motion.data() + 3));
  return {R, centre + Part(motion.data()) - R * centre};
}

Pose RigidBody::take_pose()
{
  seen = motion();
  return pose_of(centre, seen);
}

std::vector<double> RigidBody::own_forces() const
{
  const Eigen::VectorXd along = forces().forces;
  return {along.begin(), along.end()};
}
} // namespace raymortar
