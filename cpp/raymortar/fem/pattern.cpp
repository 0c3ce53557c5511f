#include "raymortar/fem/pattern.h"
#include "raymortar/core/sorted.h"
#include "raymortar/element/free_tools.h"
#include "raymortar/fem/matrix_rows.h"
#include "raymortar/fem/rows.h"
#include "raymortar/fem/set_pattern.h"
#include <algorithm>
#include <numeric>

namespace raymortar
{
namespace
{
/// Present couplings of the zone's terms, by global numbers of masters
struct PresentNeeds
{
  std::vector<Pattern::Pair> pairs;
  std::vector<Pattern::Coupling> couplings;

  explicit PresentNeeds(const Zone& zone)
  {
    const PatternNeeds needs = zone.interface().needs();
    const auto id = [&](Index master)
    { return zone.state().master.facet_id[master]; };
    for (const auto& [slave, master] : needs.pairs)
      pairs.emplace_back(slave, id(master));
    for (const auto& [slave, one, other] : needs.couplings)
    {
      const auto [first, second] = std::minmax({id(one), id(other)});
      couplings.emplace_back(slave, first, second);
    }
    sort_unique(pairs);
    sort_unique(couplings);
  }
};

/// Local numbers of the fetched master facets, by global number
class MasterNumbers
{
public:
  explicit MasterNumbers(const Surface& master)
  {
    for (std::size_t f = 0; f < master.facet_id.size(); ++f)
      _known.emplace_back(master.facet_id[f], static_cast<Index>(f));
    std::sort(_known.begin(), _known.end());
  }

  /// no_index where the facet is no longer fetched
  [[nodiscard]] Index operator()(std::int64_t id) const
  {
    const auto at =
        std::lower_bound(_known.begin(), _known.end(), std::pair{id, Index{0}});
    return at == _known.end() or at->first != id ? no_index : at->second;
  }

private:
  std::vector<std::pair<std::int64_t, Index>> _known;
};

/// Pairs of the slave with the neighbours of a master
void append_neighbours(const Surface& master, Index slave, Index met,
                       std::vector<Pattern::Pair>& pairs)
{
  const std::size_t edges = master.neighbours.size() / master.facet_id.size();
  for (std::size_t e = 0; e < edges; ++e)
  {
    const Index next = master.neighbours[met * edges + e];
    if (next != no_index)
      pairs.emplace_back(slave, master.facet_id[next]);
  }
}

/// Append the rows of a field on a facet; no_index: none
void append_field(const std::vector<GlobalIndex>& rows, int per_facet,
                  Index facet, std::vector<PetscInt>& out)
{
  const auto n = static_cast<std::size_t>(per_facet);
  for (std::size_t k = 0; facet != no_index and k < n; ++k)
    out.push_back(static_cast<PetscInt>(rows[facet * n + k]));
}

/// Rows of a field with what it meets: on the facets of each pair all unknowns
/// there, and through moving segments a master's displacement on another one
void add_field(const Zone& zone, const Pattern& pattern, const FieldRows& field,
               ContactRows& rows)
{
  const ContactState& s = zone.state();
  const MasterNumbers number(s.master);
  std::vector<PetscInt> own, block;
  const auto add = [&](Index slave, Index master)
  {
    element_rows(zone, slave, master, Constrained::kept, block);
    for (const PlacedTool& tool : s.tools)
      if (const Freedom* freedom = freedom_of(tool))
        for (const GlobalIndex row : freedom->rows)
          block.push_back(static_cast<PetscInt>(row));
    own.clear();
    append_field(field.slave, field.per_slave, slave, own);
    append_field(field.master, field.per_master, master, own);
    block.insert(block.end(), own.begin(), own.end());
    rows.add(own, block);
  };
  for (Index f = 0; s.has_tools() and f < s.slave.num_facets(); ++f)
    add(f, no_index);
  for (const auto& [slave, id] : pattern.pairs())
    if (const Index master = number(id); master != no_index)
      add(slave, master);
  for (const auto& [slave, first, second] : pattern.couplings())
    for (const auto& [hit, other] : {std::pair{number(first), number(second)},
                                     std::pair{number(second), number(first)}})
    {
      if (hit == no_index or other == no_index)
        continue;
      master_rows(zone, other, Constrained::kept, block);
      own.clear();
      append_field(field.master, field.per_master, hit, own);
      rows.add(own, block);
    }
}

ContactRows contact_rows(std::span<const Zone* const> zones,
                         std::span<const Pattern* const> patterns,
                         std::span<const FieldRows> fields)
{
  ContactRows rows;
  std::vector<PetscInt> block, other;
  for (std::size_t z = 0; z < zones.size(); ++z)
  {
    const Zone& zone = *zones[z];
    const MasterNumbers number(zone.state().master);
    // A facet without a partner still carries its multiplier
    for (Index f = 0; f < zone.state().slave.num_facets(); ++f)
    {
      element_rows(zone, f, no_index, Constrained::kept, block);
      // A free tool may come to meet any facet
      for (const PlacedTool& tool : zone.state().tools)
        if (const Freedom* freedom = freedom_of(tool))
          for (const GlobalIndex row : freedom->rows)
            block.push_back(static_cast<PetscInt>(row));
      rows.add(block);
    }
    for (const auto& [slave, id] : patterns[z]->pairs())
    {
      element_rows(zone, slave, number(id), Constrained::kept, block);
      rows.add(block);
    }
    for (const auto& [slave, first, second] : patterns[z]->couplings())
    {
      if (number(first) == no_index or number(second) == no_index)
        continue;
      master_rows(zone, number(first), Constrained::kept, block);
      master_rows(zone, number(second), Constrained::kept, other);
      block.insert(block.end(), other.begin(), other.end());
      rows.add(block);
    }
  }
  for (const FieldRows& field : fields)
    add_field(*zones[field.zone], *patterns[field.zone], field, rows);
  rows.sort();
  return rows;
}

/// Compressed rows, under construction in ascending order of the rows
struct CompressedRows
{
  std::vector<PetscInt> offsets = {0};
  std::vector<PetscInt> columns;

