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
  BodyForces found{Eigen::VectorXd(n), Eigen::MatrixXd(n, n)};
  for (Eigen::Index j = 0; j < n; ++j)
  {
    const auto of = static_cast<std::size_t>(j);
    const Freedom::Rate& rate = free.rates[of];
    const double change = values[of] - (turns[of] ? 0.0 : accepted[of]);
    const double spring = stiffness[of], damper = damping[of] / dt;
    found.forces[j] = rate.drift.dot(force) + axial(rate.spin).dot(moment) -
                      unit(of) * (spring * total(of) + damper * change);
    // The direction of a moment is fixed in space: its work depends on the
    // rotation
    for (Eigen::Index k = 0; k < n; ++k)
    {
      const Mat<3, 3>& other = free.rates[static_cast<std::size_t>(k)].spin;
      const Mat<3, 3> changed =
          free.bend(static_cast<Index>(j), static_cast<Index>(k)) +
          rate.spin * other.transpose();
      found.slope(j, k) = -axial(changed).dot(moment);
    }
    found.slope(j, j) += unit(of) * unit(of) * (spring + damper);
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
} // namespace raymortar
