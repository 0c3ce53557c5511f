#include "raymortar/dual/dual_term.h"
#include "raymortar/core/error.h"
#include "raymortar/core/sorted.h"
#include "raymortar/element/free_tools.h"
#include "raymortar/mortar/movers.h"

namespace raymortar
{
namespace
{
using Block =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Rows of displacements in the columns of the coefficients of one facet
struct ByCoefficients
{
  Unknowns rows;
  Block block; ///< (rows, nodes times components)
};

/// A matrix of nodes for each component
Block by_component(const Eigen::MatrixXd& nodes, int components)
{
  Block all = Block::Zero(nodes.rows() * components, nodes.cols() * components);
  for (Eigen::Index a = 0; a < nodes.rows(); ++a)
    for (Eigen::Index b = 0; b < nodes.cols(); ++b)
      for (int i = 0; i < components; ++i)
        all(a * components + i, b * components + i) = nodes(a, b);
  return all;
}

Unknowns columns_of(const ContactState& s, const DualRate& rate)
{
  return s.has_tools() ? element_unknowns(rate.slave, no_index, rate.target)
                       : element_unknowns(rate.slave, rate.target);
}

/// Takes blocks of elements in the columns of nodal tractions of single facets,
/// and hands them on in those of the multiplier
class ToMultiplier final : public MatrixSink
{
public:
  ToMultiplier(const ContactState& s, const DualBasis& basis,
               const std::vector<DualFacet>& facets, MatrixSink& sink)
      : _state(s), _basis(basis), _facets(facets), _sink(sink),
        _asked_for(facets.size(), 0), by_facet(facets.size())
  {
  }

  /// Ask for all elements of a facet, as its rates need them
  void ask_for(Index facet) { _asked_for[place(facet)] = 1; }

  [[nodiscard]] bool wants(const Unknowns& columns) const override
  {
    return _sink.wants(columns) or (columns.slave != no_index and
                                    _asked_for[place(columns.slave)] != 0);
  }

  void add(const Unknowns& rows, const Unknowns& columns,
           const double* block) override
  {
    if (columns.multiplier == no_index)
      return _sink.add(rows, columns, block);
    // Blocks of elements, and of facets that are coupled, are square
    const DualFacet& f = _facets[place(columns.multiplier)];
    const Eigen::Index size = size_of(columns);
    Block all = Eigen::Map<const Block>(block, size, size);
    if (f.is_covered)
      transform(f, columns, all);
    _sink.add(rows, columns, all.data());
  }

  /// Number of unknowns
  [[nodiscard]] Eigen::Index size_of(const Unknowns& unknowns) const
  {
    const ContactState& s = _state;
    Eigen::Index size = side() + by_nodes();
    if (unknowns.master != no_index)
      size += s.slave.gdim * s.master.dofs_per_facet();
    if (unknowns.tool != no_index)
      size += freedom_of(s, unknowns.tool).size();
    return size;
  }

private:
  [[nodiscard]] static std::size_t place(Index k)
  {
    return static_cast<std::size_t>(k);
  }
  [[nodiscard]] Eigen::Index side() const
  {
    return _state.slave.gdim * _state.slave.dofs_per_facet();
  }
  [[nodiscard]] Eigen::Index by_nodes() const
  {
    return _basis.spread.rows() * _state.multipliers.components;
  }

  void transform(const DualFacet& f, const Unknowns& columns, Block& all)
  {
    const Block given =
        all.middleCols(side(), by_nodes()) *
        by_component(_basis.to_nodes, _state.multipliers.components);
    all.middleCols(side(), by_nodes()) =
        given * by_component(f.from_nodal(), _state.multipliers.components);
    if (f.varies and not given.isZero(0.0))
      by_facet[place(columns.slave)].push_back(
          {columns, given / _state.multipliers.scale});
  }

