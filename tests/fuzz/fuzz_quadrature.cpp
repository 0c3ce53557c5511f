// Any convex polygon: its rule has positive weights (but for rounding, on ears
// without area), points inside, and the polygon's area and centre of gravity.
#include "../cpp/rules.h"
#include "bytes.h"
#include "raymortar/geometry/clip.h"

using namespace raymortar;
using namespace raymortar::test;

namespace
{
/// Common part of two triangles on the grid of bytes: 3 to 6 vertices
ClipPolygon common_part(Bytes& bytes)
{
  std::array<std::array<Vec<2>, 3>, 2> triangles;
  for (auto& triangle : triangles)
    for (Vec<2>& x : triangle)
      x = bytes.point<2>(false);
  return clip_convex(triangles[0], triangles[1]);
}
} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data,
                                      std::size_t size)
{
  static const SegmentRules rules = segment_rules(Shape::triangle, 3);
  Bytes bytes{data, size};
  const ClipPolygon polygon = common_part(bytes);
  const std::span<const Vec<2>> corners(polygon.points.data(),
                                        static_cast<std::size_t>(polygon.size));
  std::vector<WeightedPoint> points;
  if (polygon.size == 0)
    return 0;
  append_on_polygon(rules, tiles_of(corners), corners, points);
  double area = 0;
  Vec<2> moment = Vec<2>::Zero(), exact = Vec<2>::Zero();
  for (const WeightedPoint& p : points)
  {
    require(p.weight >= -1e-15 * polygon.area());
    area += p.weight;
    moment += p.weight * p.xi;
    for (std::size_t k = 0; k < corners.size(); ++k)
      require(orientation(corners[k], corners[(k + 1) % corners.size()],
                          p.xi) >= -1e-13);
  }
  for (std::size_t k = 1; k + 1 < corners.size(); ++k)
  {
    const Vec<2> a = corners[k] - corners[0], b = corners[k + 1] - corners[0];
    exact += (a.x() * b.y() - a.y() * b.x()) / 6 *
             (corners[0] + corners[k] + corners[k + 1]);
  }
  require(std::abs(area - polygon.area()) <= 1e-12);
  require((moment - exact).norm() <= 1e-11);
  return 0;
}
