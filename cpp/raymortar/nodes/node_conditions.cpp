#include "raymortar/nodes/node_conditions.h"
#include "raymortar/element/extension.h"
#include "raymortar/nodes/choose_nodal_law.h"

namespace raymortar
{
namespace
{
/// The sum of all ties of a node's multiplier  [theory (4.24), (4.34)]
template <int D>
struct NodeTie
{
  double beyond; ///< 1: the rim has not reached the node; 0: it has passed it
  Vec<D> value;  ///< sum
  Vec<D> by_area;

  NodeTie(const NodeSums& sums, Index node)
  {
    // A quarter is covered as soon as a corner of the master has passed the
    // node
    const double full = 0.25 * sums.at(node, NodeSum::whole);
    const double left =
        std::max(0.0, 1.0 - sums.at(node, NodeSum::area) / full);
    beyond = left * left;
    const Vec<D> inner = sums.at<D>(node, NodeVector::inner);
    const Vec<D> more = sums.at<D>(node, NodeVector::outer) - inner;
    value = sums.at<D>(node, NodeVector::held) + inner + beyond * more;
    by_area = -2.0 * left / full * more;
  }
};

/// Means around a node, and its multiplier
template <int D, int M>
struct NodeState : FrictionState<D, M>
{
  double area;
  double whole;  ///< area around the node, covered or not
  double length; ///< of the sum of normals
  NodeTie<D> tie;
  Mat<D, D> unfelt = Mat<D, D>::Zero(); ///< part of the multiplier
  bool is_elastic = false;
  Vec<D> elastic = Vec<D>::Zero(); ///< times gamma, part of the spring

  NodeState(const ContactState& s, Index node) : tie(*s.node_sums, node)
  {
    const NodeSums& sums = *s.node_sums;
    area = sums.at(node, NodeSum::area);
    const Vec<D> normals = sums.at<D>(node, NodeVector::normal);
    length = normals.norm();
    this->n = normals / length;
    this->lam = Eigen::Map<const Vec<M>>(s.multipliers.value.data() +
                                         static_cast<std::size_t>(node) * M);
    // Over the whole area, so that gamma falls with the covered share: the
    // row of an open node is then continuous where its cover ends
    whole = sums.at(node, NodeSum::whole);
    this->gamma = sums.at(node, NodeSum::gamma) / whole;
    this->touch = sums.at(node, NodeSum::touch) / area;
    this->spring.setZero();
    is_elastic = s.has_elastic_slip();
    if (is_elastic) // which tells all tractions
    {
      elastic = this->gamma / area * sums.at<D>(node, NodeVector::elastic);
      this->spring = elastic;
    }
    else
      set_unfelt(s, node);
    Vec<D> slips = sums.at<D>(node, NodeVector::slip);
    double taken = tie.value[0];
    if constexpr (M == D)
    {
      taken = this->n.dot(tie.value);
      slips += tie.value;
    }
    this->g = (sums.at(node, NodeSum::gap) - taken) / area;
    // The tie takes up slip as it takes up gap: what it took before is none
    slips -=
        sums.at<D>(node, NodeVector::past) / sums.at(node, NodeSum::facets);
    this->w = slips / area;
    if (s.friction)
      set_friction(s, node);
  }

private:
  /// If no equilibrium tells the multiplier, friction carries on from the
  /// accepted one  [theory (5.22)]
  void set_unfelt(const ContactState& s, Index node)
  {
    using Rows = Eigen::Matrix<double, D, D, Eigen::RowMajor>;
    const Multipliers& m = s.multipliers;
    if constexpr (M == D)
      if (not m.unfelt.empty())
      {
        const auto k = static_cast<std::size_t>(node);
        unfelt = Eigen::Map<const Rows>(m.unfelt.data() + k * D * D);
        const Eigen::Map<const Vec<D>> accepted(m.accepted.data() + k * D);
        this->spring = unfelt * (accepted - this->lam);
      }
  }

