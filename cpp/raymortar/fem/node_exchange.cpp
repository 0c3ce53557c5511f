#include "raymortar/fem/node_exchange.h"
#include "raymortar/fem/petsc.h"
#include <algorithm>
#include <utility>

namespace raymortar
{
namespace
{
/// First rows of the ranks that own nodes, ascending, and these ranks
struct Owners
{
  std::vector<GlobalIndex> first;
  std::vector<int> rank;

  Owners(MPI_Comm comm, GlobalIndex own)
  {
    int ranks = 1;
    MPI_Comm_size(comm, &ranks);
    std::vector<GlobalIndex> all(static_cast<std::size_t>(ranks));
    MPI_Allgather(&own, 1, MPI_INT64_T, all.data(), 1, MPI_INT64_T, comm);
    for (int r = 0; r < ranks; ++r)
      if (all[static_cast<std::size_t>(r)] >= 0)
      {
        first.push_back(all[static_cast<std::size_t>(r)]);
        rank.push_back(r);
      }
  }

  /// Place among the owners of the one that has a row
  [[nodiscard]] std::size_t of(GlobalIndex row) const
  {
    return static_cast<std::size_t>(
        std::upper_bound(first.begin(), first.end(), row) - first.begin() - 1);
  }
};
} // namespace

NodeExchange::NodeExchange(MPI_Comm comm, std::span<const GlobalIndex> rows,
                           std::span<const Index> owned, int components)
    : _owned(owned.size())
{
  static_assert(sizeof(GlobalIndex) == sizeof(std::int64_t));
  int ranks = 1;
  MPI_Comm_size(comm, &ranks);
  _is_alone = ranks == 1;
  if (_is_alone)
    return;
  const Owners owners(
      comm, owned.empty() ? -1 : rows[static_cast<std::size_t>(owned.front())]);
  std::vector<PetscInt> leaves;
  std::vector<PetscSFNode> roots;
  for (std::size_t node = 0; node < rows.size(); ++node)
  {
    if (rows[node] < 0)
      continue;
    const std::size_t k = owners.of(rows[node]);
    leaves.push_back(static_cast<PetscInt>(node));
    roots.push_back(
        {owners.rank[k],
         static_cast<PetscInt>((rows[node] - owners.first[k]) / components)});
  }
  check(PetscSFCreate(comm, &_sf), "PetscSFCreate");
  check(PetscSFSetGraph(_sf, static_cast<PetscInt>(_owned),
                        static_cast<PetscInt>(leaves.size()), leaves.data(),
                        PETSC_COPY_VALUES, roots.data(), PETSC_COPY_VALUES),
        "PetscSFSetGraph");
}

NodeExchange::~NodeExchange()
{
  PetscBool is_finalized = PETSC_FALSE;
  if (PetscFinalized(&is_finalized) == 0 and not is_finalized)
    PetscSFDestroy(&_sf);
}

NodeExchange::NodeExchange(NodeExchange&& other) noexcept
    : _owned(other._owned), _is_alone(other._is_alone),
      _sf(std::exchange(other._sf, nullptr)), _sums(std::move(other._sums))
{
}

void NodeExchange::sum(std::span<double> values, int width)
{
  if (_is_alone)
    return;
  _sums.assign(_owned * static_cast<std::size_t>(width), 0.0);
  MPI_Datatype row = MPI_DATATYPE_NULL;
  MPI_Type_contiguous(width, MPIU_REAL, &row);
  MPI_Type_commit(&row);
  check(PetscSFReduceBegin(_sf, row, values.data(), _sums.data(), MPI_SUM),
        "PetscSFReduceBegin");
  check(PetscSFReduceEnd(_sf, row, values.data(), _sums.data(), MPI_SUM),
        "PetscSFReduceEnd");
  check(PetscSFBcastBegin(_sf, row, _sums.data(), values.data(), MPI_REPLACE),
        "PetscSFBcastBegin");
  check(PetscSFBcastEnd(_sf, row, _sums.data(), values.data(), MPI_REPLACE),
        "PetscSFBcastEnd");
  MPI_Type_free(&row);
}
} // namespace raymortar
