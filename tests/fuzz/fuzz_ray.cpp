// Any ray and any facet: Newton ends, and what it calls a hit is one.
#include "bytes.h"
#include "raymortar/geometry/ray.h"

using namespace raymortar;
using namespace raymortar::test;

namespace
{
template <class F>
void cast(Bytes bytes, bool raw)
{
  const typename F::Point x = bytes.point<F::gdim>(raw);
  const typename F::Point n = bytes.point<F::gdim>(raw).normalized();
  typename F::NodeMatrix master;
  for (int a = 0; a < F::nodes; ++a)
    master.col(a) = bytes.point<F::gdim>(raw);
  const RayHit<F> hit = intersect<F>(x, n, master, flat_guess<F>(x, n, master));
  if (hit.status != RayStatus::hit)
    return;
  require(hit.eta.allFinite() and std::isfinite(hit.g));
  const double size = x.norm() + master.cwiseAbs().maxCoeff();
  if (!is_ordinary(size) or F::affine)
    return;
  // Newton ended on a step below ray_step: what is left is a share of it
  const typename F::Point off =
      x + hit.g * n - master * F::Node::values(hit.eta);
  require(off.norm() <= 1e-6 * (size + std::abs(hit.g)));
}
} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data,
                                      std::size_t size)
{
  Bytes bytes{data, size};
  const std::uint8_t kind = bytes.byte();
  const bool raw = kind % 2 == 0;
  cast<FacetType<Shape::interval, 1, 1>>(bytes, raw);
  cast<FacetType<Shape::interval, 2, 2>>(bytes, raw);
  cast<FacetType<Shape::triangle, 1, 1>>(bytes, raw);
  cast<FacetType<Shape::triangle, 2, 2>>(bytes, raw);
  cast<FacetType<Shape::quadrilateral, 1, 1>>(bytes, raw);
  cast<FacetType<Shape::quadrilateral, 2, 2>>(bytes, raw);
  return 0;
}
