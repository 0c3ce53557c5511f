#include "raymortar/fem/assembly.h"
#include "raymortar/fem/rows.h"
#include <algorithm>
#include <numeric>

namespace raymortar
{
namespace
{
void ignore_left_out(::Vec b)
{
  check(VecSetOption(b, VEC_IGNORE_NEGATIVE_INDICES, PETSC_TRUE),
        "VecSetOption");
}

void gather_values(const Surface& s, Index facet,
                   std::span<const double> values, std::vector<double>& out)
{
  const auto n = static_cast<std::size_t>(s.dofs_per_facet());
  const auto d = static_cast<std::size_t>(s.gdim);
  for (std::size_t a = 0; a < n; ++a)
  {
    const auto dof = static_cast<std::size_t>(
        s.facet_dofs[static_cast<std::size_t>(facet) * n + a]);
    for (std::size_t i = 0; i < d; ++i)
      out.push_back(values[dof * d + i]);
  }
}

/// Dirichlet increment of an element in the order of ElementLayout
std::vector<double> element_increment(const ContactState& s, std::size_t e,
                                      std::span<const double> slave,
                                      std::span<const double> master)
{
  std::vector<double> du;
  const Index f = s.elements.slave[e];
  gather_values(s.slave, f, slave, du);
  if (s.multipliers.components > 0)
    du.insert(du.end(),
              s.multipliers.facet.size() /
                  static_cast<std::size_t>(s.slave.num_facets()) *
                  static_cast<std::size_t>(s.multipliers.components),
              0.0);
  if (s.elements.master[e] != no_index)
    gather_values(s.master, s.elements.master[e], master, du);
  return du;
}

std::vector<std::size_t> all_elements(const ContactState& s)
{
  std::vector<std::size_t> all(s.elements.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  return all;
}
} // namespace

void add_residual(const Zone& zone, ::Vec b)
{
  const ContactState& s = zone.state();
  ignore_left_out(b);
  std::vector<PetscInt> rows;
  zone.assembler().residual(
      s,
      [&](std::size_t e, const double* block, int size)
      {
        element_rows(zone, s.elements.slave[e], s.elements.master[e],
                     Constrained::left_out, rows);
        check(VecSetValues(b, size, rows.data(), block, ADD_VALUES),
              "VecSetValues");
      });
}

void add_tangent(const Zone& zone, ::Mat A)
{
  const ContactState& s = zone.state();
  std::vector<PetscInt> rows;
  zone.assembler().tangent(s, all_elements(s),
                           [&](std::size_t e, const double* block, int size)
                           {
                             element_rows(zone, s.elements.slave[e],
                                          s.elements.master[e],
                                          Constrained::left_out, rows);
                             check(MatSetValues(A, size, rows.data(), size,
                                                rows.data(), block, ADD_VALUES),
                                   "MatSetValues");
                           });
}

void apply_lifting(const Zone& zone, ::Vec b, std::span<const double> slave,
                   std::span<const double> master, double alpha)
{
  const ContactState& s = zone.state();
  std::vector<std::vector<double>> increments(s.elements.size());
  std::vector<std::size_t> lifted;
  for (std::size_t e = 0; e < s.elements.size(); ++e)
  {
    increments[e] = element_increment(s, e, slave, master);
    if (std::any_of(increments[e].begin(), increments[e].end(),
                    [](double v) { return v != 0.0; }))
      lifted.push_back(e);
  }
  ignore_left_out(b);
  std::vector<PetscInt> rows;
  std::vector<double> change;
  zone.assembler().tangent(
      s, lifted,
      [&](std::size_t e, const double* block, int size)
      {
        element_rows(zone, s.elements.slave[e], s.elements.master[e],
                     Constrained::left_out, rows);
        change.assign(static_cast<std::size_t>(size), 0.0);
        for (int i = 0; i < size; ++i)
          for (int j = 0; j < size; ++j)
            change[static_cast<std::size_t>(i)] -=
                alpha * block[i * size + j] *
                increments[e][static_cast<std::size_t>(j)];
        check(VecSetValues(b, size, rows.data(), change.data(), ADD_VALUES),
              "VecSetValues");
      });
}
} // namespace raymortar
