#include "raymortar/system/coupled_values.h"
#include <algorithm>

namespace raymortar
{
namespace
{
bool is_first(MPI_Comm comm)
{
  int rank = 0;
  MPI_Comm_rank(comm, &rank);
  return rank == 0;
}

/// Calls visit(value, row of the rank) for the unknowns of free bodies
template <class Visit>
void for_each_body_row(const std::vector<BodyValues>& bodies, Visit&& visit)
{
  for (const BodyValues& one : bodies)
    for (std::size_t j = 0; j < one.rows.size(); ++j)
      visit(*one.body, j, static_cast<std::size_t>(one.rows[j]));
}
} // namespace

ReadArray::ReadArray(PetscVector x) : _vector(x)
{
  PetscInt size = 0;
  check(VecGetLocalSize(x, &size), "VecGetLocalSize");
  check(VecGetArrayRead(x, &_array), "VecGetArrayRead");
  _size = static_cast<std::size_t>(size);
}

CoupledValues::CoupledValues(MPI_Comm comm,
                             std::vector<FunctionValues> functions,
                             std::span<const GlobalIndex> rows,
                             std::vector<MultiplierValues> multipliers,
                             std::vector<BodyValues> bodies)
    : _comm(comm), _functions(std::move(functions)),
      _multipliers(std::move(multipliers)), _bodies(std::move(bodies))
{
  _rows.assign(rows.begin(), rows.end());
  for (const MultiplierValues& one : _multipliers)
    for (const GlobalIndex row : one.rows)
      for (int c = 0; row >= 0 and c < one.components; ++c)
        _rows.push_back(static_cast<PetscInt>(row + c));
  for (const BodyValues& one : _bodies)
    _rows.insert(_rows.end(), one.rows.begin(), one.rows.end());
}

CoupledValues::~CoupledValues()
{
  PetscBool is_finalized = PETSC_FALSE;
  if (PetscFinalized(&is_finalized) == 0 and not is_finalized)
  {
    VecScatterDestroy(&_scatter);
    VecDestroy(&_local);
  }
}

void CoupledValues::make_scatter(PetscVector x)
{
  const auto size = static_cast<PetscInt>(_rows.size());
  IS from = nullptr;
  check(ISCreateGeneral(PETSC_COMM_SELF, size, _rows.data(), PETSC_COPY_VALUES,
                        &from),
        "ISCreateGeneral");
  check(VecCreateSeq(PETSC_COMM_SELF, size, &_local), "VecCreateSeq");
  check(VecScatterCreate(x, from, _local, nullptr, &_scatter),
        "VecScatterCreate");
  ISDestroy(&from);
}

void CoupledValues::to_vector(PetscVector x,
                              std::span<const double> scales) const
{
  PetscScalar* array = nullptr;
  check(VecGetArray(x, &array), "VecGetArray");
  PetscInt begin = 0;
  check(VecGetOwnershipRange(x, &begin, nullptr), "VecGetOwnershipRange");
  double* out = array;
  for (const FunctionValues& f : _functions)
    out = std::copy_n(f.local.data(), f.owned, out);
  for (std::size_t k = 0; k < _multipliers.size(); ++k)
  {
    const MultiplierValues& one = _multipliers[k];
    const auto width = static_cast<std::size_t>(one.components);
    for (const Index owned : one.owned)
    {
      const auto node = static_cast<std::size_t>(owned);
      for (std::size_t c = 0; c < width; ++c)
        array[static_cast<std::size_t>(one.rows[node] - begin) + c] =
            one.local[node * width + c] / scales[k];
    }
  }
  if (is_first(_comm))
    for_each_body_row(_bodies,
                      [&](const MovedBody& body, std::size_t j, std::size_t row)
                      { array[row] = body.unknowns()[j] / body.unit(j); });
  check(VecRestoreArray(x, &array), "VecRestoreArray");
}

void CoupledValues::from_vector(PetscVector x, std::span<const double> scales)
{
  if (_scatter == nullptr)
    make_scatter(x);
  check(VecScatterBegin(_scatter, x, _local, INSERT_VALUES, SCATTER_FORWARD),
        "VecScatterBegin");
  check(VecScatterEnd(_scatter, x, _local, INSERT_VALUES, SCATTER_FORWARD),
        "VecScatterEnd");
  const ReadArray found(_local);
  const double* in = found.values().data();
  for (const FunctionValues& f : _functions)
  {
    std::copy_n(in, f.local.size(), f.local.begin());
    in += f.local.size();
  }
  for (std::size_t k = 0; k < _multipliers.size(); ++k)
  {
    const MultiplierValues& one = _multipliers[k];
    const auto width = static_cast<std::size_t>(one.components);
    for (std::size_t node = 0; node < one.rows.size(); ++node)
      for (std::size_t c = 0; one.rows[node] >= 0 and c < width; ++c)
        one.local[node * width + c] = scales[k] * *in++;
  }
  for (const BodyValues& one : _bodies)
    for (std::size_t j = 0; j < one.rows.size(); ++j)
      one.body->unknowns()[j] = *in++ * one.body->unit(j);
}

bool CoupledValues::match(std::span<const double> x) const
{
  const double* at = x.data();
  for (const FunctionValues& f : _functions)
  {
    if (not std::equal(at, at + f.owned, f.local.data()))
      return false;
    at += f.owned;
  }
  bool same = true;
  if (is_first(_comm))
    for_each_body_row(
        _bodies, [&](const MovedBody& body, std::size_t j, std::size_t row)
        { same = same and body.unknowns()[j] == x[row] * body.unit(j); });
  return same;
}
} // namespace raymortar
