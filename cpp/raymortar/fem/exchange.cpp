#include "raymortar/fem/exchange.h"
#include "raymortar/core/error.h"
#include "raymortar/fem/petsc.h"
#include <algorithm>
#include <limits>
#include <numeric>

namespace raymortar
{
namespace
{
template <class T>
MPI_Datatype mpi_type();
template <>
MPI_Datatype mpi_type<double>()
{
  return MPI_DOUBLE;
}
template <>
MPI_Datatype mpi_type<std::int64_t>()
{
  return MPI_INT64_T;
}

/// MPI counts in int
int message_size(std::int64_t n)
{
  if (n > std::numeric_limits<int>::max())
    throw Error("a message of " + std::to_string(n) +
                " values to one rank: use more ranks");
  return static_cast<int>(n);
}
} // namespace

PrivateComm::PrivateComm(MPI_Comm comm)
{
  check(PetscCommDuplicate(comm, &_comm, nullptr), "PetscCommDuplicate");
}

PrivateComm::~PrivateComm()
{
  // Python may drop its last reference after PETSc has gone, and this with it
  if (PetscFinalizeCalled == PETSC_FALSE)
    PetscCommDestroy(&_comm);
}

int PrivateComm::new_tag() const
{
  PetscMPIInt tag = 0;
  check(PetscCommGetNewTag(_comm, &tag), "PetscCommGetNewTag");
  return tag;
}

Exchange::Exchange(MPI_Comm comm, std::vector<int> ranks,
                   std::vector<std::int64_t> counts, int kinds)
    : _comm(comm), _kinds(kinds), _to{std::move(ranks), std::move(counts)}
{
  MPI_Comm_rank(_comm.get(), &_rank);
  _tag = _comm.new_tag();
  find_senders();
}

void Exchange::find_senders()
{
  PetscMPIInt found = 0, *ranks = nullptr;
  std::int64_t* counts = nullptr;
  check(PetscCommBuildTwoSided(_comm.get(), _kinds, MPI_INT64_T,
                               static_cast<PetscMPIInt>(_to.ranks.size()),
                               _to.ranks.data(), _to.counts.data(), &found,
                               &ranks, static_cast<void*>(&counts)),
        "PetscCommBuildTwoSided");
  // They come in the order of arrival, which changes from run to run
  const std::size_t n = found;
  const std::size_t k = _kinds;
  std::vector<std::size_t> order(n);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return ranks[a] < ranks[b]; });
  for (const std::size_t i : order)
  {
    _from.ranks.push_back(ranks[i]);
    _from.counts.insert(_from.counts.end(), counts + k * i,
                        counts + k * (i + 1));
  }
  check(PetscFree(ranks), "PetscFree");
  check(PetscFree(counts), "PetscFree");
  const auto self = std::count(_to.ranks.begin(), _to.ranks.end(), _rank);
  const auto others = static_cast<std::int64_t>(_to.ranks.size()) - self;
  _traffic += {others, others * _kinds * 8};
}

template <class T>
std::vector<T> Exchange::send_items(std::span<const T> items, int kind,
                                    int width) const
{
  const auto size_of = [&](const Side& side, std::size_t i)
  {
    const auto at = i * _kinds + kind;
    return side.counts[at] * width;
  };
  std::int64_t total = 0;
  for (std::size_t i = 0; i < _from.ranks.size(); ++i)
    total += size_of(_from, i);
  std::vector<T> received(total);
  std::vector<MPI_Request> requests;
  T *to = received.data(), *from_self = nullptr;
  for (std::size_t i = 0; i < _from.ranks.size(); to += size_of(_from, i++))
    if (_from.ranks[i] == _rank)
      from_self = to;
    else if (size_of(_from, i) > 0)
      MPI_Irecv(to, message_size(size_of(_from, i)), mpi_type<T>(),
                _from.ranks[i], _tag, _comm.get(), &requests.emplace_back());
  const T* from = items.data();
  for (std::size_t i = 0; i < _to.ranks.size(); from += size_of(_to, i++))
  {
    const std::int64_t n = size_of(_to, i);
    if (_to.ranks[i] == _rank)
      std::copy_n(from, n, from_self);
    else if (n > 0)
    {
      MPI_Isend(from, message_size(n), mpi_type<T>(), _to.ranks[i], _tag,
                _comm.get(), &requests.emplace_back());
      _traffic += {1, n * std::int64_t{sizeof(T)}};
    }
  }
  MPI_Waitall(static_cast<int>(requests.size()), requests.data(),
              MPI_STATUSES_IGNORE);
  return received;
}

std::vector<double> Exchange::send(std::span<const double> items, int kind,
                                   int width) const
{
  return send_items(items, kind, width);
}

std::vector<std::int64_t> Exchange::send(std::span<const std::int64_t> items,
                                         int kind, int width) const
{
  return send_items(items, kind, width);
}
} // namespace raymortar
