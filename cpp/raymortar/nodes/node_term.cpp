#include "raymortar/nodes/node_term.h"
#include "raymortar/core/error.h"
#include "raymortar/interface/facet_blocks.h"
#include "raymortar/interface/mortar_term.h"
#include "raymortar/nodes/node_conditions.h"

namespace raymortar
{
namespace
{
Unknowns multipliers_of(Index facet) { return {no_index, facet, no_index}; }

/// Sums are gathered over zones and ranks, which one zone alone cannot do
void require_sums(const ContactState& s)
{
  if (s.node_sums == nullptr and s.slave.num_facets() > 0)
    throw Error("a law at nodes needs the sums of all zones: assemble by a "
                "ContactSystem");
}

/// Entries of one item of a table
std::span<const double> part(const std::vector<double>& table, Index item,
                             std::size_t size)
{
  return std::span(table).subspan(static_cast<std::size_t>(item) * size, size);
}

/// The unknowns of a facet's nodes times a matrix of each node
std::vector<double> times(std::span<const Index> nodes, std::size_t M,
                          const std::vector<double>& by_node,
                          std::span<const double> values, std::size_t width)
{
  std::vector<double> product(values.size(), 0.0);
  for (std::size_t k = 0; k < nodes.size(); ++k)
  {
    const auto matrix = part(by_node, nodes[k], M * M);
    for (std::size_t i = 0; i < M; ++i)
      for (std::size_t j = 0; j < M; ++j)
        for (std::size_t c = 0; c < width; ++c)
          product[(k * M + i) * width + c] +=
              matrix[i * M + j] * values[(k * M + j) * width + c];
  }
  return product;
}

void add_tie_sums(const ContactState& s, const std::vector<FacetBlock>& ties,
                  NodeVector what, NodeSums& sums)
{
  const std::size_t n = s.multipliers.per_facet(s.slave.num_facets());
  const auto M = static_cast<std::size_t>(s.multipliers.components);
  const std::size_t size = n * M;
  std::vector<double> lam;
  for (const FacetBlock& tie : ties)
  {
    facet_tractions(s.multipliers, tie.slave, n, lam);
    const auto nodes = s.multipliers.nodes_of(tie.slave, n);
    for (std::size_t k = 0; k < size; ++k)
    {
      double sum = 0.0;
      for (std::size_t j = 0; j < size; ++j)
        sum += tie.block[k * size + j] * lam[j];
      sums.add(nodes[k / M], what, k % M, sum);
    }
  }
}

void add_ties(const ContactState& s, const std::vector<FacetBlock>& ties,
              const std::vector<double>& by_tie, MatrixSink& sink)
{
  const std::size_t n = s.multipliers.per_facet(s.slave.num_facets());
  const auto M = static_cast<std::size_t>(s.multipliers.components);
  const double scale = s.multipliers.scale;
  for (const FacetBlock& tie : ties)
  {
    const Unknowns own = multipliers_of(tie.slave);
    if (not sink.wants(own))
      continue;
    std::vector<double> block = times(s.multipliers.nodes_of(tie.slave, n), M,
                                      by_tie, tie.block, n * M);
    for (double& value : block)
      value *= scale * scale;
    sink.add(own, own, block.data());
  }
}
} // namespace

std::vector<FacetBlock> NodeTerm::held_ties() const
{
  std::vector<FacetBlock> ties = _damping.acting();
  for (FacetBlock& one : ties)
    for (double& value : one.block)
      value *= _damping.compliance();
  return ties;
}

std::vector<FacetBlock> NodeTerm::rim_ties(const ContactState& s,
                                           RimSide side) const
{
  std::vector<FacetBlock> ties = cover_blocks(s, _cover.data(), side);
  std::erase_if(ties, [&](const FacetBlock& one)
                { return coverage_of(s, one.slave) != Coverage::partly; });
  return ties;
}

std::vector<double> NodeTerm::own_sums(const ContactState& s) const
{
  NodeSums sums = _points(s, _damping.held_nodes());
  const std::size_t n = s.multipliers.per_facet(s.slave.num_facets());
  const auto dofs = static_cast<std::size_t>(s.slave.dofs_per_facet());
  const auto d = static_cast<std::size_t>(s.slave.gdim);
  for (Index f = 0; f < s.slave.num_facets(); ++f)
  {
    // Test functions of a facet have one mean  [theory (4.23)]
    const double whole =
        s.points.whole[static_cast<std::size_t>(f)] / static_cast<double>(n);
    const auto nodes = s.multipliers.nodes_of(f, n);
    for (std::size_t k = 0; k < n; ++k)
    {
      const double gamma =
          s.gamma.nodal[static_cast<std::size_t>(f) * dofs + k];
      sums.at(nodes[k], NodeSum::whole) += whole;
      sums.at(nodes[k], NodeSum::whole_gamma) += whole * gamma;
      sums.at(nodes[k], NodeSum::facets) += 1.0;
      if (not s.traction_old.empty())
        for (std::size_t i = 0; i < d; ++i)
          sums.add(
              nodes[k], NodeVector::past, i,
              s.traction_old
                  .nodal[(static_cast<std::size_t>(f) * dofs + k) * d + i]);
    }
  }
  add_tie_sums(s, held_ties(), NodeVector::held, sums);
  add_tie_sums(s, rim_ties(s, RimSide::beyond), NodeVector::outer, sums);
  add_tie_sums(s, rim_ties(s, RimSide::within), NodeVector::inner, sums);
  return {sums.values().begin(), sums.values().end()};
}

void NodeTerm::put_sums(std::span<const double> sums, ContactState& s) const
{
  s.node_sums = std::make_shared<NodeSums>(sums, s.slave.gdim);
}

std::optional<Springs> NodeTerm::accepted_springs(const ContactState& s) const
{
  return Springs{accepted_ties(s), elastic_slip_of_nodes(s)};
}

Work NodeTerm::residual(const ContactState& s, VectorSink& sink) const
{
  require_sums(s);
  const std::size_t n = s.multipliers.per_facet(s.slave.num_facets());
  const auto M = static_cast<std::size_t>(s.multipliers.components);
  const NodeRows rows = node_rows(s);
  std::vector<double> values;
  for (Index f = 0; f < s.slave.num_facets(); ++f)
  {
    values.clear();
    for (const Index node : s.multipliers.nodes_of(f, n))
    {
      const double share =
          s.multipliers.scale / s.node_sums->at(node, NodeSum::facets);
      for (const double value : part(rows.row, node, M))
        values.push_back(share * value);
    }
    sink.add(multipliers_of(f), values);
  }
  return {};
}

Work NodeTerm::tangent(const ContactState& s, MatrixSink& sink) const
{
  require_sums(s);
  const std::size_t n = s.multipliers.per_facet(s.slave.num_facets());
  const auto M = static_cast<std::size_t>(s.multipliers.components);
  const double scale = s.multipliers.scale;
  const NodeRows rows = node_rows(s);
  const std::size_t size = n * M;
  std::vector<double> block;
  for (Index f = 0; f < s.slave.num_facets(); ++f)
  {
    if (not sink.wants(multipliers_of(f)))
      continue;
    block.assign(size * size, 0.0);
    const auto nodes = s.multipliers.nodes_of(f, n);
    for (std::size_t k = 0; k < n; ++k)
    {
      const double share =
          scale * scale / s.node_sums->at(nodes[k], NodeSum::facets);
      const auto own = part(rows.by_lam, nodes[k], M * M);
      for (std::size_t i = 0; i < M * M; ++i)
        block[(k * M + i / M) * size + k * M + i % M] = share * own[i];
    }
    sink.add(multipliers_of(f), multipliers_of(f), block.data());
  }
  add_ties(s, held_ties(), rows.by_held, sink);
  add_rim(s, RimSide::beyond, rows.by_outer, sink);
  add_rim(s, RimSide::within, rows.by_inner, sink);
  return {};
}

void NodeTerm::add_rim(const ContactState& s, RimSide side,
                       const std::vector<double>& by_tie,
                       MatrixSink& sink) const
{
  add_ties(s, rim_ties(s, side), by_tie, sink);
  if (s.moving_segments)
    add_shares(s, side, by_tie, sink);
}

/// The share that is covered varies with the segments  [theory (5.11)]
void NodeTerm::add_shares(const ContactState& s, RimSide side,
                          const std::vector<double>& by_tie,
                          MatrixSink& sink) const
{
  const std::size_t n = s.multipliers.per_facet(s.slave.num_facets());
  const auto M = static_cast<std::size_t>(s.multipliers.components);
  std::vector<double> block;
  for (const ShareSlope& slope : share_slopes(s, _cover.data(), side))
  {
    const Unknowns columns = columns_of(s, slope);
    if (not sink.wants(columns))
      continue;
    block.clear();
    for (const double change : times(s.multipliers.nodes_of(slope.slave, n), M,
                                     by_tie, slope.change, 1))
      for (const double share : slope.share)
        block.push_back(-s.multipliers.scale * change * share);
    sink.add(multipliers_of(slope.slave), columns, block.data());
  }
}

void NodeTerms::prepare(ContactState& s) const
{
  s.condition = Condition::nodes;
}

std::vector<std::unique_ptr<Term>> NodeTerms::make(const ContactState& s,
                                                   bool moves) const
{
  Law law = make_law(s, moves);
  std::vector<std::unique_ptr<Term>> terms;
  terms.push_back(std::move(law.term));
  terms.push_back(std::make_unique<NodeTerm>(s, std::move(law.sums)));
  return terms;
}

NodeTerms::Law NodeTerms::make_law(const ContactState& s, bool moves) const
{
  auto term = std::make_unique<MortarTerm>(make_nodal_assembler(s), moves);
  const auto& points = dynamic_cast<const NodalAssembler&>(*term->assembler());
  return {std::move(term),
          [&points](const ContactState& now, std::span<const std::int8_t>)
          { return points.node_sums(now, nullptr); }};
}
} // namespace raymortar
