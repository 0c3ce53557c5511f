#include "raymortar/search/pang.h"
#include "raymortar/pairing/cells.h"
#include <algorithm>

namespace raymortar
{
namespace
{
/// Facets of a surface, and the way from one to the next
template <int D>
class Side
{
public:
  Side(const Surface& surface, std::span<const Box<D>> boxes)
      : _neighbours(surface.neighbours), _boxes(boxes),
        _edges(boxes.empty() ? 0 : surface.neighbours.size() / boxes.size())
  {
  }

  [[nodiscard]] std::size_t size() const { return _boxes.size(); }
  [[nodiscard]] const Box<D>& box(Index facet) const
  {
    return _boxes[static_cast<std::size_t>(facet)];
  }
  /// Across each edge, no_index at the rim
  [[nodiscard]] std::span<const Index> neighbours(Index facet) const
  {
    return _neighbours.subspan(static_cast<std::size_t>(facet) * _edges,
                               _edges);
  }

private:
  std::span<const Index> _neighbours;
  std::span<const Box<D>> _boxes;
  std::size_t _edges;
};

/// Masters that one slave facet found in one go
struct Run
{
  Index slave;
  std::size_t begin, end; ///< of the masters
  std::ptrdiff_t earlier; ///< run of the same slave, or -1
};

template <int D>
class Walk
{
public:
  Walk(const Side<D>& slave, const Side<D>& master)
      : _slave(slave), _master(master), _last_run(slave.size(), -1),
        _mark(master.size(), 0)
  {
  }

  /// Among some masters, all that the slave facet meets are found in the end
  void complete(Index slave, std::span<const Index> masters)
  {
    mark_found(slave);
    for (const Index m : masters)
      if (not is_marked(m) and meet(slave, m))
      {
        ++_seeds;
        walk_from(slave, m);
        mark_found(slave);
      }
  }

  [[nodiscard]] WalkedPairs result() const
  {
    Candidates c;
    c.offsets.reserve(_slave.size() + 1);
    c.masters.reserve(_masters.size());
    for (const std::ptrdiff_t last : _last_run)
    {
      const std::ptrdiff_t begin = std::ssize(c.masters);
      for_runs(last,
               [&](std::span<const Index> found) {
                 c.masters.insert(c.masters.end(), found.begin(), found.end());
               });
      std::sort(c.masters.begin() + begin, c.masters.end());
      c.offsets.push_back(std::ssize(c.masters));
    }
    return {std::move(c), _seeds};
  }

private:
  [[nodiscard]] bool meet(Index slave, Index master) const
  {
    return _master.box(master).overlaps(_slave.box(slave));
  }

  [[nodiscard]] bool is_marked(Index master) const
  {
    return _mark[static_cast<std::size_t>(master)] == _present;
  }
  void mark(Index master)
  {
    _mark[static_cast<std::size_t>(master)] = _present;
  }

  template <class Visit>
  void for_runs(std::ptrdiff_t last, const Visit& visit) const
  {
    for (std::ptrdiff_t k = last; k >= 0;)
    {
      const Run& run = _runs[static_cast<std::size_t>(k)];
      visit(std::span(_masters).subspan(run.begin, run.end - run.begin));
      k = run.earlier;
    }
  }

  /// Restart the marks with the masters that this slave facet has found
  void mark_found(Index slave)
  {
    ++_present;
    for_runs(_last_run[static_cast<std::size_t>(slave)],
             [&](std::span<const Index> found)
             {
               for (const Index m : found)
                 mark(m);
             });
  }

  /// Every pair that is connected with one, both facets changing in turn
  void walk_from(Index slave, Index master)
  {
    std::size_t next = _runs.size();
    const std::size_t begin = _masters.size();
    grow(slave, master);
    end_run(slave, begin);
    for (; next < _runs.size(); ++next)
    {
      const Run run = _runs[next];
      for (const Index neighbour : _slave.neighbours(run.slave))
        if (neighbour != no_index)
          hand_on(run, neighbour);
    }
  }

  /// From a slave facet to one beside it
  void hand_on(const Run& run, Index to)
  {
    mark_found(to);
    const std::size_t begin = _masters.size();
    for (std::size_t k = run.begin; k < run.end; ++k)
      if (not is_marked(_masters[k]))
        grow(to, _masters[k]);
    end_run(to, begin);
  }

  /// From master to master, on from those that meet the slave facet only
  void grow(Index slave, Index seed)
  {
    std::size_t next = _masters.size();
    take(slave, seed);
    for (; next < _masters.size(); ++next)
      for (const Index m : _master.neighbours(_masters[next]))
        if (m != no_index and not is_marked(m))
          take(slave, m);
  }

  void take(Index slave, Index master)
  {
    mark(master);
    if (meet(slave, master))
      _masters.push_back(master);
  }

  void end_run(Index slave, std::size_t begin)
  {
    if (begin == _masters.size())
      return;
    std::ptrdiff_t& last = _last_run[static_cast<std::size_t>(slave)];
    _runs.push_back({slave, begin, _masters.size(), last});
    last = std::ssize(_runs) - 1;
  }

  Side<D> _slave, _master;
  std::vector<Index> _masters;           ///< found, run by run
  std::vector<Run> _runs;                ///< in the order of the walk
  std::vector<std::ptrdiff_t> _last_run; ///< of each slave facet, -1 if none
  std::vector<std::uint64_t> _mark;      ///< of each master: when it was seen
  std::uint64_t _present = 0;
  std::int64_t _seeds = 0;
};
} // namespace

template <int D>
WalkedPairs pang(const Surface& slave, const Surface& master,
                 std::span<const Box<D>> slaves,
                 std::span<const Box<D>> masters)
{
  Walk<D> walk({slave, slaves}, {master, masters});
  const AabbTree<D> tree(masters);
  const BoxGroups groups = group_by_cells<D>(slaves);
  std::vector<Index> near;
  for (std::size_t k = 0; k < groups.size(); ++k)
  {
    Box<D> around;
    for (const Index f : groups[k])
      around.merge(slaves[static_cast<std::size_t>(f)]);
    near.clear();
    tree.query(around, near);
    for (const Index f : groups[k])
      walk.complete(f, near);
  }
  return walk.result();
}

template WalkedPairs pang<2>(const Surface&, const Surface&,
                             std::span<const Box<2>>, std::span<const Box<2>>);
template WalkedPairs pang<3>(const Surface&, const Surface&,
                             std::span<const Box<3>>, std::span<const Box<3>>);

namespace
{
template <int D>
Candidates walked(const Surface& slave, const Surface& master,
                  const FacetDistances& distances)
{
  const auto slaves = ray_boxes<D>(slave, distances);
  const auto masters = facet_boxes<D>(master);
  return pang<D>(slave, master, slaves, masters).candidates;
}
} // namespace

Candidates walk_to_candidates(const Surface& slave, const Surface& master,
                              const FacetDistances& distances)
{
  return slave.gdim == 2 ? walked<2>(slave, master, distances)
                         : walked<3>(slave, master, distances);
}
} // namespace raymortar
