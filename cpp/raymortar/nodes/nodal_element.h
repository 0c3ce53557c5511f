// Elements whose law holds at nodes: what their points give to the nodes'
// means, and how these vary.
#pragma once

#include "raymortar/element/any_element.h"
#include "raymortar/nodes/nodal.h"
#include "raymortar/nodes/node_conditions.h"
#include "raymortar/nodes/node_tests.h"

namespace raymortar
{
/// @brief The conditions at the nodes of one slave facet after the other, and
/// their test functions at a point.
template <int D, class Law>
class FacetConditions
{
public:
  static constexpr int T = D - 1;
  static constexpr int M = Law::template multiplier_size<D>;
  using Condition = NodeCondition<D, M>;

  /// @brief Evaluate the law at all nodes.
  explicit FacetConditions(const ContactState& s)
      : _state(s), _all(node_conditions<D, typename Law::AtNodes>(s))
  {
  }

  void take(Index facet, int nodes)
  {
    _count = nodes;
    const std::size_t first =
        static_cast<std::size_t>(facet) * static_cast<std::size_t>(nodes);
    for (std::size_t k = 0; k < static_cast<std::size_t>(nodes); ++k)
      _here[k] =
          &_all[static_cast<std::size_t>(_state.multipliers.facet[first + k])];
  }

  void place(const PointShapes<D>& at)
  {
    set_node_tests<T>(at.multiplier, _count, _tests);
  }

  [[nodiscard]] int size() const { return _count; }
  [[nodiscard]] const Condition& at(int k) const
  {
    return *_here[static_cast<std::size_t>(k)];
  }
  [[nodiscard]] const std::array<double, taylor_size<T>>& test(int k) const
  {
    return _tests[static_cast<std::size_t>(k)];
  }

  /// @brief The node whose test function is largest at the point.
  [[nodiscard]] const Condition& nearest() const
  {
    int best = 0;
    for (int k = 1; k < _count; ++k)
      if (test(k)[0] > test(best)[0])
        best = k;
    return at(best);
  }

private:
  const ContactState& _state;
  std::vector<Condition> _all;
  std::array<const Condition*, 9> _here{};
  ShapeRows<T> _tests;
  int _count = 0;
};

/// @brief Derivatives of a node's row by what its points give.
template <int D, class Law>
[[nodiscard]] auto
point_slopes(const NodeCondition<D, Law::template multiplier_size<D>>& c)
{
  constexpr int M = Law::template multiplier_size<D>;
  static const Mat<M, M> none = Mat<M, M>::Zero();
  static const Vec<M> no_rate = Vec<M>::Zero();
  if constexpr (is_frictional<Law>)
    return LawSlopes<M, D, M, true>{c.by_n, c.by_g,           none,   c.by_w,
                                    none,   c.by_coefficient, no_rate};
  else
    return LawSlopes<M, D, M, false>{c.by_n, c.by_g, none};
}

/// @brief What one point gives to the row of a node, per unit of its area and
/// test function.
template <class Data, class Hit, class Condition>
[[nodiscard]] auto share_of_point(const Data& e, const Hit& p,
                                  const Condition& c)
{
  auto share =
      (c.by_area + c.by_gamma * p.gamma + c.by_n * p.normal + p.gap * c.by_g)
          .eval();
  if constexpr (requires { p.slip(); })
  {
    share += c.by_w * p.old.w;
    if (e.history.has_coefficient)
      share += e.history.coefficient[0] * c.by_coefficient;
  }
  return share;
}

/// @brief Blocks of an element whose law holds at nodes.
template <int D, class Law>
class NodalElement : public AnyElement<D, Law>
{
public:
  using Base = AnyElement<D, Law>;
  using Base::M;
  using Shapes = typename Base::Shapes;
  using Data = typename Base::Data;
  using Hit = typename Base::template Hit<true>;
  using HitTangent = typename Base::HitTangent;
  using Columns = typename Base::Columns;

  /// @brief Add how what a point gives to its nodes varies.
  void add_node_tangents(const Data& e, const Hit& p, const HitTangent& by,
                         const Shapes& at, const FacetConditions<D, Law>& nodes)
  {
    const Columns columns(p, by, at.has_target());
    const TargetPart part = Base::target_part(p);
    for (int k = 0; k < nodes.size(); ++k)
    {
      const auto& c = nodes.at(k);
      auto varied = chain<M>(point_slopes<D, Law>(c), p, by, columns);
      Base::template add_area<M>(e, p, by.dual, share_of_point(e, p, c),
                                 varied);
      UnknownRows<M, D> rows;
      expand<M, D>(at, varied, part, rows);
      add_rows(p.weight * at.scale * nodes.test(k)[0], k, rows, at);
    }
  }

private:
  void add_rows(double w, int node, const UnknownRows<M, D>& rows,
                const Shapes& at)
  {
    const int n = at.size();
    double* out = this->A.data() + (at.side() + node * M) * n;
    for (const auto& row : rows)
    {
      for (int k = 0; k < at.side(); ++k)
        out[k] += w * row[static_cast<std::size_t>(k)];
      for (int k = at.alone(); k < n; ++k)
        out[k] += w * row[static_cast<std::size_t>(k)];
      out += n;
    }
  }
};
} // namespace raymortar
