#include "raymortar/element/node_conditions.h"
#include "raymortar/element/choose_law.h"

namespace raymortar
{
namespace
{
/// Means around a node, and its multiplier
template <int D, int M>
struct NodeState : FrictionState<D, M>
{
  double area;
  double length; ///< of the sum of normals
  Vec<M> tie;    ///< sum

  NodeState(const ContactState& s, Index node)
  {
    const NodeSums& sums = s.node_sums;
    area = sums.at(node, NodeSum::area);
    const Vec<D> normals = sums.at<D>(node, NodeVector::normal);
    length = normals.norm();
    this->n = normals / length;
    tie = sums.at<D>(node, NodeVector::tie).template head<M>();
    this->lam = Eigen::Map<const Vec<M>>(s.multipliers.value.data() +
                                         static_cast<std::size_t>(node) * M);
    this->gamma = sums.at(node, NodeSum::gamma) / area;
    this->touch = sums.at(node, NodeSum::touch) / area;
    this->spring.setZero();
    Vec<D> slips = sums.at<D>(node, NodeVector::slip);
    double taken = tie[0];
    if constexpr (M == D)
    {
      taken = this->n.dot(tie);
      slips += tie;
    }
    this->g = (sums.at(node, NodeSum::gap) - taken) / area;
    this->w = slips / area;
    if (s.friction)
      set_friction(s, node);
  }

private:
  void set_friction(const ContactState& s, Index node)
  {
    this->friction = *s.friction;
    if (not s.friction_coefficient.empty())
      this->friction = with_coefficient(
          this->friction, s.node_sums.at(node, NodeSum::coefficient) / area);
    else if (not s.node_bounds.empty())
      this->friction = s.node_bounds[static_cast<std::size_t>(node)];
  }
};

/// A node that hits nothing: its multiplier is zero
template <int D, int M>
NodeCondition<D, M> without_hit(const ContactState& s, Index node)
{
  NodeCondition<D, M> c;
  const double whole = s.node_sums.at(node, NodeSum::whole);
  const double weight =
      whole * whole / s.node_sums.at(node, NodeSum::whole_gamma);
  c.row =
      -weight * Eigen::Map<const Vec<M>>(s.multipliers.value.data() +
                                         static_cast<std::size_t>(node) * M);
  c.by_lam.diagonal().setConstant(-weight);
  return c;
}

template <int D, int M, class Response>
void set_derivatives(const NodeState<D, M>& at, const Response& r,
                     double coefficient, NodeCondition<D, M>& c)
{
  const double gamma = at.gamma;
  const Mat<D, D> turn =
      (Mat<D, D>::Identity() - at.n * at.n.transpose()) / at.length;
  c.by_lam = at.area / gamma * r.C_lam;
  c.by_g = r.C_g / gamma;
  c.by_n = at.area / gamma * r.C_n * turn;
  Vec<M> by_size = at.g * r.C_g; // by the logarithm of gaps and slips
  Vec<M> by_gamma = by_size;
  if constexpr (M == D)
  {
    c.by_n -= c.by_g * (at.tie.transpose() * turn);
    c.by_tie = -c.by_g * at.n.transpose();
  }
  else
    c.by_tie = -c.by_g;
  if constexpr (requires { r.C_w; })
  {
    c.by_w = r.C_w / gamma;
    c.by_tie += c.by_w;
    c.by_coefficient = r.C_coefficient / gamma;
    by_size += r.C_w * at.w;
    by_gamma = by_size - r.C_rate;
    by_size += coefficient * r.C_coefficient;
  }
  c.by_gamma = (by_gamma - r.C) / (gamma * gamma);
  c.by_area = (2.0 * r.C - by_size - by_gamma) / gamma;
}
} // namespace

template <int D, class Law>
NodeCondition<D, Law::template multiplier_size<D>>
node_condition(const ContactState& s, Index node)
{
  constexpr int M = Law::template multiplier_size<D>;
  if (s.node_sums.at(node, NodeSum::area) <= 0.0)
    return without_hit<D, M>(s, node);
  const NodeState<D, M> at(s, node);
  const auto r = Law::template evaluate<D>(at);
  NodeCondition<D, M> c;
  c.status = r.status;
  c.p = r.p;
  c.g = at.g;
  c.gamma = at.gamma;
  c.normal = at.n;
  if (s.friction)
    c.slip = at.w - at.n.dot(at.w) * at.n;
  c.row = at.area / at.gamma * r.C;
  const bool has_field = not s.friction_coefficient.empty();
  const double coefficient =
      has_field ? s.node_sums.at(node, NodeSum::coefficient) / at.area : 0.0;
  set_derivatives<D, M>(at, r, coefficient, c);
  if (not has_field)
    c.by_coefficient.setZero();
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
} // namespace

NodeRows node_rows(const ContactState& s)
{
  NodeRows rows;
  for_each_condition(s,
                     [&](const auto& c)
                     {
                       append(c.row, rows.row);
                       append(c.by_lam, rows.by_lam);
                       append(c.by_tie, rows.by_tie);
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