  const ContactState& _state;
  const DualBasis& _basis;
  const std::vector<DualFacet>& _facets;
  MatrixSink& _sink;
  std::vector<std::int8_t> _asked_for;

public:
  /// Values given in the columns of coefficients that vary, by facet
  std::vector<std::vector<ByCoefficients>> by_facet;
};

/// Rows of a facet's displacements that hold back what is spread, per
/// coefficient: those of the kernel are m lam, of the law d lam
Block held_back(const ContactState& s, const DualBasis& basis,
                const DualFacet& f)
{
  return by_component(-f.slack() * f.area * basis.rows *
                          Eigen::MatrixXd(basis.spread),
                      s.multipliers.components);
}

/// Functions are made with the sums of nodes, which one zone alone cannot do
void require(const ContactState& s, const std::vector<DualFacet>& facets)
{
  if (facets.size() != static_cast<std::size_t>(s.slave.num_facets()))
    throw Error("a dual multiplier needs the sums of all zones: assemble by a "
                "ContactSystem");
}

/// Node after node, component after component
Eigen::VectorXd flat(const Eigen::MatrixXd& by_node)
{
  const Block rows = by_node;
  return Eigen::Map<const Eigen::VectorXd>(rows.data(), rows.size());
}
} // namespace

DualTerm::DualTerm(const ContactState& s, bool has_moving_segments)
    : _functions(std::make_shared<NodeFunctions>(NodeFunctions{
          FacetTractions(s.multipliers.facet.size() *
                             static_cast<std::size_t>(s.multipliers.components),
                         0.0),
          {}})),
      _mortar(make_nodal_assembler(s, _functions), has_moving_segments),
      _basis(s)
{
}

NodeSums DualTerm::sum_nodes(const ContactState& s,
                             std::span<const std::int8_t> held)
{
  _facets = dual_facets(s, _basis);
  FacetIntegrals tested;
  NodeSums sums =
      dynamic_cast<const NodalAssembler&>(*assembler()).node_sums(s, &tested);
  _functions->gap_tests = dual_gap_tests(s, _basis, _facets, tested, held);
  add_tested_gaps(s, _functions->gap_tests, sums);
  return sums;
}

void DualTerm::take_sums(const ContactState& s)
{
  _functions->tractions = dual_tractions(s, _basis, _facets);
}

void DualTerm::add_needs(const ContactState& s, PatternNeeds& needs) const
{
  _mortar.add_needs(s, needs);
  if (s.has_tools() or not s.moving_segments)
    return;
  // The cover of a facet by one master counts in the rows of all others
  std::vector<std::vector<Index>> masters(
      static_cast<std::size_t>(s.slave.num_facets()));
  const auto on = [&](Index slave) -> std::vector<Index>&
  { return masters[static_cast<std::size_t>(slave)]; };
  for (std::size_t e = 0; e < s.elements.size(); ++e)
    if (s.elements.master[e] != no_index)
      on(s.elements.slave[e]).push_back(s.elements.master[e]);
  for (const Segment& segment : s.segmentation.segments)
  {
    on(segment.slave).push_back(segment.master);
    visit_movers(s.segmentation, segment,
                 [&](Index m) { on(segment.slave).push_back(m); });
  }
  for (Index f = 0; f < s.slave.num_facets(); ++f)
  {
    if (not _facets.empty() and not _facets[static_cast<std::size_t>(f)].varies)
      continue;
    sort_unique(on(f));
    for (const Index first : on(f))
      for (const Index second : on(f))
        if (first != second)
          needs.couplings.push_back({f, first, second});
  }
}

Work DualTerm::residual(const ContactState& s, VectorSink& sink) const
{
  require(s, _facets);
  const Work work = _mortar.residual(s, sink);
  for (Index f = 0; f < s.slave.num_facets(); ++f)
  {
    const DualFacet& facet = _facets[static_cast<std::size_t>(f)];
    if (not facet.is_covered or facet.slack() == 0.0)
      continue;
    const Eigen::VectorXd forces =
        held_back(s, _basis, facet) * flat(dual_coefficients(s, facet, f));
    sink.add({f}, {forces.data(), static_cast<std::size_t>(forces.size())});
  }
  return work;
}

Work DualTerm::tangent(const ContactState& s, MatrixSink& sink) const
{
  require(s, _facets);
  const int M = s.multipliers.components;
  const std::vector<DualRate> rates =
      dual_rates(s, _basis, _facets, _functions->tractions);
  ToMultiplier blocks(s, _basis, _facets, sink);
  for (const DualRate& rate : rates)
    if (sink.wants(columns_of(s, rate)))
      blocks.ask_for(rate.slave);
  const Work work = _mortar.tangent(s, blocks);
  for (Index f = 0; f < s.slave.num_facets(); ++f)
  {
    const DualFacet& facet = _facets[static_cast<std::size_t>(f)];
    const Unknowns own{f, f, no_index};
    if (not facet.is_covered or facet.slack() == 0.0 or not sink.wants(own))
      continue;
    const Block by_lam = s.multipliers.scale * held_back(s, _basis, facet) *
                         by_component(facet.from_nodal(), M);
    sink.add({f}, {no_index, f, no_index}, by_lam.data());
  }
  for (const DualRate& rate : rates)
  {
    const Unknowns columns = columns_of(s, rate);
    if (not sink.wants(columns))
      continue;
    const DualFacet& facet = _facets[static_cast<std::size_t>(rate.slave)];
    const Eigen::Index count = rate.rows.rows() - 1;
    const Block change =
        by_component(facet.inverse, M) * rate.rows.topRows(count);
    for (const ByCoefficients& one :
         blocks.by_facet[static_cast<std::size_t>(rate.slave)])
    {
      const Block block = one.block * change;
      sink.add(one.rows, columns, block.data());
    }
    if (facet.slack() == 0.0)
      continue;
    const Eigen::VectorXd spread =
        flat(_basis.rows * Eigen::MatrixXd(_basis.spread) *
             dual_coefficients(s, facet, rate.slave));
    const Block held =
        held_back(s, _basis, facet) * change + spread * rate.rows.row(count);
    sink.add({rate.slave}, columns, held.data());
  }
  return work;
}
} // namespace raymortar
