// Any two polygons: the clip ends, stays within its capacity, and what it
// gives lies within both; what is left of the slave adds up with it.
#include "bytes.h"
#include "raymortar/geometry/subtract.h"
#include <algorithm>
#include <vector>

using namespace raymortar;
using namespace raymortar::test;

namespace
{
std::vector<Vec<2>> polygon(Bytes& bytes, bool raw)
{
  std::vector<Vec<2>> points(3 + bytes.byte() % 2);
  for (Vec<2>& x : points)
    x = bytes.point<2>(raw);
  return points;
}

bool ordinary(const std::vector<Vec<2>>& points)
{
  return std::all_of(points.begin(), points.end(),
                     [](const Vec<2>& x)
                     { return is_ordinary(x.x()) and is_ordinary(x.y()); });
}

bool convex(const std::vector<Vec<2>>& p)
{
  const std::size_t n = p.size();
  for (std::size_t k = 0; k < n; ++k)
    for (std::size_t w = 2; w < n; ++w)
      if (orientation(p[k], p[(k + 1) % n], p[(k + w) % n]) <= 0)
        return false;
  return true;
}

ClipPolygon as_clip(const std::vector<Vec<2>>& points)
{
  ClipPolygon polygon;
  for (const Vec<2>& x : points)
    polygon.push(x, {});
  return polygon;
}

double extent(const std::vector<Vec<2>>& a, const std::vector<Vec<2>>& b)
{
  double size = 0;
  for (const auto* points : {&a, &b})
    for (const Vec<2>& x : *points)
      size = std::max(size, x.cwiseAbs().maxCoeff());
  return size;
}
} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data,
                                      std::size_t size)
{
  Bytes bytes{data, size};
  const bool raw = bytes.byte() % 2 == 0;
  const auto slave = polygon(bytes, raw);
  const auto master = polygon(bytes, raw);
  const ClipPolygon common = clip_convex(slave, master);
  if (!ordinary(slave) or !ordinary(master) or !convex(slave) or
      !convex(master))
    return 0;
  const double scale = extent(slave, master);
  const double rounding = 1e-13 * scale * scale;
  const double whole = as_clip(slave).area();
  require(common.size == 0 or common.size >= 3);
  require(common.area() <= whole + rounding);
  require(common.area() <= as_clip(master).area() + rounding);
  const double rest = subtract_convex(as_clip(slave), common).area();
  require(std::abs(rest + common.area() - whole) <= 10 * rounding);
  return 0;
}
