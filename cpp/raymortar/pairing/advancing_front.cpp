#include "raymortar/pairing/advancing_front.h"
#include <algorithm>

namespace raymortar
{
namespace
{
/// Facets of a patch: enough for one query of the tree to cost little per
/// facet, few enough for what it finds to stay near
constexpr std::size_t patch_size = 64;

template <int D>
class Front
{
public:
  Front(const Surface& slave, std::span<const Box<D>> slaves,
        std::span<const Box<D>> masters)
      : _slave(slave), _slaves(slaves), _masters(masters), _tree(masters),
        _begin(slaves.size(), 0), _count(slaves.size(), 0),
        _is_taken(slaves.size(), false)
  {
  }

  [[nodiscard]] Candidates run() &&
  {
    for (Index f = 0; f < static_cast<Index>(_slaves.size()); ++f)
      if (not is_taken(f))
        advance_from(f);
    return in_order();
  }

private:
  [[nodiscard]] bool is_taken(Index slave) const
  {
    return _is_taken[static_cast<std::size_t>(slave)];
  }

  void take(Index slave)
  {
    _patch.push_back(slave);
    _is_taken[static_cast<std::size_t>(slave)] = true;
  }

  [[nodiscard]] std::span<const Index> neighbours(Index slave) const
  {
    const std::size_t edges = _slave.neighbours.size() / _slaves.size();
    return std::span(_slave.neighbours)
        .subspan(static_cast<std::size_t>(slave) * edges, edges);
  }

  /// Everything that is connected with a slave facet
  void advance_from(Index first)
  {
    std::vector<Index> front = {first};
    for (std::size_t k = 0; k < front.size(); ++k)
      if (not is_taken(front[k]))
      {
        grow_patch(front[k], front);
        pair_patch();
      }
  }

  /// Nearest facets around one, across edges; those next to them join the front
  void grow_patch(Index first, std::vector<Index>& front)
  {
    _patch.clear();
    take(first);
    // The patch grows meanwhile NOLINTNEXTLINE(modernize-loop-convert)
    for (std::size_t k = 0; k < _patch.size(); ++k)
      for (const Index next : neighbours(_patch[k]))
      {
        if (next == no_index or is_taken(next))
          continue;
        if (_patch.size() < patch_size)
          take(next);
        else
          front.push_back(next);
      }
  }

  /// What the tree finds around the patch is compared with each of its facets
  void pair_patch()
  {
    Box<D> around;
    for (const Index f : _patch)
      around.merge(_slaves[static_cast<std::size_t>(f)]);
    _near.clear();
    _tree.query(around, _near);
    for (const Index f : _patch)
    {
      const auto k = static_cast<std::size_t>(f);
      _begin[k] = _pairs.size();
      for (const Index m : _near)
        if (_masters[static_cast<std::size_t>(m)].overlaps(_slaves[k]))
          _pairs.push_back(m);
      _count[k] = _pairs.size() - _begin[k];
    }
  }

  /// Pairs in the order of the slave facets instead of the front's
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

  const Surface& _slave;
  std::span<const Box<D>> _slaves, _masters;
  AabbTree<D> _tree;
  std::vector<std::size_t> _begin, _count; ///< pairs of each slave facet
  std::vector<bool> _is_taken;             ///< slaves that are in a patch
  std::vector<Index> _pairs, _patch, _near;
};
} // namespace

template <int D>
Candidates advancing_front(const Surface& slave, std::span<const Box<D>> slaves,
                           std::span<const Box<D>> masters)
{
  return Front<D>(slave, slaves, masters).run();
}

template Candidates advancing_front<2>(const Surface&, std::span<const Box<2>>,
                                       std::span<const Box<2>>);
template Candidates advancing_front<3>(const Surface&, std::span<const Box<3>>,
                                       std::span<const Box<3>>);
} // namespace raymortar
