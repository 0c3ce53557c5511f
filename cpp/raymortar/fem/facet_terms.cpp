#include "raymortar/fem/facet_terms.h"
#include "raymortar/fem/facet_dofs.h"
#include "raymortar/fem/rows.h"
#include <numeric>

namespace raymortar
{
namespace
{
/// Global rows of a slave facet's multipliers, node after node
void multiplier_rows(const Zone& zone, Index facet, std::vector<PetscInt>& rows)
{
  element_rows(zone, facet, no_index, Constrained::left_out, rows);
  const Surface& slave = zone.state().slave;
  rows.erase(rows.begin(), rows.begin() + slave.dofs_per_facet() * slave.gdim);
}

/// Tractions of a slave facet, in the order of its rows
void facet_tractions(const Multipliers& m, Index facet, std::size_t unknowns,
                     std::vector<double>& values)
{
  const std::size_t width = m.components;
  const std::size_t nodes = unknowns / width;
  values.clear();
  for (std::size_t k = 0; k < unknowns; ++k)
  {
    const Index node = m.facet[facet * nodes + k / width];
    values.push_back(m.value[node * width + k % width]);
  }
}

/// What acts on multipliers besides the law, facet by facet, residual
void add_residual_of(const Zone& zone, std::span<const FacetBlock> facets,
                     PetscVector b)
{
  const Multipliers& m = zone.state().multipliers;
  std::vector<PetscInt> rows;
  std::vector<double> lam, change;
  for (const FacetBlock& facet : facets)
  {
    multiplier_rows(zone, facet.slave, rows);
    const std::size_t n = rows.size();
    facet_tractions(m, facet.slave, n, lam);
    change.assign(n, 0.0);
    for (std::size_t k = 0; k < n * n; ++k)
      change[k / n] -= m.scale * facet.block[k] * lam[k % n];
    check(VecSetValues(b, static_cast<PetscInt>(n), rows.data(), change.data(),
                       ADD_VALUES),
          "VecSetValues");
  }
}

/// The same, tangent: its entries are among those of the facet's own block
void add_tangent_of(const Zone& zone, std::span<const FacetBlock> facets,
                    PetscMatrix A)
{
  const double scale = zone.state().multipliers.scale;
  std::vector<PetscInt> rows;
  std::vector<double> block;
  for (const FacetBlock& facet : facets)
  {
    multiplier_rows(zone, facet.slave, rows);
    block = facet.block;
    for (double& value : block)
      value *= -scale * scale;
    const auto n = static_cast<PetscInt>(rows.size());
    check(MatSetValues(A, n, rows.data(), n, rows.data(), block.data(),
                       ADD_VALUES),
          "MatSetValues");
  }
}

/// Global rows of the displacements that a covered share depends on
void share_rows(const Zone& zone, const ShareSlope& slope,
                std::vector<PetscInt>& rows)
{
  std::vector<PetscInt> slave;
  element_rows(zone, slope.slave, no_index, Constrained::left_out, slave);
  slave.resize(slope.share.size() / 2);
  master_rows(zone, slope.master, Constrained::left_out, rows);
  rows.insert(rows.begin(), slave.begin(), slave.end());
}

/// How they vary with the covered shares
void add_share_slopes(const Zone& zone, PetscMatrix A)
{
  const ContactState& s = zone.state();
  if (not s.moving_segments)
    return;
  std::vector<PetscInt> rows, columns;
  std::vector<double> block;
  for (const ShareSlope& slope : share_slopes(s, zone.cover()))
  {
    multiplier_rows(zone, slope.slave, rows);
    share_rows(zone, slope, columns);
    block.clear();
    for (const double change : slope.change)
      for (const double share : slope.share)
        block.push_back(s.multipliers.scale * change * share);
    check(MatSetValues(A, static_cast<PetscInt>(rows.size()), rows.data(),
                       static_cast<PetscInt>(columns.size()), columns.data(),
                       block.data(), ADD_VALUES),
          "MatSetValues");
  }
}

} // namespace

void add_facet_residuals(Zone& zone, PetscVector b)
{
  add_residual_of(zone, zone.held_facets(), b);
  add_residual_of(zone, cover_blocks(zone.state(), zone.cover()), b);
}

void add_facet_tangents(Zone& zone, PetscMatrix A)
{
  add_tangent_of(zone, zone.held_facets(), A);
  add_tangent_of(zone, cover_blocks(zone.state(), zone.cover()), A);
  add_share_slopes(zone, A);
}

void lift_facet_tangents(const Zone& zone, PetscVector b,
                         std::span<const double> slave,
                         std::span<const double> master, double alpha)
{
  const ContactState& s = zone.state();
  if (not s.moving_segments)
    return;
  std::vector<PetscInt> rows;
  std::vector<double> increment, change;
  for (const ShareSlope& slope : share_slopes(s, zone.cover()))
  {
    increment.clear();
    append_values(s.slave, slope.slave, slave, increment);
    append_values(s.master, slope.master, master, increment);
    const double ds = std::inner_product(slope.share.begin(), slope.share.end(),
                                         increment.begin(), 0.0);
    multiplier_rows(zone, slope.slave, rows);
    change = slope.change;
    for (double& value : change)
      value *= -alpha * s.multipliers.scale * ds;
    check(VecSetValues(b, static_cast<PetscInt>(rows.size()), rows.data(),
                       change.data(), ADD_VALUES),
          "VecSetValues");
  }
}
} // namespace raymortar
