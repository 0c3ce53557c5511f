#include "raymortar/geometry/aabb_tree.h"
#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

namespace raymortar
{
namespace
{
constexpr Index leaf_size = 4;

/// Centre of a box; 0 where it is infinite or not a number, so that centres
/// can be sorted
template <int D>
Vec<D> centre(const Box<D>& box)
{
  Vec<D> x = 0.5 * (box.lower + box.upper);
  for (int i = 0; i < D; ++i)
    x[i] = std::isfinite(x[i]) ? x[i] : 0;
  return x;
}

/// Item that the build sorts: contiguous in memory for every node
template <int D>
struct Entry
{
  Vec<D> centre;
  Index box;
};

/// Axis on which the centres differ most
template <int D>
int widest_axis(std::span<const Entry<D>> entries)
{
  Box<D> bounds;
  for (const Entry<D>& e : entries)
    bounds.merge({e.centre, e.centre});
  int axis = 0;
  (bounds.upper - bounds.lower).maxCoeff(&axis);
  return axis;
}

/// Divide in two halves by the centres
template <int D>
void halve(std::span<Entry<D>> entries)
{
  const int axis = widest_axis<D>(entries);
  std::nth_element(entries.begin(), entries.begin() + entries.size() / 2,
                   entries.end(),
                   [axis](const Entry<D>& a, const Entry<D>& b)
                   { return a.centre[axis] < b.centre[axis]; });
}
} // namespace

template <int D>
AabbTree<D>::AabbTree(std::span<const Box<D>> boxes)
{
  std::vector<Entry<D>> entries;
  entries.reserve(boxes.size());
  for (const Box<D>& box : boxes)
    entries.push_back({centre(box), static_cast<Index>(entries.size())});
  if (boxes.empty())
    return;
  _nodes.push_back({{}, 0, static_cast<Index>(boxes.size())});
  // Children come after their parent, so one pass splits them all
  for (std::size_t k = 0; k < _nodes.size(); ++k)
  {
    const auto [first, count] = std::pair{_nodes[k].first, _nodes[k].count};
    if (count <= leaf_size)
      continue;
    halve<D>({entries.data() + first, static_cast<std::size_t>(count)});
    _nodes[k].first = static_cast<Index>(_nodes.size());
    _nodes[k].count = 0;
    _nodes.push_back({{}, first, count / 2});
    _nodes.push_back({{}, first + count / 2, count - count / 2});
  }
  for (const Entry<D>& e : entries)
  {
    _order.push_back(e.box);
    _boxes.push_back(boxes[e.box]);
  }
  merge_boxes();
}

template <int D>
void AabbTree<D>::merge_boxes()
{
  for (auto node = _nodes.rbegin(); node != _nodes.rend(); ++node)
  {
    for (Index k = node->first; k < node->first + node->count; ++k)
      node->box.merge(_boxes[k]);
    if (node->count > 0)
      continue;
    node->box.merge(_nodes[node->first].box);
    node->box.merge(_nodes[node->first + 1].box);
  }
}

template <int D>
template <class Meets>
void AabbTree<D>::collect(Meets&& meets, std::vector<Index>& hits) const
{
  if (_nodes.empty())
    return;
  const std::ptrdiff_t begin = std::ssize(hits);
  // One sibling waits on each level, and Index has 31 bits
  std::array<Index, 32> stack{0};
  int depth = 1;
  while (depth > 0)
  {
    const Node& node = _nodes[stack[--depth]];
    if (!meets(node.box))
      continue;
    for (Index k = node.first; k < node.first + node.count; ++k)
      if (meets(_boxes[k]))
        hits.push_back(_order[k]);
    if (node.count > 0)
      continue;
    assert(depth + 2 <= static_cast<int>(stack.size()));
    stack[depth++] = node.first;
    stack[depth++] = node.first + 1;
  }
  std::sort(hits.begin() + begin, hits.end());
}

template <int D>
void AabbTree<D>::query(const Box<D>& box, std::vector<Index>& hits) const
{
  collect([&](const Box<D>& other) { return other.overlaps(box); }, hits);
}

template <int D>
void AabbTree<D>::query_line(const Vec<D>& x, const Vec<D>& n,
                             std::vector<Index>& hits) const
{
  collect([&](const Box<D>& other) { return other.meets(x, n); }, hits);
}

template class AabbTree<2>;
template class AabbTree<3>;
} // namespace raymortar
