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
/// Adds tangent blocks: straight to the entries of rows of this rank, through
/// PETSc to those of other ranks
class BlockWriter
{
public:
  BlockWriter(const Zone& zone, ::Mat A, BlockPositions& positions)
      : _zone(zone), _matrix(A), _positions(positions)
  {
    open();
  }

  void add(std::size_t e, const double* block)
  {
    const ContactElements& elements = _zone.state().elements;
    const Index slave = elements.slave[e], master = elements.master[e];
    element_rows(_zone, slave, master, Constrained::left_out, _rows);
    if (not _arrays->available())
      return set_values(_rows, block);
    const auto at = _positions.of(*_arrays, _zone, slave, master);
    if (not at.known)
    {
      // Where PETSc makes a new entry, the arrays are others afterwards
      _arrays.reset();
      set_values(_rows, block);
      return open();
    }
    add_block(*_arrays, at, _rows, without_constrained(block));
    if (not at.has_foreign)
      return;
    _foreign = _rows;
    for (PetscInt& row : _foreign)
      row = _arrays->owns(row) ? -1 : row;
    set_values(_foreign, block);
  }

private:
  void open()
  {
    _arrays.emplace(_matrix);
    if (_arrays->available())
      _positions.follow(_matrix, _zone);
  }

  /// PETSc leaves out rows and columns numbered -1
  void set_values(const std::vector<PetscInt>& rows, const double* block)
  {
    const auto n = static_cast<PetscInt>(_rows.size());
    check(MatSetValues(_matrix, n, rows.data(), n, _rows.data(), block,
                       ADD_VALUES),
          "MatSetValues");
  }

  /// The block with zeros in the columns that are left out
  const double* without_constrained(const double* block)
  {
    const std::size_t n = _rows.size();
    if (std::none_of(_rows.begin(), _rows.end(),
                     [](PetscInt row) { return row < 0; }))
      return block;
    _masked.assign(block, block + n * n);
    for (std::size_t k = 0; k < n * n; ++k)
      if (_rows[k % n] < 0)
        _masked[k] = 0.0;
    return _masked.data();
  }

  const Zone& _zone;
  ::Mat _matrix;
  std::optional<AijArrays> _arrays;
  BlockPositions& _positions;
  std::vector<PetscInt> _rows, _foreign;
  std::vector<double> _masked;
};
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

void add_tangent(const Zone& zone, ::Mat A, BlockPositions& positions)
{
  BlockWriter writer(zone, A, positions);
  zone.assembler().tangent(zone.state(), all_elements(zone.state()),
                           [&](std::size_t e, const double* block, int)
                           { writer.add(e, block); });
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
