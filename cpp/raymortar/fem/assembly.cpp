#include "raymortar/fem/assembly.h"
#include "raymortar/core/error.h"
#include <algorithm>
#include <numeric>
#include <set>

namespace raymortar
{
namespace
{
void check(PetscErrorCode code, const char* call)
{
  if (code != 0)
  {
    const char* text = nullptr;
    PetscErrorMessage(code, &text, nullptr);
    throw Error(std::string(call) + " failed: " + (text ? text : "") +
                " (PETSc error " + std::to_string(code) + ")");
  }
}

/// PETSc ignores negative rows and columns (vectors if told to): that is how
/// constraints drop out
constexpr PetscInt left_out = -1;

void ignore_left_out(::Vec b)
{
  check(VecSetOption(b, VEC_IGNORE_NEGATIVE_INDICES, PETSC_TRUE),
        "VecSetOption");
}

void append_dofs(const Surface& s, Index facet,
                 const std::vector<double>& fixed, std::vector<PetscInt>& rows)
{
  const int n = s.dofs_per_facet();
  for (int a = 0; a < n; ++a)
  {
    const auto dof =
        static_cast<std::size_t>(s.facet_dofs[static_cast<std::size_t>(facet) *
                                                  static_cast<std::size_t>(n) +
                                              static_cast<std::size_t>(a)]);
    for (int i = 0; i < s.gdim; ++i)
    {
      const bool is_fixed = fixed[dof * static_cast<std::size_t>(s.gdim) +
                                  static_cast<std::size_t>(i)] != 0.0;
      rows.push_back(is_fixed ? left_out
                              : static_cast<PetscInt>(s.rows[dof] + i));
    }
  }
}

void append_multipliers(const Multipliers& m, Index facet, std::size_t facets,
                        std::vector<PetscInt>& rows)
{
  if (m.components == 0 or facets == 0)
    return;
  const std::size_t n = m.facet.size() / facets;
  for (std::size_t k = 0; k < n; ++k)
  {
    const Index node = m.facet[static_cast<std::size_t>(facet) * n + k];
    for (int i = 0; i < m.components; ++i)
      rows.push_back(
          static_cast<PetscInt>(m.row[static_cast<std::size_t>(node)] + i));
  }
}

/// Rows of an element in the order of ElementLayout
void element_rows(const Zone& zone, Index slave, Index master,
                  std::vector<PetscInt>& rows)
{
  const ContactState& s = zone.state();
  rows.clear();
  append_dofs(s.slave, slave, zone.fixed_slave(), rows);
  append_multipliers(s.multipliers, slave,
                     static_cast<std::size_t>(s.slave.num_facets()), rows);
  if (master != no_index)
    append_dofs(s.master, master, zone.fixed_master(), rows);
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
        element_rows(zone, s.elements.slave[e], s.elements.master[e], rows);
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
                                          s.elements.master[e], rows);
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
        element_rows(zone, s.elements.slave[e], s.elements.master[e], rows);
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

namespace
{
std::vector<std::pair<Index, std::int64_t>> present_pairs(const Zone& zone)
{
  const ContactState& s = zone.state();
  std::vector<std::pair<Index, std::int64_t>> pairs;
  for (std::size_t e = 0; e < s.elements.size(); ++e)
    if (s.elements.master[e] != no_index)
      pairs.emplace_back(
          s.elements.slave[e],
          s.master.facet_id[static_cast<std::size_t>(s.elements.master[e])]);
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  return pairs;
}

/// Local number of each fetched master facet, by global number
std::vector<std::pair<std::int64_t, Index>> local_masters(const Surface& s)
{
  std::vector<std::pair<std::int64_t, Index>> known;
  for (std::size_t f = 0; f < s.facet_id.size(); ++f)
    known.emplace_back(s.facet_id[f], static_cast<Index>(f));
  std::sort(known.begin(), known.end());
  return known;
}

Index find_master(const std::vector<std::pair<std::int64_t, Index>>& known,
                  std::int64_t id)
{
  const auto at =
      std::lower_bound(known.begin(), known.end(), std::pair{id, Index{0}});
  return at == known.end() or at->first != id ? no_index : at->second;
}
} // namespace

bool Pattern::covers(const Zone& zone) const
{
  const auto now = present_pairs(zone);
  return std::includes(_pairs.begin(), _pairs.end(), now.begin(), now.end());
}

void Pattern::extend(const Zone& zone)
{
  const auto now = present_pairs(zone);
  const auto known = local_masters(zone.state().master);
  const auto gone = [&](const std::pair<Index, std::int64_t>& p)
  {
    const Index master = find_master(known, p.second);
    const auto candidates = zone.candidates().masters_of(p.first);
    return master == no_index or
           not std::binary_search(candidates.begin(), candidates.end(), master);
  };
  std::erase_if(_pairs, gone);
  std::vector<std::pair<Index, std::int64_t>> all;
  std::set_union(_pairs.begin(), _pairs.end(), now.begin(), now.end(),
                 std::back_inserter(all));
  _pairs = std::move(all);
}

void Pattern::insert(const Zone& zone, ::Mat A) const
{
  const auto known = local_masters(zone.state().master);
  std::vector<PetscInt> rows;
  std::vector<double> zeros;
  const auto room = [&](Index slave, Index master)
  {
    element_rows(zone, slave, master, rows);
    zeros.resize(rows.size() * rows.size(), 0.0);
    const auto n = static_cast<PetscInt>(rows.size());
    check(MatSetValues(A, n, rows.data(), n, rows.data(), zeros.data(),
                       ADD_VALUES),
          "MatSetValues");
  };
  // A facet without a partner still carries its multiplier
  for (Index f = 0; f < zone.state().slave.num_facets(); ++f)
    room(f, no_index);
  for (const auto& [slave, id] : _pairs)
    room(slave, find_master(known, id));
}

void preallocate(::Mat A, std::span<const std::int32_t> offsets,
                 std::span<const std::int32_t> columns,
                 std::span<const Zone* const> zones,
                 std::span<const Pattern> patterns)
{
  MPI_Comm comm = MPI_COMM_NULL;
  check(PetscObjectGetComm(reinterpret_cast<PetscObject>(A), &comm),
        "PetscObjectGetComm");
  PetscInt m = 0, n = 0, begin = 0;
  ::Mat room = nullptr;
  check(MatGetLocalSize(A, &m, &n), "MatGetLocalSize");
  check(MatCreate(comm, &room), "MatCreate");
  check(MatSetSizes(room, m, n, PETSC_DETERMINE, PETSC_DETERMINE),
        "MatSetSizes");
  check(MatSetType(room, MATPREALLOCATOR), "MatSetType");
  check(MatSetUp(room), "MatSetUp");
  check(MatGetOwnershipRange(room, &begin, nullptr), "MatGetOwnershipRange");
  std::vector<double> zeros;
  for (std::size_t i = 0; i + 1 < offsets.size(); ++i)
  {
    const auto count = static_cast<std::size_t>(offsets[i + 1] - offsets[i]);
    zeros.resize(std::max(zeros.size(), count), 0.0);
    const PetscInt row = begin + static_cast<PetscInt>(i);
    check(MatSetValues(room, 1, &row, static_cast<PetscInt>(count),
                       columns.data() + offsets[i], zeros.data(), ADD_VALUES),
          "MatSetValues");
  }
  for (PetscInt row = begin; row < begin + m; ++row)
  {
    const double zero = 0.0;
    check(MatSetValues(room, 1, &row, 1, &row, &zero, ADD_VALUES),
          "MatSetValues");
  }
  for (std::size_t z = 0; z < zones.size(); ++z)
    patterns[z].insert(*zones[z], room);
  check(MatAssemblyBegin(room, MAT_FINAL_ASSEMBLY), "MatAssemblyBegin");
  check(MatAssemblyEnd(room, MAT_FINAL_ASSEMBLY), "MatAssemblyEnd");
  check(MatPreallocatorPreallocate(room, PETSC_TRUE, A),
        "MatPreallocatorPreallocate");
  check(MatDestroy(&room), "MatDestroy");
  check(MatSetOption(A, MAT_NEW_NONZERO_LOCATION_ERR, PETSC_TRUE),
        "MatSetOption");
}
} // namespace raymortar
