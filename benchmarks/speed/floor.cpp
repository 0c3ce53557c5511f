// What assembly cannot do without: computing alone, and writing alone. Python's
// module _floor, for zones of raymortar's.
#include "raymortar/fem/rows.h"
#include <numeric>
#include <pybind11/pybind11.h>

namespace
{
using namespace raymortar;

/// @brief Write blocks of zeros where the tangent's blocks go, by MatSetValues.
///
/// The least that an assembly costs that hands its blocks to PETSc. Assembly
/// of the matrix is the caller's.
/// @param[in] handle Of the matrix: petsc4py gives its C pointer as a number
/// @return Number of entries written
std::int64_t write_blocks(const Zone& zone, std::uintptr_t handle)
{
  auto* const A = reinterpret_cast<PetscMatrix>(handle);
  const ContactElements& elements = zone.state().elements;
  std::vector<PetscInt> rows;
  std::vector<double> block;
  std::int64_t written = 0;
  for (std::size_t e = 0; e < elements.size(); ++e)
  {
    element_rows(zone, elements.slave[e], elements.master[e], Constrained::kept,
                 rows);
    block.resize(rows.size() * rows.size(), 0.0);
    const auto n = static_cast<PetscInt>(rows.size());
    check(MatSetValues(A, n, rows.data(), n, rows.data(), block.data(),
                       ADD_VALUES),
          "MatSetValues");
    written += std::int64_t{n} * n;
  }
  return written;
}

/// @brief Compute the blocks of all elements and drop them.
/// @return Sum of all entries, lest they be optimised away
double compute_blocks(const Zone& zone, bool tangent)
{
  const ContactState& s = zone.state();
  double sum = 0.0;
  const auto add = [&](std::size_t, const double* block, int size)
  {
    const int n = tangent ? size * size : size;
    sum = std::accumulate(block, block + n, sum);
  };
  if (not tangent)
  {
    zone.assembler().residual(s, add);
    return sum;
  }
  std::vector<std::size_t> all(s.elements.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  zone.assembler().tangent(
      s, all, add,
      [&](std::size_t e, Index, const double* block, int size, const double*)
      { add(e, block, size); });
  return sum;
}
} // namespace

PYBIND11_MODULE(_floor, m)
{
  m.def("write_blocks", &write_blocks);
  m.def("compute_blocks", &compute_blocks);
}
