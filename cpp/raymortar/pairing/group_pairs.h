// Candidates of slave facets, found for groups of them at once.
#pragma once

#include "raymortar/pairing/candidates.h"

namespace raymortar
{
/// @brief Asks the tree once for each group of slave facets, and compares what
/// it finds with each facet of the group.
///
/// Costs little where the facets of a group lie close together. Every slave
/// facet has to be in one group.
template <int D>
class GroupPairs
{
public:
  GroupPairs(std::span<const Box<D>> slaves, std::span<const Box<D>> masters)
      : _slaves(slaves), _masters(masters), _tree(masters),
        _begin(slaves.size(), 0), _count(slaves.size(), 0)
  {
  }

  void add(std::span<const Index> group)
  {
    Box<D> around;
    for (const Index f : group)
      around.merge(_slaves[static_cast<std::size_t>(f)]);
    _near.clear();
    _tree.query(around, _near);
    for (const Index f : group)
    {
      const auto k = static_cast<std::size_t>(f);
      _begin[k] = _pairs.size();
      for (const Index m : _near)
        if (_masters[static_cast<std::size_t>(m)].overlaps(_slaves[k]))
          _pairs.push_back(m);
      _count[k] = _pairs.size() - _begin[k];
    }
  }

  /// Pairs in the order of the slave facets instead of the groups'
  [[nodiscard]] Candidates in_order() const
  {
    Candidates c;
    c.offsets.reserve(_slaves.size() + 1);
    c.masters.reserve(_pairs.size());
    for (std::size_t f = 0; f < _slaves.size(); ++f)
    {
      const auto own = std::span(_pairs).subspan(_begin[f], _count[f]);
      c.masters.insert(c.masters.end(), own.begin(), own.end());
      c.offsets.push_back(static_cast<std::int64_t>(c.masters.size()));
    }
    return c;
  }

private:
  std::span<const Box<D>> _slaves, _masters;
  AabbTree<D> _tree;
  std::vector<std::size_t> _begin, _count; ///< pairs of each slave facet
  std::vector<Index> _pairs, _near;
};
} // namespace raymortar
