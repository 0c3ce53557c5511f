#include "checks.h"
#include "exact.h"
#include "raymortar/geometry/clip.h"
#include <chrono>

namespace raymortar::test
{
namespace
{
constexpr double epsilon = std::numeric_limits<double>::epsilon();

/// A pair and its clip in exact numbers
struct ExactPair
{
  int unit;
  std::vector<ExactLine<Big>> slave, master;
  std::vector<ExactVector<Big>> vertices;

  ExactPair(const PlanePair& pair, std::span<const Vec<2>> points)
      : unit(common_unit<2>(
            points, common_unit<2>(pair.slave, common_unit<2>(pair.master)))),
        slave(edge_lines(exact(pair.slave))),
        master(edge_lines(exact(pair.master))), vertices(exact(points))
  {
  }

  [[nodiscard]] std::vector<ExactVector<Big>>
  exact(std::span<const Vec<2>> points) const
  {
    std::vector<ExactVector<Big>> result;
    for (const Vec<2>& x : points)
      result.push_back(in_units(x, unit));
    return result;
  }

  [[nodiscard]] double length(const Big& units, int power = 1) const
  {
    return static_cast<double>(
        std::ldexp(static_cast<long double>(units), power * unit));
  }

  [[nodiscard]] double common_area() const
  {
    std::vector<ExactLine<Big>> lines = slave;
    lines.insert(lines.end(), master.begin(), master.end());
    return std::ldexp(exact_area(lines), 2 * unit);
  }

  /// Twice the area between an edge and a point, left > 0
  [[nodiscard]] double turn(const ExactLine<Big>& line,
                            const ExactVector<Big>& x) const
  {
    return length(cross(line.along, x - line.point), 2);
  }

  [[nodiscard]] double distance(const ExactLine<Big>& line,
                                const ExactVector<Big>& x) const
  {
    return std::abs(turn(line, x)) /
           std::hypot(length(line.along.x), length(line.along.y));
  }
};

/// Distance of a vertex from the corner or the two lines it is made of
double off_its_origin(const ExactPair& pair, const Provenance& from,
                      const ExactVector<Big>& x)
{
  const auto slave = static_cast<std::size_t>(from.slave);
  const auto master = static_cast<std::size_t>(from.master);
  const auto off_corner = [&](const ExactVector<Big>& corner)
  {
    return std::hypot(pair.length(x.x - corner.x), pair.length(x.y - corner.y));
  };
  if (from.kind == Provenance::Kind::slave_corner)
    return off_corner(pair.slave[slave].point);
  if (from.kind == Provenance::Kind::master_corner)
    return off_corner(pair.master[master].point);
  return std::max(pair.distance(pair.slave[slave], x),
                  pair.distance(pair.master[master], x));
}

/// Distinct vertices, and convex if each may move by `rounding`
bool is_valid(const ExactPair& pair, std::span<const Vec<2>> points,
              double merge, double rounding)
{
  const double size = diameter({points.begin(), points.end()});
  const auto edges = edge_lines(pair.vertices);
  for (std::size_t v = 0; v < points.size(); ++v)
    for (std::size_t w = 0; w < points.size(); ++w)
    {
      const bool distinct =
          v == w or (points[v] - points[w]).squaredNorm() > merge * merge;
      const bool left =
          pair.turn(edges[v], pair.vertices[w]) >= -4 * rounding * size;
      if (!distinct or !left)
        return false;
    }
  return points.empty() or points.size() >= 3;
}

double largest_coordinate(const PlanePair& pair)
{
  double largest = 0;
  for (const Facet* facet : {&pair.slave, &pair.master})
    for (const Vec<2>& x : *facet)
      largest = std::max(largest, x.cwiseAbs().maxCoeff());
  return largest;
}

Errors check_clip(const PlanePair& pair, const ClipPolygon& polygon)
{
  const std::span<const Vec<2>> points(polygon.points.data(),
                                       static_cast<std::size_t>(polygon.size));
  const bool finite =
      std::all_of(points.begin(), points.end(),
                  [](const Vec<2>& x) { return x.allFinite(); });
  if (!finite)
    return {.tried = 1, .failures = 1};
  const ExactPair exact(pair, points);
  const double merge = tolerance::merge * diameter(pair.slave);
  const double rounding = epsilon * largest_coordinate(pair) + merge;
  const double smaller =
      std::min(facet_area(pair.slave), facet_area(pair.master));
  const double size = std::min(diameter(pair.slave), diameter(pair.master));
  Errors errors{.tried = 1};
  const double error = std::abs(polygon.area() - exact.common_area());
  errors.area = error / smaller;
  errors.roundings = error / (rounding * size);
  for (std::size_t v = 0; v < points.size(); ++v)
    errors.point =
        std::max(errors.point, off_its_origin(exact, polygon.provenance[v],
                                              exact.vertices[v]) /
                                   rounding);
  const bool good = errors.roundings <= allowed_roundings and
                    errors.point <= allowed_roundings and
                    is_valid(exact, points, merge, rounding);
  errors.failures = good ? 0 : 1;
  return errors;
}
} // namespace

void Errors::add(const Errors& other)
{
  tried += other.tried;
  failures += other.failures;
  area = std::max(area, other.area);
  roundings = std::max(roundings, other.roundings);
  point = std::max(point, other.point);
  seconds += other.seconds;
}

double timed(const std::function<void()>& call)
{
  const auto begin = std::chrono::steady_clock::now();
  call();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin)
      .count();
}

Errors check_clips(const std::vector<PlanePair>& pairs)
{
  std::vector<ClipPolygon> polygons(pairs.size());
  Errors errors;
  errors.seconds = timed(
      [&]
      {
        for (std::size_t k = 0; k < pairs.size(); ++k)
          polygons[k] = clip_convex(pairs[k].slave, pairs[k].master);
      });
  for (std::size_t k = 0; k < pairs.size(); ++k)
    errors.add(check_clip(pairs[k], polygons[k]));
  return errors;
}
} // namespace raymortar::test