  void add(std::span<const PetscInt> row)
  {
    columns.insert(columns.end(), row.begin(), row.end());
    offsets.push_back(static_cast<PetscInt>(columns.size()));
  }
};

/// Send the columns of rows that other ranks own to them: row, count, columns
std::vector<std::int64_t> exchange_rows(MPI_Comm comm, const ContactRows& rows,
                                        const PetscInt* ranges)
{
  int size = 1, rank = 0;
  MPI_Comm_size(comm, &size);
  MPI_Comm_rank(comm, &rank);
  std::vector<std::int64_t> items, counts;
  std::vector<int> ranks;
  // Rows ascend, so their owners do
  rows.for_each_row(
      [&](PetscInt row, const Columns& columns)
      {
        const auto owner = static_cast<int>(
            std::upper_bound(ranges, ranges + size + 1, row) - ranges - 1);
        if (owner == rank)
          return;
        if (ranks.empty() or ranks.back() != owner)
        {
          ranks.push_back(owner);
          counts.push_back(0);
        }
        const auto n = static_cast<std::int64_t>(columns.size());
        items.insert(items.end(), {row, n});
        items.insert(items.end(), columns.begin(), columns.end());
        counts.back() += 2 + n;
      });
  return Exchange(comm, std::move(ranks), std::move(counts), 1)
      .send(items, 0, 1);
}

/// Columns that contact adds to the owned rows, (owned rows,)
std::vector<Columns> owned_extras(MPI_Comm comm, const ContactRows& rows,
                                  const PetscInt* ranges)
{
  int rank = 0;
  MPI_Comm_rank(comm, &rank);
  const PetscInt begin = ranges[rank], end = ranges[rank + 1];
  std::vector<Columns> extras(end - begin);
  rows.for_each_row(
      [&](PetscInt row, const Columns& columns)
      {
        if (row >= begin and row < end)
          extras[row - begin] = columns;
      });
  const auto received = exchange_rows(comm, rows, ranges);
  for (std::size_t k = 0; k < received.size();)
  {
    Columns& row = extras[received[k] - begin];
    const auto first = received.begin() + static_cast<std::ptrdiff_t>(k) + 2;
    std::transform(first, first + received[k + 1], std::back_inserter(row),
                   [](std::int64_t c) { return static_cast<PetscInt>(c); });
    k += 2 + received[k + 1];
  }
  return extras;
}

CompressedRows merged_rows(std::span<const std::int32_t> offsets,
                           std::span<const std::int32_t> columns,
                           const std::vector<Columns>& extras, PetscInt begin)
{
  CompressedRows rows;
  Columns row;
  for (std::size_t i = 0; i < extras.size(); ++i)
  {
    row = extras[i];
    // The diagonal must exist for factorisations and constraints
    row.push_back(begin + static_cast<PetscInt>(i));
    if (i + 1 < offsets.size())
    {
      const auto volume =
          columns.subspan(offsets[i], offsets[i + 1] - offsets[i]);
      row.insert(row.end(), volume.begin(), volume.end());
    }
    sort_unique(row);
    rows.add(row);
  }
  return rows;
}
} // namespace

bool Pattern::covers(const Zone& zone) const
{
  const PresentNeeds now(zone);
  return std::includes(_pairs.begin(), _pairs.end(), now.pairs.begin(),
                       now.pairs.end()) and
         std::includes(_couplings.begin(), _couplings.end(),
                       now.couplings.begin(), now.couplings.end());
}

void Pattern::extend(const Zone& zone)
{
  PresentNeeds needs(zone);
  const std::vector<Pair>& now = needs.pairs;
  const Surface& master = zone.state().master;
  const MasterNumbers number(master);
  const auto is_candidate = [&](const Pair& p)
  {
    const Index m = number(p.second);
    const auto candidates = zone.candidates().masters_of(p.first);
    return m != no_index and
           std::binary_search(candidates.begin(), candidates.end(), m);
  };
  std::vector<Pair> fresh;
  std::set_difference(now.begin(), now.end(), _pairs.begin(), _pairs.end(),
                      std::back_inserter(fresh));
  if (not _pairs.empty())
    for (const Pair& p : fresh)
      _sliding.push_back(p.first);
  sort_unique(_sliding);
  std::erase_if(_pairs, [&](const Pair& p) { return not is_candidate(p); });
  _pairs.insert(_pairs.end(), now.begin(), now.end());
  for (const auto& [slave, id] : now)
    if (std::binary_search(_sliding.begin(), _sliding.end(), slave))
      append_neighbours(master, slave, number(id), _pairs);
  sort_unique(_pairs);
  extend_couplings(master, std::move(needs.couplings));
}

/// Points move from master to master between iterates. So slave facets with any
/// coupling get room for all neighbours among their masters
void Pattern::extend_couplings(const Surface& master, std::vector<Coupling> now)
{
  const MasterNumbers number(master);
  std::vector<Index> slaves;
  for (const auto& [slave, first, second] : _couplings)
    slaves.push_back(slave);
  for (const auto& [slave, first, second] : now)
    slaves.push_back(slave);
  sort_unique(slaves);
  _couplings = std::move(now);
  std::vector<Pair> neighbours;
  for (const Pair& p : _pairs)
  {
    const auto& [slave, id] = p;
    if (not std::binary_search(slaves.begin(), slaves.end(), slave))
      continue;
    neighbours.clear();
    append_neighbours(master, slave, number(id), neighbours);
    for (const Pair& next : neighbours)
      if (id < next.second and
          std::binary_search(_pairs.begin(), _pairs.end(), next))
        _couplings.emplace_back(slave, id, next.second);
  }
  sort_unique(_couplings);
}

void preallocate(PetscMatrix A, std::span<const std::int32_t> offsets,
                 std::span<const std::int32_t> columns,
                 std::span<const Zone* const> zones,
                 std::span<const Pattern* const> patterns,
                 std::span<const FieldRows> fields)
{
  MPI_Comm comm = MPI_COMM_NULL;
  check(PetscObjectGetComm(reinterpret_cast<PetscObject>(A), &comm),
        "PetscObjectGetComm");
  PetscLayout layout = nullptr;
  check(MatGetLayouts(A, &layout, nullptr), "MatGetLayouts");
  check(PetscLayoutSetUp(layout), "PetscLayoutSetUp");
  const PetscInt* ranges = nullptr;
  check(PetscLayoutGetRanges(layout, &ranges), "PetscLayoutGetRanges");
  int rank = 0;
  MPI_Comm_rank(comm, &rank);
  const auto extras =
      owned_extras(comm, contact_rows(zones, patterns, fields), ranges);
  const CompressedRows rows =
      merged_rows(offsets, columns, extras, ranges[rank]);
  set_pattern(A, rows.offsets, rows.columns);
  check(MatSetOption(A, MAT_NEW_NONZERO_LOCATION_ERR, PETSC_TRUE),
        "MatSetOption");
}
} // namespace raymortar
