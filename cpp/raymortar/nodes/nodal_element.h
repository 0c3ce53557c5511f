// Elements whose law holds at nodes: what their points give to the nodes'
// means, and how these vary.
#pragma once

#include "raymortar/element/any_element.h"
#include "raymortar/nodes/nodal.h"
#include "raymortar/nodes/node_conditions.h"
#include "raymortar/nodes/node_functions.h"
#include "raymortar/nodes/node_springs.h"
#include "raymortar/nodes/node_tests.h"

namespace raymortar
{
/// @brief The row of a node at a point, per unit of area: what is tested with
/// the node's function, and gap and slip  [theory (4.26), (4.41)].
template <int D, int M>
struct RowAtPoint
{
  static constexpr int T = D - 1;
  double test, gap_test; ///< functions of the node, and of gap and slip
  Vec<M> value = Vec<M>::Zero();
  /// Derivative along the facet, for fixed normal, gap, slip and fields
  Mat<M, T> along = Mat<M, T>::Zero();
  /// For fixed area, per reference coordinates: the covered share changes
  Vec<M> by_share = Vec<M>::Zero();
};

/// @brief Gap and slip that a row is multiplied with.
template <int D, class Condition>
[[nodiscard]] auto times_gap(const Condition& c, const Vec<1 + D>& gap)
{
  return (gap[0] * c.by_g + c.by_w * gap.template tail<D>()).eval();
}

/// @brief The conditions at the nodes of one slave facet after the other, and
/// their test functions at a point.
template <int D, class Law>
class FacetConditions
{
public:
  static constexpr int T = D - 1;
  static constexpr int M = Law::template multiplier_size<D>;
  using Condition = NodeCondition<D, M>;
  using Gap = Vec<1 + D>; ///< and slip

  /// @brief Evaluate the law at all nodes.
  /// @param[in] functions That test gaps and slips; null: those of the nodes
  FacetConditions(const ContactState& s, const NodeFunctions* functions)
      : _state(s), _all(node_conditions<D, typename Law::AtNodes>(s)),
        _functions(functions), _springs(s)
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
    _springs.take(facet);
    _own = nullptr;
    if (_functions and not _functions->gap_tests.empty())
      take_own(_functions->gap_tests[static_cast<std::size_t>(facet)]);
  }

  void place(const PointShapes<D>& at)
  {
    set_node_tests<T>(at.multiplier, _count, _tests);
    _gap_tests = _tests;
    if (_own)
      place_own();
  }

  [[nodiscard]] int size() const { return _count; }
  [[nodiscard]] const Condition& at(int k) const
  {
    return *_here[static_cast<std::size_t>(k)];
  }

  /// @brief Status of the node whose test function is largest at the point; of
  /// several that are alike but for rounding the last in the order of statuses.
  [[nodiscard]] ContactStatus nearest_status() const
  {
    constexpr double alike = 1.0 - 1e-9;
    double largest = 0.0;
    for (int k = 0; k < _count; ++k)
      largest = std::max(largest, test(k));
    ContactStatus found = ContactStatus::none;
    for (int k = 0; k < _count; ++k)
      if (test(k) >= alike * largest)
        found = std::max(found, at(k).status);
    return found;
  }

  /// @brief Elastic slips of the nodes.
  [[nodiscard]] const NodeSprings<D>& springs() const { return _springs; }

  /// @brief Test function of a node at the point.
  [[nodiscard]] double test(int k) const
  {
    return _tests[static_cast<std::size_t>(k)][0];
  }

  /// @brief Multiplier of a node.
  [[nodiscard]] Vec<M> multiplier(Index facet, int k) const
  {
    const auto place = static_cast<std::size_t>(facet * _count + k);
    const auto node = static_cast<std::size_t>(_state.multipliers.facet[place]);
    return Eigen::Map<const Vec<M>>(_state.multipliers.value.data() + node * M);
  }

  /// @brief The row of a node at the point.
  template <class Data, class Hit>
  [[nodiscard]] RowAtPoint<D, M> row(const Data& e, const Hit& p, int k) const
  {
    const Condition& c = at(k);
    const auto& N = _tests[static_cast<std::size_t>(k)];
    const auto& phi = _gap_tests[static_cast<std::size_t>(k)];
    Vec<M> of_node = c.by_area + c.by_gamma * p.gamma + c.by_n * p.normal;
    Vec<M> of_gap = p.gap * c.by_g;
    if constexpr (is_frictional<Law>)
    {
      of_gap += c.by_w * p.old.w;
      if (_springs.are_there())
        of_node += c.by_elastic * _springs.turned(p, k).value();
      if (e.history.has_coefficient)
        of_node += e.history.coefficient[0] * c.by_coefficient;
    }
    RowAtPoint<D, M> row{N[0], phi[0]};
    if (_own and not _own->is_plain[static_cast<std::size_t>(k)])
    {
      const auto i = static_cast<Eigen::Index>(k);
      of_node += times_gap<D>(c, _own->gaps.col(i));
      of_gap -= times_gap<D>(c, _projected[0]);
      row.by_share = times_gap<D>(c, _own->spread.col(i));
      row.value = -_own->slack * row.by_share;
      row.by_share *= _own->by_share;
      for (int j = 0; j < T; ++j)
        set_column(row.along, j,
                   Vec<M>(-phi[0] *
                          times_gap<D>(
                              c, _projected[static_cast<std::size_t>(1 + j)])));
    }
    row.value += N[0] * of_node + phi[0] * of_gap;
    for (int j = 0; j < T; ++j)
    {
      const auto along = static_cast<std::size_t>(1 + j);
      set_column(row.along, j,
                 Vec<M>(column(row.along, j) + N[along] * of_node +
                        phi[along] * of_gap));
    }
    return row;
  }

private:
  void take_own(const GapTests& facet)
  {
    if (facet.gaps.size() > 0)
      _own = &facet;
  }

