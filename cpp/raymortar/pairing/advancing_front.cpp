#include "raymortar/pairing/advancing_front.h"
#include "raymortar/pairing/group_pairs.h"

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
      : _slave(slave), _pairs(slaves, masters), _is_taken(slaves.size(), false)
  {
  }

  [[nodiscard]] Candidates run() &&
  {
    for (Index f = 0; f < static_cast<Index>(_is_taken.size()); ++f)
      if (not is_taken(f))
        advance_from(f);
    return _pairs.in_order();
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
    const std::size_t edges = _slave.neighbours.size() / _is_taken.size();
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
        _pairs.add(_patch);
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

  const Surface& _slave;
  GroupPairs<D> _pairs;
  std::vector<bool> _is_taken; ///< slaves that are in a patch
  std::vector<Index> _patch;
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
