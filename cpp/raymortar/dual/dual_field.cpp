#include "raymortar/dual/dual_functions.h"

namespace raymortar
{
namespace
{
template <class Integer>
std::size_t as_size(Integer k)
{
  return static_cast<std::size_t>(k);
}
} // namespace

std::vector<GapTests> dual_gap_tests(const ContactState& s,
                                     const DualBasis& basis,
                                     const std::vector<DualFacet>& facets,
                                     const FacetIntegrals& tested,
                                     std::span<const std::int8_t> held)
{
  using Table =
      Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const std::size_t dofs = as_size(s.slave.dofs_per_facet());
  const Eigen::Index width = 1 + s.slave.gdim;
  const double* from = tested.data();
  std::vector<GapTests> tests(facets.size());
  for (std::size_t f = 0; f < facets.size(); ++f)
  {
    const DualFacet& facet = facets[f];
    const Eigen::Index n = facet.weight.size();
    const Eigen::Map<const Table> integrals(from, n, width);
    from += n * width;
    if (not facet.is_covered)
      continue;
    GapTests& one = tests[f];
    one.from_nodal = facet.from_nodal();
    one.gaps = (facet.inverse * integrals).transpose();
    one.spread = one.gaps * basis.spread * one.from_nodal;
    one.slack = facet.slack();
    one.by_share = slack_by_share(s, facet);
    one.tested = one.gaps * facet.weight.asDiagonal();
    for (std::size_t k = 0; k < as_size(n) and not held.empty(); ++k)
    {
      one.is_plain[k] = held[f * dofs + k] != 0;
      const auto c = static_cast<Eigen::Index>(k);
      if (one.is_plain[k])
        one.tested.col(c) = integrals.row(c).transpose();
    }
  }
  return tests;
}

void add_tested_gaps(const ContactState& s, const std::vector<GapTests>& tests,
                     NodeSums& sums)
{
  const std::size_t n = s.multipliers.per_facet(s.slave.num_facets());
  for (std::size_t f = 0; f < tests.size(); ++f)
  {
    const auto& tested = tests[f].tested;
    const auto nodes = s.multipliers.nodes_of(static_cast<Index>(f), n);
    for (Eigen::Index k = 0; k < tested.cols(); ++k)
    {
      const Index node = nodes[as_size(k)];
      sums.at(node, NodeSum::gap) += tested(0, k);
      for (Eigen::Index i = 1; i < tested.rows(); ++i)
        sums.add(node, NodeVector::slip, as_size(i - 1), tested(i, k));
    }
  }
}

Eigen::MatrixXd dual_coefficients(const ContactState& s, const DualFacet& of,
                                  Index facet)
{
  const Multipliers& m = s.multipliers;
  const auto n = static_cast<std::size_t>(of.weight.size());
  const auto M = static_cast<std::size_t>(m.components);
  Eigen::MatrixXd lam(n, M);
  const auto nodes = m.nodes_of(facet, n);
  for (std::size_t k = 0; k < n; ++k)
    for (std::size_t i = 0; i < M; ++i)
      lam(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(i)) =
          m.value[as_size(nodes[k]) * M + i];
  return of.from_nodal().lazyProduct(lam);
}

FacetTractions dual_tractions(const ContactState& s, const DualBasis& basis,
                              const std::vector<DualFacet>& facets)
{
  FacetTractions values;
  values.reserve(s.multipliers.facet.size() *
                 as_size(s.multipliers.components));
  for (Index f = 0; f < s.slave.num_facets(); ++f)
  {
    const Eigen::MatrixXd nodal =
        basis.to_nodes.lazyProduct(dual_coefficients(s, facets[as_size(f)], f));
    for (Eigen::Index k = 0; k < nodal.rows(); ++k)
      for (Eigen::Index i = 0; i < nodal.cols(); ++i)
        values.push_back(nodal(k, i));
  }
  return values;
}
} // namespace raymortar
