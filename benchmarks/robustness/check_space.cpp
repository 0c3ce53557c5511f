#include "checks.h"
#include "exact.h"
#include "raymortar/geometry/ray.h"
#include "raymortar/mortar/overlap.h"

namespace raymortar::test
{
namespace
{
using Triangle = FacetType<Shape::triangle, 1, 1>;
using Corners = std::array<Vec<3>, 4>;

constexpr double epsilon = std::numeric_limits<double>::epsilon();

/// Slave and master that face each other, in any direction of space
struct SpacePair
{
  Corners slave, master;

  explicit SpacePair(std::mt19937& random)
  {
    const Vec<3> up = direction(random, Vec<3>::Zero());
    place(slave, random_triangle(random), up, Vec<3>::Zero());
    const Vec<3> down = direction(random, -up);
    place(master, random_triangle(random), down, uniform(random, -1, 1) * up);
  }

  static Facet random_triangle(std::mt19937& random)
  {
    Facet facet;
    do
      facet = random_facet(random, 0.05);
    while (facet.size() != 3 or !is_convex(facet));
    return facet;
  }

  /// Unit vector, within 60 degrees of the axis if there is one
  static Vec<3> direction(std::mt19937& random, const Vec<3>& axis)
  {
    Vec<3> n;
    do
    {
      for (int i = 0; i < 3; ++i)
        n[i] = uniform(random, -1, 1);
      n.normalize();
    } while (n.dot(axis) < 0.5 * axis.norm());
    return n;
  }

  static void place(Corners& corners, const Facet& facet, const Vec<3>& n,
                    const Vec<3>& at)
  {
    const Vec<3> t = n.unitOrthogonal(), s = n.cross(t);
    for (std::size_t k = 0; k < 3; ++k)
      corners[k] = at + facet[k].x() * t + facet[k].y() * s;
  }

  [[nodiscard]] std::span<const Vec<3>> triangle(const Corners& corners) const
  {
    return {corners.data(), 3};
  }

