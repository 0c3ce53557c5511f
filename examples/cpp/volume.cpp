#include "volume.h"
#include <set>

namespace
{
void check(PetscErrorCode code) { CHKERRABORT(PETSC_COMM_WORLD, code); }
} // namespace

void Volume::add(const ElasticBlock& block, PetscInt first_row)
{
  for (const auto& nodes : block.connectivity())
  {
    CellRows rows;
    for (std::size_t a = 0; a < 4; ++a)
      for (int i = 0; i < 2; ++i)
        rows[2 * a + static_cast<std::size_t>(i)] =
            first_row + 2 * nodes[a] + i;
    _cells.push_back(rows);
    _body.push_back(_K.size());
  }
  _K.push_back(block.stiffness());
}

void Volume::pattern(std::vector<std::int32_t>& offsets,
                     std::vector<std::int32_t>& columns) const
{
  std::vector<std::set<PetscInt>> rows(_load.size());
  for (const CellRows& cell : _cells)
    for (const PetscInt row : cell)
      rows[local(row)].insert(cell.begin(), cell.end());
  offsets = {0};
  columns.clear();
  for (const auto& row : rows)
  {
    columns.insert(columns.end(), row.begin(), row.end());
    offsets.push_back(static_cast<std::int32_t>(columns.size()));
  }
}

void Volume::assemble(std::span<const double> u, Mat A, Vec b) const
{
  check(VecSetOption(b, VEC_IGNORE_NEGATIVE_INDICES, PETSC_TRUE));
  for (std::size_t c = 0; c < _cells.size(); ++c)
  {
    const auto& K = _K[_body[c]];
    Eigen::Matrix<double, 8, 1> at;
    CellRows rows = _cells[c];
    for (std::size_t k = 0; k < 8; ++k)
    {
      at[static_cast<int>(k)] = u[local(rows[k])];
      // PETSc leaves negative rows and columns out
      if (_held[local(rows[k])])
        rows[k] = -1;
    }
    const Eigen::Matrix<double, 8, 1> f = K * at;
    check(VecSetValues(b, 8, rows.data(), f.data(), ADD_VALUES));
    check(
        MatSetValues(A, 8, rows.data(), 8, rows.data(), K.data(), ADD_VALUES));
  }
  for (std::size_t k = 0; k < _load.size(); ++k)
  {
    const PetscInt row = _begin + static_cast<PetscInt>(k);
    check(VecSetValue(b, row, -_load[k], ADD_VALUES));
    if (_held[k])
      check(MatSetValue(A, row, row, 1.0, ADD_VALUES));
  }
}
