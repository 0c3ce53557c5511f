#include "raymortar/fem/remote_entries.h"
#include "raymortar/core/sorted.h"
#include "raymortar/element/free_tools.h"
#include "raymortar/fem/rows.h"
#include <algorithm>

namespace raymortar
{
RemoteEntries remote_entries(const Zone& zone,
                             std::span<const std::int64_t> ranges, int rank)
{
  const auto owner_of = [&](std::int64_t row)
  {
    return static_cast<int>(
        std::upper_bound(ranges.begin(), ranges.end(), row) - ranges.begin() -
        1);
  };
  const ContactState& s = zone.state();
  RemoteEntries count;
  std::vector<PetscInt> rows;
  std::vector<int> owners;
  for (std::size_t e = 0; e < s.elements.size(); ++e)
  {
    global_rows(zone,
                element_unknowns(s.elements.slave[e], s.master_of(e),
                                 free_tool_of(s, e)),
                Constrained::left_out, rows);
    const auto kept = std::count_if(rows.begin(), rows.end(),
                                    [](PetscInt row) { return row >= 0; });
    for (const PetscInt row : rows)
    {
      const int owner = row < 0 ? rank : owner_of(row);
      if (owner == rank)
        continue;
      ++count.vector;
      count.matrix += kept;
      owners.push_back(owner);
    }
  }
  sort_unique(owners);
  count.ranks = static_cast<std::int64_t>(owners.size());
  return count;
}
} // namespace raymortar
