#include "raymortar/fem/rows.h"
#include "raymortar/element/free_tools.h"
#include "raymortar/pairing/facet_dofs.h"

namespace raymortar
{
namespace
{
void append_dofs(const Surface& s, Index facet,
                 const std::vector<double>& fixed, Constrained constrained,
                 std::vector<PetscInt>& rows)
{
  for_facet_dofs(s, facet,
                 [&](std::size_t k)
                 {
                   const bool drop =
                       constrained == Constrained::left_out and fixed[k] != 0.0;
                   rows.push_back(drop ? -1 : static_cast<PetscInt>(s.rows[k]));
                 });
}

void append_multipliers(const Multipliers& m, Index facet, std::size_t facets,
                        std::vector<PetscInt>& rows)
{
  if (m.components == 0 or facets == 0)
    return;
  const std::size_t n = m.facet.size() / facets;
  for (std::size_t k = 0; k < n; ++k)
  {
    const Index node = m.facet[facet * n + k];
    for (int i = 0; i < m.components; ++i)
      rows.push_back(static_cast<PetscInt>(m.row[node] + i));
  }
}
} // namespace

void global_rows(const Zone& zone, const Unknowns& unknowns,
                 Constrained constrained, std::vector<PetscInt>& rows)
{
  const ContactState& s = zone.state();
  rows.clear();
  if (unknowns.slave != no_index)
    append_dofs(s.slave, unknowns.slave, zone.fixed_slave(), constrained, rows);
  if (unknowns.multiplier != no_index)
    append_multipliers(s.multipliers, unknowns.multiplier, s.slave.num_facets(),
                       rows);
  if (unknowns.master != no_index)
    append_dofs(s.master, unknowns.master, zone.fixed_master(), constrained,
                rows);
  if (unknowns.tool != no_index)
    for (const GlobalIndex row : freedom_of(s, unknowns.tool).rows)
      rows.push_back(static_cast<PetscInt>(row));
}

void element_rows(const Zone& zone, Index slave, Index master,
                  Constrained constrained, std::vector<PetscInt>& rows)
{
  global_rows(zone, element_unknowns(slave, master), constrained, rows);
}

void master_rows(const Zone& zone, Index master, Constrained constrained,
                 std::vector<PetscInt>& rows)
{
  global_rows(zone, {no_index, no_index, master, no_index}, constrained, rows);
}
} // namespace raymortar
