#include "raymortar/fem/floor.h"
#include "raymortar/fem/rows.h"
#include <numeric>

namespace raymortar
{
std::int64_t write_blocks(const Zone& zone, ::Mat A)
{
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
    written += static_cast<std::int64_t>(rows.size() * rows.size());
  }
  return written;
}

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
} // namespace raymortar
