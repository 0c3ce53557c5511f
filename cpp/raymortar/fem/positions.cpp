#include "raymortar/fem/positions.h"
#include "raymortar/fem/rows.h"
#include <algorithm>

namespace raymortar
{
namespace
{
void append_groups(NodeGroups& groups, std::size_t nodes, int width)
{
  int begin =
      groups.begin.empty() ? 0 : groups.begin.back() + groups.width.back();
  for (std::size_t a = 0; a < nodes; ++a, begin += width)
  {
    groups.begin.push_back(begin);
    groups.width.push_back(width);
  }
}

/// Put each unknown into a group by itself
NodeGroups apart(const NodeGroups& nodes)
{
  NodeGroups unknowns;
  append_groups(unknowns, nodes.begin.back() + nodes.width.back(), 1);
  return unknowns;
}

/// Whether the rows of every group follow each other
bool are_consecutive(const NodeGroups& groups,
                     const std::vector<PetscInt>& rows)
{
  for (std::size_t a = 0; a < groups.size(); ++a)
  {
    const std::size_t first = groups.begin[a];
    for (int i = 1; i < groups.width[a]; ++i)
      if (rows[first + i] != rows[first] + i)
        return false;
  }
  return true;
}

/// Whether all entries of two nodes lie like the first: in the same place of
/// each row, side by side
bool is_regular(const AijArrays& A, const PetscInt* rows, int height,
                const PetscInt* columns, int width, std::int32_t first)
{
  const std::int32_t step = first >= 0 ? 1 : -1;
  for (int i = 0; i < height; ++i)
    for (int j = 0; j < width; ++j)
      if (A.find(rows[i], columns[j]) != first + step * j)
        return false;
  return true;
}

template <int W>
void add_run(PetscScalar* to, const double* from)
{
  for (int j = 0; j < W; ++j)
    to[j] += from[j];
}

/// Add one row of a block, node after node
void add_row(const BlockPositions::Block& at, const std::int32_t* places,
             PetscScalar* own, PetscScalar* others, const double* from)
{
  for (std::size_t b = 0; b < at.groups->size(); ++b)
  {
    const std::int32_t k = places[b];
    // Places among other ranks' columns count down from -1
    PetscScalar* to = k >= 0 ? own + k : others + (-k - 1);
    const int width = at.groups->width[b];
    if (width == 3)
      add_run<3>(to, from);
    else if (width == 2)
      add_run<2>(to, from);
    else
      add_run<1>(to, from);
    from += width;
  }
}
} // namespace

void BlockPositions::follow(PetscMatrix A, const Zone& zone)
{
  PetscObjectId matrix = 0;
  PetscObjectState pattern = 0;
  check(PetscObjectGetId(reinterpret_cast<PetscObject>(A), &matrix),
        "PetscObjectGetId");
  check(MatGetNonzeroState(A, &pattern), "MatGetNonzeroState");
  if (matrix == _matrix and pattern == _pattern)
    return;
  _matrix = matrix;
  _pattern = pattern;
  _entries.clear();
  _places.clear();
  _first.assign(zone.input().slave.num_facets(), -1);
  set_groups(zone);
}

void BlockPositions::set_groups(const Zone& zone)
{
  const Surface& slave = zone.input().slave;
  const Multipliers& m = zone.input().multipliers;
  _nodes = {};
  append_groups(_nodes.alone, slave.dofs_per_facet(), slave.gdim);
  if (m.components > 0 and slave.num_facets() > 0)
    append_groups(_nodes.alone, m.facet.size() / slave.num_facets(),
                  m.components);
  _nodes.paired = _nodes.alone;
  append_groups(_nodes.paired, zone.input().master.dofs_per_facet(),
                slave.gdim);
  _unknowns = {apart(_nodes.alone), apart(_nodes.paired)};
}

BlockPositions::Block BlockPositions::of(const AijArrays& A, const Zone& zone,
                                         Index slave, Index master)
{
  const GlobalIndex id =
      master == no_index ? no_index : zone.state().master.facet_id[master];
  std::int32_t& first = _first[slave];
  std::int32_t k = first;
  while (k >= 0 and _entries[k].master != id)
    k = _entries[k].next;
  if (k < 0)
  {
    Entry entry = look_up(A, zone, slave, master);
    entry.master = id;
    entry.next = first;
    k = first = static_cast<std::int32_t>(_entries.size());
    _entries.push_back(entry);
  }
  const Entry& entry = _entries[k];
  return {&(entry.by_node ? _nodes : _unknowns).of(master),
          entry.begin < 0 ? nullptr : _places.data() + entry.begin,
          entry.begin >= 0, entry.has_foreign};
}

BlockPositions::Entry BlockPositions::look_up(const AijArrays& A,
                                              const Zone& zone, Index slave,
                                              Index master)
{
  ++_lookups;
  const auto begin = static_cast<std::int64_t>(_places.size());
  element_rows(zone, slave, master, Constrained::kept, _rows);
  for (const bool by_node : {true, false})
  {
    const NodeGroups& groups = (by_node ? _nodes : _unknowns).of(master);
    Entry entry{0, begin, -1, false, by_node};
    if (by_node and not are_consecutive(groups, _rows))
      continue;
    if (append_places(A, groups, entry))
      return entry;
    _places.resize(begin);
  }
  return {0, -1, -1, false, true};
}

/// @return Whether the groups of each row have places that tell those of all
/// their entries
bool BlockPositions::append_places(const AijArrays& A, const NodeGroups& groups,
                                   Entry& entry)
{
  for (std::size_t a = 0; a < groups.size(); ++a)
  {
    const PetscInt* row = _rows.data() + groups.begin[a];
    const bool owned = A.owns(*row);
    entry.has_foreign = entry.has_foreign or not owned;
    for (std::size_t b = 0; b < groups.size(); ++b)
    {
      const PetscInt* column = _rows.data() + groups.begin[b];
      const std::int32_t at = owned ? A.find(*row, *column) : foreign;
      if (owned and (at == AijArrays::no_entry or
                     not is_regular(A, row, groups.width[a], column,
                                    groups.width[b], at)))
        return false;
      _places.push_back(at);
    }
  }
  return true;
}

void add_block(const AijArrays& A, const BlockPositions::Block& at,
               std::span<const PetscInt> rows, const double* block)
{
  const NodeGroups& groups = *at.groups;
  for (std::size_t a = 0; a < groups.size(); ++a)
  {
    const std::int32_t* places = at.places + a * groups.size();
    if (places[0] == BlockPositions::foreign)
      continue;
    for (int i = groups.begin[a]; i < groups.begin[a] + groups.width[a]; ++i)
    {
      const PetscInt row = rows[i];
      if (row >= 0)
        add_row(at, places, A.own_columns(row), A.other_columns(row),
                block + i * rows.size());
    }
  }
}
} // namespace raymortar