  void place_own()
  {
    for (Gap& gap : _projected)
      gap.setZero();
    for (int k = 0; k < _count; ++k)
    {
      const auto& B = _tests[static_cast<std::size_t>(k)];
      for (std::size_t p = 0; p <= T; ++p)
        _projected[p] += B[p] * _own->gaps.col(k);
      if (_own->is_plain[static_cast<std::size_t>(k)])
        continue;
      auto& phi = _gap_tests[static_cast<std::size_t>(k)];
      phi.fill(0.0);
      for (std::size_t p = 0; p <= T; ++p)
        for (int b = 0; b < _count; ++b)
          phi[p] +=
              _own->from_nodal(b, k) * _tests[static_cast<std::size_t>(b)][p];
    }
  }

  const ContactState& _state;
  std::vector<Condition> _all;
  const NodeFunctions* _functions;
  NodeSprings<D> _springs;
  const GapTests* _own = nullptr; ///< of the facet; null: those of the nodes
  std::array<const Condition*, 9> _here{};
  ShapeRows<T> _tests, _gap_tests;
  std::array<Gap, D> _projected; ///< at the point, and along the facet
  int _count = 0;
};

/// @brief Derivatives of a node's row by what a point gives, times the
/// functions that these are tested with.
template <int D, class Law>
class PointSlopes
{
public:
  static constexpr int M = Law::template multiplier_size<D>;

  PointSlopes(const NodeCondition<D, M>& c, const RowAtPoint<D, M>& row)
      : _by_n(row.test * c.by_n), _by_w(row.gap_test * c.by_w),
        _by_elastic(row.test * c.by_elastic), _by_g(row.gap_test * c.by_g),
        _by_coefficient(row.test * c.by_coefficient)
  {
  }

  [[nodiscard]] auto slopes() const
  {
    if constexpr (is_frictional<Law>)
      return LawSlopes<M, D, M, true>{
          _by_n, _by_g, _none, _by_w, _by_elastic, _by_coefficient, _no_rate};
    else
      return LawSlopes<M, D, M, false>{_by_n, _by_g, _none};
  }

private:
  Mat<M, D> _by_n, _by_w, _by_elastic;
  Vec<M> _by_g, _by_coefficient;
  Mat<M, M> _none = Mat<M, M>::Zero();
  Vec<M> _no_rate = Vec<M>::Zero();
};

/// @brief A point with the elastic slip of one of its nodes as what its springs
/// hold, by which the node's row varies.
template <int D, class Law>
[[nodiscard]] HitPoint<D, Law>
with_springs_of(const HitPoint<D, Law>& p, const NodeSprings<D>& springs, int k)
{
  HitPoint<D, Law> at = p;
  at.old.accepted = springs.held(k);
  at.old.spring = springs.turned(p, k);
  return at;
}

/// @brief Call `call(point)` with the point that a node's row varies with.
template <int D, class Law, class Call>
auto at_node(const HitPoint<D, Law>& p, const FacetConditions<D, Law>& nodes,
             int k, Call&& call)
{
  if constexpr (is_frictional<Law>)
    if (nodes.springs().are_there())
      return call(with_springs_of(p, nodes.springs(), k));
  return call(p);
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
    const TargetPart part = Base::target_part(p);
    for (int k = 0; k < nodes.size(); ++k)
    {
      const auto row = nodes.row(e, p, k);
      const PointSlopes<D, Law> by_point(nodes.at(k), row);
      auto varied =
          at_node(p, nodes, k,
                  [&](const Hit& here)
                  {
                    return chain<M>(by_point.slopes(), here, by,
                                    Columns(here, by, at.has_target()));
                  });
      Base::template add_area<M>(e, p, by.dual, row.value, varied);
      UnknownRows<M, D> rows;
      expand<M, D>(at, varied, part, rows);
      add_rows(p.weight * at.scale, k, rows, at);
    }
  }

protected:
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
