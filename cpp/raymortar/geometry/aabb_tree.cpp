#include "raymortar/geometry/aabb_tree.h"
#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <numeric>

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

/// Axis on which the centres differ most
template <int D>
int widest_axis(std::span<const Index> order,
                const std::vector<Vec<D>>& centres)
{
  Box<D> bounds;
  for (const Index k : order)
    bounds.merge({centres[k], centres[k]});
  int axis = 0;
  (bounds.upper - bounds.lower).maxCoeff(&axis);
  return axis;
}
} // namespace

template <int D>
AabbTree<D>::AabbTree(std::span<const Box<D>> boxes)
    : _order(boxes.size()), _boxes(boxes.begin(), boxes.end())
{
  std::iota(_order.begin(), _order.end(), 0);
  std::vector<Vec<D>> centres(boxes.size());
  std::transform(boxes.begin(), boxes.end(), centres.begin(), centre<D>);
  if (!boxes.empty())
    build(centres);
}

template <int D>
void AabbTree<D>::build(const std::vector<Vec<D>>& centres)
{
  _nodes.push_back({{}, 0, size()});
  // Children come after their parent, so one pass splits them all
  for (std::size_t k = 0; k < _nodes.size(); ++k)
  {
    const auto [first, count] = std::pair{_nodes[k].first, _nodes[k].count};
    const std::span<Index> order(_order.begin() + first, count);
    for (const Index b : order)
      _nodes[k].box.merge(_boxes[b]);
    if (count <= leaf_size)
      continue;
    const int axis = widest_axis<D>(order, centres);
    const Index half = count / 2;
    std::nth_element(order.begin(), order.begin() + half, order.end(),
                     [&](Index a, Index b)
                     { return centres[a][axis] < centres[b][axis]; });
    _nodes[k].first = static_cast<Index>(_nodes.size());
    _nodes[k].count = 0;
    _nodes.push_back({{}, first, half});
    _nodes.push_back({{}, first + half, count - half});
  }
}

template <int D>
void AabbTree<D>::query(const Box<D>& box, std::vector<Index>& hits) const
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
    if (!node.box.overlaps(box))
      continue;
    for (Index k = node.first; k < node.first + node.count; ++k)
      if (_boxes[_order[k]].overlaps(box))
        hits.push_back(_order[k]);
    if (node.count > 0)
      continue;
    assert(depth + 2 <= static_cast<int>(stack.size()));
    stack[depth++] = node.first;
    stack[depth++] = node.first + 1;
  }
  std::sort(hits.begin() + begin, hits.end());
}

template class AabbTree<2>;
template class AabbTree<3>;
} // namespace raymortar
