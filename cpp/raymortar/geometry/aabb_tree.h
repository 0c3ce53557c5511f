// Boxes along the axes, and a tree that finds those that overlap another.
#pragma once

#include "raymortar/core/types.h"
#include <algorithm>
#include <limits>
#include <span>
#include <vector>

namespace raymortar
{
/// Closed box. The default one is empty: it overlaps no finite box nor itself.
template <int D>
struct Box
{
  Vec<D> lower = Vec<D>::Constant(std::numeric_limits<double>::infinity());
  Vec<D> upper = Vec<D>::Constant(-std::numeric_limits<double>::infinity());

  /// Box larger by a length on all sides
  [[nodiscard]] Box inflated(double margin) const
  {
    return {lower.array() - margin, upper.array() + margin};
  }

  /// Touching counts. False if a bound is not a number.
  [[nodiscard]] bool overlaps(const Box& other) const
  {
    for (int i = 0; i < D; ++i)
      if (!(lower[i] <= other.upper[i] and other.lower[i] <= upper[i]))
        return false;
    return true;
  }

  /// Whether a line meets the box. Touching counts
  [[nodiscard]] bool meets(const Vec<D>& x, const Vec<D>& n) const
  {
    double first = -std::numeric_limits<double>::infinity(), last = -first;
    for (int i = 0; i < D; ++i)
    {
      if (n[i] == 0.0)
      {
        if (not(lower[i] <= x[i] and x[i] <= upper[i]))
          return false;
        continue;
      }
      const double a = (lower[i] - x[i]) / n[i], b = (upper[i] - x[i]) / n[i];
      first = std::max(first, std::min(a, b));
      last = std::min(last, std::max(a, b));
    }
    return first <= last;
  }

  /// Grow to hold another box. Bounds that are not a number are left out.
  void merge(const Box& other)
  {
    for (int i = 0; i < D; ++i)
    {
      lower[i] = other.lower[i] < lower[i] ? other.lower[i] : lower[i];
      upper[i] = other.upper[i] > upper[i] ? other.upper[i] : upper[i];
    }
  }
};

/// @brief Bounding volume tree over boxes, D = 2 or 3.
///
/// Every node is cut at the median of its boxes' centres along the axis on
/// which these differ most, so the depth is log2(n) whatever the boxes are:
/// equal, empty or not numbers.
/// @complexity Build O(n log n). Query O(log n + hits) for small boxes.
/// @see tests/cpp/geometry/test_aabb_tree.cpp
template <int D>
class AabbTree
{
public:
  AabbTree() = default;

  /// @param[in] boxes  Copied; hits are indices into them.
  explicit AabbTree(std::span<const Box<D>> boxes);

  /// Append the indices of the boxes that overlap a box, in ascending order
  void query(const Box<D>& box, std::vector<Index>& hits) const;

  /// Append the indices of the boxes that a line meets, in ascending order
  /// @param[in] n Its direction, of length 1
  void query_line(const Vec<D>& x, const Vec<D>& n,
                  std::vector<Index>& hits) const;

  /// Number of boxes
  [[nodiscard]] Index size() const { return static_cast<Index>(_order.size()); }

private:
  /// Leaf: boxes first, ..., first + count - 1 of the order. Branch: count is
  /// 0 and the children are nodes first and first + 1.
  struct Node
  {
    Box<D> box;
    Index first = 0;
    Index count = 0;
  };

  /// Boxes of the nodes, from the leaves up
  void merge_boxes();

  /// The boxes that `meets(box)` takes, and whose parents' boxes it takes
  template <class Meets>
  void collect(Meets&& meets, std::vector<Index>& hits) const;

  std::vector<Node> _nodes;
  std::vector<Index> _order; ///< Of the boxes in the caller's
  std::vector<Box<D>> _boxes;
};

extern template class AabbTree<2>;
extern template class AabbTree<3>;
} // namespace raymortar
