#include "raymortar/fem/parts.h"
#include <algorithm>
#include <cmath>
#include <numeric>

namespace raymortar
{
namespace
{
/// Axis on which the centres of some boxes differ most
template <int D>
int longest_axis(const std::vector<Box<D>>& boxes, std::span<const Index> some)
{
  Box<D> centres;
  for (const Index f : some)
  {
    const auto& box = boxes[f];
    const Vec<D> centre = 0.5 * (box.lower + box.upper);
    centres.merge({centre, centre});
  }
  int axis = 0;
  (centres.upper - centres.lower).maxCoeff(&axis);
  return axis;
}

template <int D>
void cut(const std::vector<Box<D>>& boxes, std::span<Index> some, Index most,
         Index least, Index& parts, std::vector<Index>& part)
{
  if (most < 2 or static_cast<Index>(some.size()) < least)
  {
    for (const Index f : some)
      part[f] = parts;
    ++parts;
    return;
  }
  const int axis = longest_axis<D>(boxes, some);
  const auto half = some.size() / 2;
  const auto centre = [&](Index f)
  {
    const auto& box = boxes[f];
    const double c = box.lower[axis] + box.upper[axis];
    return std::isnan(c) ? 0.0 : c; // an order must be one
  };
  // Ties by number, so that the cut is the same everywhere
  std::nth_element(some.begin(),
                   some.begin() + static_cast<std::ptrdiff_t>(half), some.end(),
                   [&](Index a, Index b) {
                     return std::pair{centre(a), a} < std::pair{centre(b), b};
                   });
  cut<D>(boxes, some.first(half), most / 2, least, parts, part);
  cut<D>(boxes, some.subspan(half), most / 2, least, parts, part);
}
} // namespace

template <int D>
std::vector<Index> parts_of(const std::vector<Box<D>>& boxes, Index most,
                            Index least)
{
  std::vector<Index> part(boxes.size()), all(boxes.size());
  std::iota(all.begin(), all.end(), Index{0});
  Index parts = 0;
  if (not boxes.empty())
    cut<D>(boxes, all, most, least, parts, part);
  return part;
}

template <int D>
std::vector<Box<D>> part_boxes(const std::vector<Box<D>>& boxes,
                               const std::vector<Index>& part)
{
  std::vector<Box<D>> hulls;
  for (std::size_t f = 0; f < boxes.size(); ++f)
  {
    const std::size_t p = part[f];
    if (hulls.size() <= p)
      hulls.resize(p + 1);
    hulls[p].merge(boxes[f]);
  }
  return hulls;
}

template std::vector<Index> parts_of<2>(const std::vector<Box<2>>&, Index,
                                        Index);
template std::vector<Index> parts_of<3>(const std::vector<Box<3>>&, Index,
                                        Index);
template std::vector<Box<2>> part_boxes<2>(const std::vector<Box<2>>&,
                                           const std::vector<Index>&);
template std::vector<Box<3>> part_boxes<3>(const std::vector<Box<3>>&,
                                           const std::vector<Index>&);
} // namespace raymortar
