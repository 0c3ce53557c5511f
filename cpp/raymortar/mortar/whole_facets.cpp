#include "raymortar/mortar/whole_facets.h"
#include "raymortar/geometry/dispatch.h"

namespace raymortar
{
namespace
{
template <std::size_t T>
Vec<2> padded(const std::array<double, T>& point)
{
  Vec<2> xi = Vec<2>::Zero();
  for (std::size_t i = 0; i < T; ++i)
    xi[static_cast<Eigen::Index>(i)] = point[i];
  return xi;
}

/// Corners of a reference facet, counter-clockwise
template <Shape S>
std::vector<Vec<2>> reference_corners()
{
  using F = FacetType<S, 1, 1>;
  std::vector<Vec<2>> corners;
  for (const int corner : F::Ref::cycle)
    corners.push_back(
        padded(F::Node::points[static_cast<std::size_t>(corner)]));
  return corners;
}
} // namespace

Segmentation whole_facets(const Surface& slave)
{
  const auto corners =
      with_shape(slave.shape, []<Shape S>() { return reference_corners<S>(); });
  Segmentation s;
  const auto n = static_cast<std::int32_t>(corners.size());
  for (Index f = 0; f < slave.num_facets(); ++f)
  {
    s.segments.push_back({f, 0, 0, 0, f * n, n});
    for (std::int32_t v = 0; v < n; ++v)
    {
      s.vertices.push_back(corners[static_cast<std::size_t>(v)]);
      s.provenance.push_back({Provenance::Kind::slave_corner,
                              static_cast<std::int8_t>(v), std::int8_t{-1}});
      s.breaks.emplace_back();
    }
  }
  s.covered.assign(static_cast<std::size_t>(slave.num_facets()), 1.0);
  return s;
}
} // namespace raymortar
