#include "raymortar/pairing/pair_filter.h"
#include <algorithm>

namespace raymortar
{
bool PairFilter::allows(Index slave, GlobalIndex master) const
{
  const auto f = static_cast<std::size_t>(slave);
  const auto begin = neighbours.begin();
  return not std::binary_search(begin + offsets[f], begin + offsets[f + 1],
                                master);
}

double half_thickness(const Surface& slave, Index facet, const Surface& master,
                      Index hit)
{
  return 0.5 *
         std::min(slave.thickness_behind(facet), master.thickness_behind(hit));
}

void erase_neighbours(Candidates& candidates, const Surface& master,
                      const PairFilter& filter)
{
  std::size_t kept = 0;
  std::int64_t begin = 0;
  for (std::size_t f = 0; f + 1 < candidates.offsets.size(); ++f)
  {
    const std::int64_t end = candidates.offsets[f + 1];
    for (std::int64_t k = begin; k < end; ++k)
    {
      const Index m = candidates.masters[static_cast<std::size_t>(k)];
      if (filter.allows(static_cast<Index>(f),
                        master.facet_id[static_cast<std::size_t>(m)]))
        candidates.masters[kept++] = m;
    }
    begin = end;
    candidates.offsets[f + 1] = static_cast<std::int64_t>(kept);
  }
  candidates.masters.resize(kept);
}
} // namespace raymortar
