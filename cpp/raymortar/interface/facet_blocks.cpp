#include "raymortar/interface/facet_blocks.h"

namespace raymortar
{
void facet_tractions(const Multipliers& m, Index facet, std::size_t nodes,
                     std::vector<double>& values)
{
  const auto width = static_cast<std::size_t>(m.components);
  values.clear();
  for (std::size_t k = 0; k < nodes * width; ++k)
  {
    const Index node =
        m.facet[static_cast<std::size_t>(facet) * nodes + k / width];
    values.push_back(
        m.value[static_cast<std::size_t>(node) * width + k % width]);
  }
}

void add_facet_residuals(const ContactState& s,
                         std::span<const FacetBlock> facets, double factor,
                         VectorSink& sink)
{
  const Multipliers& m = s.multipliers;
  std::vector<double> lam, change;
  for (const FacetBlock& facet : facets)
  {
    facet_tractions(m, facet.slave, m.per_facet(s.slave.num_facets()), lam);
    const std::size_t n = lam.size();
    change.assign(n, 0.0);
    for (std::size_t k = 0; k < n * n; ++k)
      change[k / n] -= factor * m.scale * facet.block[k] * lam[k % n];
    sink.add({no_index, facet.slave, no_index}, change);
  }
}

void add_facet_tangents(const ContactState& s,
                        std::span<const FacetBlock> facets, double factor,
                        MatrixSink& sink)
{
  const double scale = s.multipliers.scale;
  std::vector<double> block;
  for (const FacetBlock& facet : facets)
  {
    const Unknowns own{no_index, facet.slave, no_index};
    if (not sink.wants(own))
      continue;
    block = facet.block;
    for (double& value : block)
      value *= -factor * scale * scale;
    sink.add(own, own, block.data());
  }
}
} // namespace raymortar