  void set_friction(const ContactState& s, Index node)
  {
    this->friction = *s.friction;
    if (not s.friction_coefficient.empty())
      this->friction = with_coefficient(
          this->friction, s.node_sums->at(node, NodeSum::coefficient) / area);
    else if (not s.node_bounds.empty())
      this->friction = s.node_bounds[static_cast<std::size_t>(node)];
  }
};

/// A node that hits nothing: its multiplier is zero
template <int D, int M>
NodeCondition<D, M> without_hit(const ContactState& s, Index node)
{
  NodeCondition<D, M> c;
  const double whole = s.node_sums->at(node, NodeSum::whole);
  const double weight =
      whole * whole / s.node_sums->at(node, NodeSum::whole_gamma);
  c.row =
      -weight * Eigen::Map<const Vec<M>>(s.multipliers.value.data() +
                                         static_cast<std::size_t>(node) * M);
  c.by_lam.diagonal().setConstant(-weight);
  return c;
}

/// In place of the law, C = gamma (g n - T_n w): its row is the integral of gap
/// and slip
template <int D, int M, class Response>
void measure(const NodeState<D, M>& at, Response& r)
{
  r.C_lam.setZero();
  r.C_n.setZero();
  if constexpr (M == 1)
  {
    r.C[0] = at.gamma * at.g;
    r.C_g[0] = at.gamma;
  }
  else
  {
    r.C = at.gamma * at.g * at.n;
    r.C_g = at.gamma * at.n;
    r.C_n.diagonal().setConstant(at.gamma * at.g);
  }
  if constexpr (requires { r.C_w; })
  {
    const double along = at.n.dot(at.w);
    r.C -= at.gamma * (at.w - along * at.n);
    r.C_n += at.gamma * at.n * at.w.transpose();
    add_to_diagonal(r.C_n, at.gamma * along);
    r.C_w = at.gamma * at.n * at.n.transpose();
    add_to_diagonal(r.C_w, -at.gamma);
    r.C_spring.setZero();
    r.C_coefficient.setZero();
    r.C_rate.setZero();
  }
}

/// The law at a node, linearised where `node_changes` tell: with the changes y
/// of the state s it is C(s + y) - C'(s + y) y, with derivatives at s + y
template <class Law, int D, int M>
auto law_at(const ContactState& s, Index node, const NodeState<D, M>& at)
{
  const NodeChanges& changes = s.node_changes;
  if (changes.values.empty())
  {
    auto r = Law::template evaluate<D>(at);
    if (changes.measures)
      measure(at, r);
    return r;
  }
  const Eigen::Map<const Vec<M + D>> change(
      changes.values.data() + static_cast<std::size_t>(node) * (M + D));
  const Vec<M> lam = change.template head<M>();
  const Vec<D> gap_and_slip = change.template tail<D>();
  const double g = at.n.dot(gap_and_slip);
  const Vec<D> w = g * at.n - gap_and_slip;
  NodeState<D, M> there = at;
  there.lam += lam;
  there.g += g;
  there.w += w;
  if constexpr (M == D)
  {
    there.spring -= at.unfelt * lam;
    there.friction = friction_at<D>(there, at);
  }
  auto r = Law::template evaluate<D>(there);
  r.C -= r.C_lam * lam + r.C_g * g;
  if constexpr (requires { r.C_w; })
    r.C -= r.C_w * w - r.C_spring * (at.unfelt * lam);
  return r;
}

template <int D, int M, class Response>
void set_derivatives(const NodeState<D, M>& at, const Response& r,
                     double coefficient, NodeCondition<D, M>& c)
{
  const Mat<D, D> turn =
      (Mat<D, D>::Identity() - at.n * at.n.transpose()) / at.length;
  c.by_lam = at.area / at.gamma * r.C_lam;
  c.by_g = r.C_g / at.gamma;
  c.by_n = at.area / at.gamma * r.C_n * turn;
  Vec<M> by_size = at.g * r.C_g;   // by the logarithm of gaps and slips
  Vec<M> by_gamma = by_size - r.C; // by that of gamma
  if constexpr (M == D)
  {
    c.by_n -= c.by_g * (at.tie.value.transpose() * turn);
    c.by_tie = -c.by_g * at.n.transpose();
  }
  else
    c.by_tie = -c.by_g;
  if constexpr (requires { r.C_w; })
  {
    c.by_lam -= at.area / at.gamma * r.C_spring * at.unfelt;
    c.by_w = r.C_w / at.gamma;
    c.by_tie += c.by_w;
    c.by_coefficient = r.C_coefficient / at.gamma;
    by_gamma += r.C_w * at.w - r.C_rate;
    by_size += r.C_w * at.w + coefficient * r.C_coefficient;
    if (at.is_elastic)
    {
      c.by_elastic = r.C_spring;
      by_gamma += r.C_spring * at.elastic;
      by_size += r.C_spring * at.elastic;
    }
  }
  c.by_gamma = at.area / (at.whole * at.gamma * at.gamma) * by_gamma;
  c.by_area =
      (r.C - by_size) / at.gamma + c.by_tie * at.tie.by_area.template head<M>();
}
} // namespace

template <int D, class Law>
NodeCondition<D, Law::template multiplier_size<D>>
node_condition(const ContactState& s, Index node)
{
  constexpr int M = Law::template multiplier_size<D>;
  if (s.node_sums->at(node, NodeSum::area) <= 0.0)
    return without_hit<D, M>(s, node);
  const NodeState<D, M> at(s, node);
  const auto r = law_at<Law>(s, node, at);
  NodeCondition<D, M> c;
  c.status = r.status;
  c.p = r.p;
  c.g = at.g;
  c.gamma = at.gamma;
  c.normal = at.n;
  if (s.friction)
    c.slip = at.w - at.n.dot(at.w) * at.n;
  if constexpr (M == D)
    if (at.is_elastic)
    {
      const Vec<D> t = at.lam + r.C;
      c.elastic_slip = (r.held - (t - at.n.dot(t) * at.n)) / at.gamma;
    }
  c.beyond = at.tie.beyond;
  c.row = at.area / at.gamma * r.C;
  const bool has_field = not s.friction_coefficient.empty();
  const double coefficient =
      has_field ? s.node_sums->at(node, NodeSum::coefficient) / at.area : 0.0;
  set_derivatives<D, M>(at, r, coefficient, c);
  return c;
}

namespace
{
/// Call visit(condition) for all nodes in their order, whatever the law
template <class Visit>
void for_each_condition(const ContactState& s, Visit&& visit)
{
  const auto with = [&]<int D>()
  {
    with_nodal_law(s,
                   [&]<class Law>()
                   {
                     for (const auto& c :
                          node_conditions<D, typename Law::AtNodes>(s))
                       visit(c);
                   });
  };
  s.slave.gdim == 2 ? with.template operator()<2>()
                    : with.template operator()<3>();
}

template <class Matrix>
void append(const Matrix& m, std::vector<double>& values)
{
  for (Eigen::Index i = 0; i < m.rows(); ++i)
    for (Eigen::Index j = 0; j < m.cols(); ++j)
      values.push_back(m(i, j));
}

template <int D>
std::vector<double> all_ties(const ContactState& s)
{
  const std::size_t n = s.multipliers.per_facet(s.slave.num_facets());
  const auto dofs = static_cast<std::size_t>(s.slave.dofs_per_facet());
  const auto facets = static_cast<std::size_t>(s.slave.num_facets());
  std::vector<double> field(facets * dofs * D, 0.0);
  for (std::size_t f = 0; f < facets; ++f)
    for (std::size_t k = 0; k < n; ++k)
    {
      const Index node = s.multipliers.facet[f * n + k];
      if (s.node_sums->at(node, NodeSum::area) > 0.0)
        Eigen::Map<Vec<D>>(field.data() + (f * dofs + k) * D) =
            NodeTie<D>(*s.node_sums, node).value;
    }
  return field;
}
} // namespace

SpringPoints elastic_slip_of_nodes(const ContactState& s)
{
  SpringPoints points;
  if (not s.has_elastic_slip())
    return points;
  std::vector<double> slips;
  for_each_condition(s, [&](const auto& c) { append(c.elastic_slip, slips); });
  const std::size_t n = s.multipliers.per_facet(s.slave.num_facets());
  const auto d = static_cast<std::size_t>(s.slave.gdim);
  const std::vector<Vec<2>> places =
      node_places(s.slave.shape, s.multipliers.degree);
  points.first.push_back(0);
  for (Index f = 0; f < s.slave.num_facets(); ++f)
  {
    const auto nodes = s.multipliers.nodes_of(f, n);
    for (std::size_t k = 0; k < n; ++k)
    {
      const auto node = static_cast<std::size_t>(nodes[k]);
      points.xi.push_back(places[k]);
      points.area.push_back(1.0);
      for (std::size_t i = 0; i < d; ++i)
        points.rest.push_back(slips[node * d + i]);
    }
    points.first.push_back(points.xi.size());
  }
  return points;
}

std::vector<double> accepted_ties(const ContactState& s)
{
  return s.slave.gdim == 2 ? all_ties<2>(s) : all_ties<3>(s);
}

NodeRows node_rows(const ContactState& s)
{
  NodeRows rows;
  for_each_condition(s,
                     [&](const auto& c)
                     {
                       append(c.row, rows.row);
                       append(c.by_lam, rows.by_lam);
                       append(c.by_tie, rows.by_held);
                       append((c.beyond * c.by_tie).eval(), rows.by_outer);
                       append(((1.0 - c.beyond) * c.by_tie).eval(),
                              rows.by_inner);
                     });
  return rows;
}

NodeResults node_results(const ContactState& s)
{
  NodeResults r;
  for_each_condition(s,
                     [&](const auto& c)
                     {
                       r.status.push_back(c.status);
                       r.gap.push_back(c.g);
                       r.gamma.push_back(c.gamma);
                       r.pressure.push_back(c.p);
                       append(c.normal, r.normal);
                       append(c.slip, r.slip);
                     });
  return r;
}
template NodeCondition<2, 1>
node_condition<2, NormalAugmentedLagrangian>(const ContactState&, Index);
template NodeCondition<3, 1>
node_condition<3, NormalAugmentedLagrangian>(const ContactState&, Index);
template NodeCondition<2, 2>
node_condition<2, VectorAugmentedLagrangian>(const ContactState&, Index);
template NodeCondition<3, 3>
node_condition<3, VectorAugmentedLagrangian>(const ContactState&, Index);
template NodeCondition<2, 2>
node_condition<2, FrictionalAugmentedLagrangian>(const ContactState&, Index);
template NodeCondition<3, 3>
node_condition<3, FrictionalAugmentedLagrangian>(const ContactState&, Index);
} // namespace raymortar