  [[nodiscard]] int unit(int at_most = 0) const
  {
    return common_unit<3>(triangle(slave),
                          common_unit<3>(triangle(master), at_most));
  }
};

/// Size by height: how much a triangle magnifies rounding errors
double slenderness(const Corners& c)
{
  const double size = std::max(
      {(c[1] - c[0]).norm(), (c[2] - c[0]).norm(), (c[2] - c[1]).norm()});
  return size * size / (c[1] - c[0]).cross(c[2] - c[0]).norm();
}

/// Share of the slave under the projected master, in half units: corners in
/// the slave's reference coordinates, times the determinant of its metric
double exact_overlap(const SpacePair& pair)
{
  const int unit = pair.unit();
  std::array<Exact3, 3> s, m;
  for (std::size_t k = 0; k < 3; ++k)
  {
    s[k] = in_units(pair.slave[k], unit);
    m[k] = in_units(pair.master[k], unit);
  }
  const Exact3 t1 = s[1] - s[0], t2 = s[2] - s[0];
  const Big g11 = dot(t1, t1), g12 = dot(t1, t2), g22 = dot(t2, t2);
  const Big det = g11 * g22 - g12 * g12;
  std::vector<ExactVector<Big>> master;
  for (const std::size_t k : {2, 1, 0})
  {
    const Exact3 x = m[k] - s[0];
    const Big a = dot(t1, x), b = dot(t2, x);
    master.push_back({g22 * a - g12 * b, g11 * b - g12 * a});
  }
  const Big zero = 0;
  auto lines = edge_lines<Big>({{zero, zero}, {det, zero}, {zero, det}});
  for (const auto& line : edge_lines(master))
    lines.push_back(line);
  Big twice = 0;
  constexpr unsigned fraction = 128;
  for (const auto& [top, bottom] : area_shares(lines))
    twice += (top << fraction) / bottom;
  return 0.5 * quotient(twice, (det * det) << fraction);
}

double library_overlap(const SpacePair& pair)
{
  const auto plane = patch_plane<3>(pair.slave, 3);
  std::array<Vec<2>, 4> corners;
  for (std::size_t k = 0; k < 3; ++k)
    corners[k] = plane.coordinates(pair.slave[k]);
  const auto seen = project_patch<3>(plane, pair.master, 3);
  return overlap(corners, 3, seen).area();
}

struct Shot
{
  Vec<3> x;
  Vec<3> n;
  Triangle::NodeMatrix master;
};

/// r + gap n = xi a + eta b, by Cramer's rule
struct ExactHit
{
  double xi, eta, gap;
};

ExactHit exact_hit(const Shot& shot)
{
  const std::array<Vec<3>, 5> doubles{shot.x, shot.n, shot.master.col(0),
                                      shot.master.col(1), shot.master.col(2)};
  const int unit = common_unit<3>(doubles);
  std::array<Exact3, 5> exact;
  for (std::size_t k = 0; k < 5; ++k)
    exact[k] = in_units(doubles[k], unit);
  const auto& [x, n, m0, m1, m2] = exact;
  const Exact3 a = m1 - m0, b = m2 - m0, r = x - m0;
  const Exact3 normal = cross(a, b);
  const Big det = dot(normal, n);
  const Exact3 nr = cross(n, r);
  return {quotient(dot(b, nr), det), -quotient(dot(a, nr), det),
          -quotient(dot(normal, r), det)};
}

/// Rays that meet the plane of the master far off are given up
Errors check_ray(const Shot& shot, const RayHit<Triangle>& hit,
                 const SpacePair& pair)
{
  constexpr double far = 8;
  const ExactHit exact = exact_hit(shot);
  Errors errors{.tried = 1};
  if (std::max(std::abs(exact.xi), std::abs(exact.eta)) > 0.999 * far)
  {
    errors.failures = hit.status == RayStatus::hit and hit.outside.amount <= 1;
    return errors;
  }
  const double worst =
      std::max({std::abs(hit.eta[0] - exact.xi),
                std::abs(hit.eta[1] - exact.eta), std::abs(hit.g - exact.gap)});
  const double extent =
      1 + std::abs(exact.xi) + std::abs(exact.eta) + std::abs(exact.gap);
  const double slender = slenderness(pair.master);
  errors.point = worst / (epsilon * slender * slender * extent);
  const bool good =
      hit.status == RayStatus::hit and errors.point <= allowed_roundings;
  errors.failures = good ? 0 : 1;
  return errors;
}
} // namespace

Errors check_projections(std::mt19937& random, int count)
{
  std::vector<SpacePair> pairs;
  for (int k = 0; k < count; ++k)
    pairs.emplace_back(random);
  std::vector<double> areas;
  Errors errors;
  errors.seconds = timed(
      [&]
      {
        for (const SpacePair& pair : pairs)
          areas.push_back(library_overlap(pair));
      });
  for (std::size_t k = 0; k < pairs.size(); ++k)
  {
    Errors one{.tried = 1};
    const double error = std::abs(areas[k] - exact_overlap(pairs[k]));
    const double slender = slenderness(pairs[k].slave);
    one.area = 2 * error;
    one.roundings = error / (epsilon * slender * slender);
    one.failures = one.roundings <= allowed_roundings ? 0 : 1;
    errors.add(one);
  }
  return errors;
}

Errors check_rays(std::mt19937& random, int count)
{
  Errors errors;
  for (int k = 0; k < count; ++k)
  {
    const SpacePair pair(random);
    const auto plane = patch_plane<3>(pair.slave, 3);
    const double s = uniform(random, 0, 0.5), t = uniform(random, 0, 0.5);
    Shot shot{(1 - s - t) * pair.slave[0] + s * pair.slave[1] +
                  t * pair.slave[2],
              plane.n,
              {}};
    for (int i = 0; i < 3; ++i)
      shot.master.col(i) = pair.master[static_cast<std::size_t>(i)];
    RayHit<Triangle> hit;
    const double seconds = timed(
        [&]
        {
          hit = intersect<Triangle>(
              shot.x, shot.n, shot.master,
              flat_guess<Triangle>(shot.x, shot.n, shot.master));
        });
    errors.add(check_ray(shot, hit, pair));
    errors.seconds += seconds;
  }
  return errors;
}
} // namespace raymortar::test
