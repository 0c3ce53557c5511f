#include "raymortar/fem/nearest_hits.h"

namespace raymortar
{
NearestHits nearest_hits(const ContactState& s, const Assembler& assembler)
{
  constexpr auto none = static_cast<std::size_t>(-1);
  const std::size_t count = s.slave.num_facets();
  const auto status = assembler.results(s).status;
  std::vector<std::size_t> nearest(count, none);
  std::vector<std::int8_t> closed(count, 0);
  for (std::size_t q = 0; q < s.points.size(); ++q)
  {
    if (s.hits.status[q] != RayStatus::hit)
      continue;
    const std::size_t f = s.points.slave[q];
    if (nearest[f] == none or s.hits.gap[q] < s.hits.gap[nearest[f]])
      nearest[f] = q;
    if (status[q] == ContactStatus::stick or status[q] == ContactStatus::slip)
      closed[f] = 1;
  }
  NearestHits found;
  if (s.has_tools())
    return found;
  for (std::size_t f = 0; f < count; ++f)
  {
    const std::size_t q = nearest[f];
    if (q == none)
      continue;
    found.facet.push_back(static_cast<Index>(f));
    found.xi.push_back(s.points.xi[q]);
    found.eta.push_back(s.hits.eta[q]);
    found.master.push_back(s.master.facet_id[s.hits.master[q]]);
    found.gap.push_back(s.hits.gap[q]);
    found.closed.push_back(closed[f]);
  }
  return found;
}
} // namespace raymortar
