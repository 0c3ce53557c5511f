// The law at multiplier nodes: one law a node, of the means around it.
#pragma once

#include "raymortar/element/assembler.h"
#include "raymortar/nodes/nodal.h"
#include "raymortar/nodes/node_sums.h"

namespace raymortar
{
/// @brief The row of a node, A/gamma C, and its derivatives by the sums it is
/// made of  [theory (4.25)].
template <int D, int M>
struct NodeCondition
{
  ContactStatus status = ContactStatus::none;
  double p = 0.0; ///< normal traction of the law, <= 0
  double g = 0.0; ///< mean gap with the offset, less what the tie takes
  double gamma = 0.0;
  double beyond = 0.0; ///< share of the tie that holds beyond the rim
  Vec<D> normal = Vec<D>::Zero(); ///< of the law's frame
  Vec<D> slip = Vec<D>::Zero();   ///< along the surface
  Vec<D> elastic_slip =
      Vec<D>::Zero(); ///< of the step's end, along the traction
  Vec<M> row = Vec<M>::Zero();
  Mat<M, M> by_lam = Mat<M, M>::Zero();
  Mat<M, D> by_n = Mat<M, D>::Zero();
  Vec<M> by_g = Vec<M>::Zero();
  Mat<M, D> by_w = Mat<M, D>::Zero();
  Mat<M, D> by_elastic = Mat<M, D>::Zero(); ///< by the accepted elastic slip
  Mat<M, M> by_tie = Mat<M, M>::Zero();
  Vec<M> by_coefficient = Vec<M>::Zero();
  Vec<M> by_gamma = Vec<M>::Zero();
  Vec<M> by_area = Vec<M>::Zero();
};

/// @brief The law at one node.
/// @tparam Law For points, with a multiplier
template <int D, class Law>
[[nodiscard]] NodeCondition<D, Law::template multiplier_size<D>>
node_condition(const ContactState& s, Index node);

/// @brief The same at all nodes of a zone.
template <int D, class Law>
[[nodiscard]] std::vector<NodeCondition<D, Law::template multiplier_size<D>>>
node_conditions(const ContactState& s)
{
  std::vector<NodeCondition<D, Law::template multiplier_size<D>>> all;
  const auto nodes = static_cast<Index>(s.multipliers.row.size());
  if (s.node_sums == nullptr) // not known yet
  {
    all.resize(s.multipliers.row.size());
    return all;
  }
  all.reserve(s.multipliers.row.size());
  for (Index node = 0; node < nodes; ++node)
    all.push_back(node_condition<D, Law>(s, node));
  return all;
}

/// @brief The same whatever the law: what nodes add to the rows of their own
/// multipliers.
struct NodeRows
{
  std::vector<double> row;      ///< (nodes, components)
  std::vector<double> by_lam;   ///< (nodes, components, components)
  std::vector<double> by_held;  ///< (nodes, components, components)
  std::vector<double> by_outer; ///< (nodes, components, components)
  std::vector<double> by_inner; ///< (nodes, components, components)
};
[[nodiscard]] NodeRows node_rows(const ContactState& s);

/// @brief The law's results at its nodes.
struct NodeResults
{
  std::vector<ContactStatus> status;
  std::vector<double> gap;      ///< mean, with the offset. Length
  std::vector<double> gamma;    ///< mean. Traction per length
  std::vector<double> pressure; ///< normal traction of the law, <= 0
  std::vector<double> normal;   ///< of the law's frame, (nodes, gdim)
  std::vector<double> slip;     ///< mean along the surface, (nodes, gdim)
};
[[nodiscard]] NodeResults node_results(const ContactState& s);

/// @brief Elastic slip at the nodes, as the `spring_points` of the next step: a
/// point for each node of a facet. Of a law without it, nothing.
[[nodiscard]] SpringPoints elastic_slip_of_nodes(const ContactState& s);

/// @brief What ties are at the nodes, as the field `traction_old` of the next
/// step; with friction only.
[[nodiscard]] std::vector<double> accepted_ties(const ContactState& s);
} // namespace raymortar
