#include "raymortar/mortar/elements.h"
#include <algorithm>
#include <numeric>

namespace raymortar
{
namespace
{
/// Points [begin, end) of one slave facet, which are contiguous
void group_facet(const IntegrationPoints& points, const Hits& hits,
                 std::size_t begin, std::size_t end, ContactElements& out)
{
  std::vector<Index>& order = out.point;
  for (std::size_t q = begin; q < end; ++q)
    order.push_back(static_cast<Index>(q));
  std::stable_sort(order.begin() + static_cast<std::ptrdiff_t>(begin),
                   order.end(),
                   [&](Index a, Index b)
                   {
                     return hits.master[static_cast<std::size_t>(a)] <
                            hits.master[static_cast<std::size_t>(b)];
                   });
  for (std::size_t i = begin; i < end; ++i)
  {
    const Index m = hits.master[static_cast<std::size_t>(order[i])];
    if (i == begin or m != out.master.back())
    {
      out.slave.push_back(points.slave[begin]);
      out.master.push_back(m);
      out.offsets.push_back(out.offsets.back());
    }
    ++out.offsets.back();
  }
}
} // namespace

ContactElements group_points(const IntegrationPoints& points, const Hits& hits)
{
  ContactElements out;
  out.point.reserve(points.size());
  for (std::size_t begin = 0; begin < points.size();)
  {
    std::size_t end = begin;
    while (end < points.size() and points.slave[end] == points.slave[begin])
      ++end;
    group_facet(points, hits, begin, end, out);
    begin = end;
  }
  return out;
}
} // namespace raymortar
