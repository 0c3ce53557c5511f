#include "raymortar/rigid/turning.h"
#include "raymortar/geometry/frame.h"
#include <cmath>

namespace raymortar
{
namespace
{
/// A function of s = t^2, where t is the angle, with two derivatives
using Series = std::array<double, 3>;

/// Square of the angle up to which series are used, and their number of terms
constexpr double small = 1.0;
constexpr int terms = 12;

/// Sum over k of (-1)^k s^k / (2 k + first)!
Series power_series(double s, int first)
{
  Series f{};
  double factor = 1.0; // (-1)^k / (2 k + first)!
  for (int i = 2; i <= first; ++i)
    factor /= i;
  for (int k = 0; k < terms; ++k)
  {
    f[0] += factor * std::pow(s, k);
    if (k > 0)
      f[1] += factor * k * std::pow(s, k - 1);
    if (k > 1)
      f[2] += factor * k * (k - 1) * std::pow(s, k - 2);
    factor /= -(2.0 * k + first + 1.0) * (2.0 * k + first + 2.0);
  }
  return f;
}

/// sin t / t
Series sine_over_angle(double s)
{
  if (s < small)
    return power_series(s, 1);
  const double t = std::sqrt(s), sine = std::sin(t), cosine = std::cos(t);
  return {sine / t, (t * cosine - sine) / (2.0 * std::pow(t, 3)),
          (3.0 * sine - 3.0 * t * cosine - s * sine) / (4.0 * std::pow(t, 5))};
}

/// (1 - cos t) / t^2
Series versine_over_square(double s)
{
  if (s < small)
    return power_series(s, 2);
  const double t = std::sqrt(s), sine = std::sin(t), cosine = std::cos(t);
  return {(1.0 - cosine) / s, (t * sine - 2.0 * (1.0 - cosine)) / (2.0 * s * s),
          (8.0 * (1.0 - cosine) - 5.0 * t * sine + s * cosine) /
              (4.0 * s * s * s)};
}
} // namespace

Vec<3> axial(const Mat<3, 3>& m)
{
  return 0.5 * Vec<3>(m(2, 1) - m(1, 2), m(0, 2) - m(2, 0), m(1, 0) - m(0, 1));
}

Mat<3, 3> rotation_matrix(const Vec<3>& rotation)
{
  const double angle = rotation.norm();
  if (angle == 0.0)
    return Mat<3, 3>::Identity();
  const Mat<3, 3> cross = cross_matrix(rotation / angle);
  return Mat<3, 3>::Identity() + std::sin(angle) * cross +
         (1.0 - std::cos(angle)) * cross * cross;
}

Turning turning(const Vec<3>& v)
{
  const double s = v.squaredNorm();
  const Series a = sine_over_angle(s), b = versine_over_square(s);
  const Mat<3, 3> K = cross_matrix(v), square = K * K;
  std::array<Mat<3, 3>, 3> E, of_square;
  for (int i = 0; i < 3; ++i)
  {
    E[i] = cross_matrix(Vec<3>::Unit(i));
    of_square[i] = E[i] * K + K * E[i];
  }
  Turning found;
  found.R = Mat<3, 3>::Identity() + a[0] * K + b[0] * square;
  for (int i = 0; i < 3; ++i)
  {
    const double a_i = 2.0 * a[1] * v[i], b_i = 2.0 * b[1] * v[i];
    found.first[i] = a_i * K + a[0] * E[i] + b_i * square + b[0] * of_square[i];
    for (int j = 0; j < 3; ++j)
    {
      const double a_j = 2.0 * a[1] * v[j], b_j = 2.0 * b[1] * v[j];
      const double one = i == j ? 2.0 : 0.0;
      const double a_ij = 4.0 * a[2] * v[i] * v[j] + one * a[1];
      const double b_ij = 4.0 * b[2] * v[i] * v[j] + one * b[1];
      found.second[i][j] = a_ij * K + b_ij * square + a_i * E[j] + a_j * E[i] +
                           b_i * of_square[j] + b_j * of_square[i] +
                           b[0] * (E[i] * E[j] + E[j] * E[i]);
    }
  }
  return found;
}
} // namespace raymortar
