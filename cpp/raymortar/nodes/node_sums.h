// Integrals over the facets around each multiplier node, of which a law at
// nodes takes the means.
#pragma once

#include "raymortar/core/types.h"
#include <cstddef>
#include <span>
#include <vector>

namespace raymortar
{
/// @brief Sums of one node. Those over points are integrals with its test
/// function over what is hit.
enum class NodeSum : std::size_t
{
  area,
  gap,         ///< with the offset
  coefficient, ///< of friction
  gamma,
  touch,       ///< see PointState
  whole,       ///< of the whole facets around it, as the next. Area
  whole_gamma, ///< area times coefficient
  facets,      ///< how many there are
  vectors      ///< the first vector: see NodeVector
};

enum class NodeVector : std::size_t
{
  normal, ///< of the law's frame
  slip,
  past,    ///< what ties were when the step began, once a facet
  held,    ///< what ties multipliers of held facets  [theory (4.24)]; of a
           ///< scalar multiplier its first component
  outer,   ///< what ties a node beyond the rim to its partly covered facets
  inner,   ///< what it is within the rim
  elastic, ///< elastic slip of the accepted step, turned with the surface
  count
};

/// @brief Sums of the multiplier nodes of a zone, (nodes, width); to be added
/// over zones and ranks that share a node.
class NodeSums
{
public:
  NodeSums() = default;
  NodeSums(std::size_t nodes, int gdim)
      : _gdim(static_cast<std::size_t>(gdim)),
        _values(nodes * width_in(gdim), 0.0)
  {
  }

  /// @param[in] values (nodes, width)
  NodeSums(std::span<const double> values, int gdim)
      : _gdim(static_cast<std::size_t>(gdim)),
        _values(values.begin(), values.end())
  {
  }

  [[nodiscard]] static std::size_t width_in(int gdim)
  {
    return static_cast<std::size_t>(NodeSum::vectors) +
           static_cast<std::size_t>(NodeVector::count) *
               static_cast<std::size_t>(gdim);
  }

  [[nodiscard]] std::size_t width() const
  {
    return width_in(static_cast<int>(_gdim));
  }

  [[nodiscard]] double& at(Index node, NodeSum what)
  {
    return _values[first(node) + static_cast<std::size_t>(what)];
  }
  [[nodiscard]] double at(Index node, NodeSum what) const
  {
    return _values[first(node) + static_cast<std::size_t>(what)];
  }
  template <int D>
  [[nodiscard]] Eigen::Map<Vec<D>> at(Index node, NodeVector what)
  {
    return Eigen::Map<Vec<D>>(_values.data() + place(node, what));
  }
  template <int D>
  [[nodiscard]] Eigen::Map<const Vec<D>> at(Index node, NodeVector what) const
  {
    return Eigen::Map<const Vec<D>>(_values.data() + place(node, what));
  }

  void add(Index node, NodeVector what, std::size_t component, double value)
  {
    _values[place(node, what) + component] += value;
  }

  [[nodiscard]] std::span<const double> values() const { return _values; }

private:
  [[nodiscard]] std::size_t first(Index node) const
  {
    return static_cast<std::size_t>(node) * width();
  }
  [[nodiscard]] std::size_t place(Index node, NodeVector what) const
  {
    return first(node) + static_cast<std::size_t>(NodeSum::vectors) +
           static_cast<std::size_t>(what) * _gdim;
  }

  std::size_t _gdim = 0;
  std::vector<double> _values;
};

/// @brief What multiplier nodes of a contact weigh, (nodes,): 0 where nothing
/// is covered.
struct NodeWeights
{
  std::vector<double> area;  ///< A_j of (4.23)
  std::vector<double> gamma; ///< gamma_j. Traction per length
};

/// @param[in] sums (nodes, width); empty: the law holds at points
[[nodiscard]] inline NodeWeights node_weights(std::span<const double> sums,
                                              std::size_t nodes)
{
  NodeWeights weights{std::vector<double>(nodes), std::vector<double>(nodes)};
  const std::size_t width = nodes == 0 ? 0 : sums.size() / nodes;
  const auto at = [&](std::size_t node, NodeSum what)
  { return sums[node * width + static_cast<std::size_t>(what)]; };
  for (std::size_t k = 0; k < nodes and width > 0; ++k)
  {
    weights.area[k] = at(k, NodeSum::area);
    if (weights.area[k] > 0.0)
      weights.gamma[k] = at(k, NodeSum::whole_gamma) / at(k, NodeSum::whole);
  }
  return weights;
}
} // namespace raymortar
