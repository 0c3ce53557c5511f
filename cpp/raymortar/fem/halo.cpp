#include "raymortar/fem/halo.h"
#include <algorithm>
#include <numeric>
#include <unordered_map>

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

std::vector<int> starts(const std::vector<int>& counts)
{
  std::vector<int> s(counts.size() + 1, 0);
  std::partial_sum(counts.begin(), counts.end(), s.begin() + 1);
  return s;
}

/// Items with `width` values each, `counts` items per rank
template <class T>
std::vector<T> exchange(MPI_Comm comm, const std::vector<T>& send,
                        std::vector<int> send_counts,
                        std::vector<int> recv_counts, int width)
{
  for (int& c : send_counts)
    c *= width;
  for (int& c : recv_counts)
    c *= width;
  const std::vector<int> from = starts(send_counts), to = starts(recv_counts);
  std::vector<T> recv(static_cast<std::size_t>(to.back()));
  MPI_Alltoallv(send.data(), send_counts.data(), from.data(), mpi_type<T>(),
                recv.data(), recv_counts.data(), to.data(), mpi_type<T>(),
                comm);
  return recv;
}

std::vector<int> transposed(MPI_Comm comm, const std::vector<int>& counts)
{
  std::vector<int> other(counts.size());
  MPI_Alltoall(counts.data(), 1, MPI_INT, other.data(), 1, MPI_INT, comm);
  return other;
}

/// Facets of `own` whose nodes' box overlaps the box (lower, upper)
std::vector<Index> facets_in(const Surface& own, const double* box)
{
  const auto d = static_cast<std::size_t>(own.gdim);
  const auto n = static_cast<std::size_t>(own.nodes_per_facet());
  std::vector<Index> facets;
  for (std::size_t f = 0; f < own.facet_id.size(); ++f)
  {
    bool overlaps = true;
    for (std::size_t i = 0; i < d and overlaps; ++i)
    {
      double lower = box[d + i] + 1.0, upper = box[i] - 1.0;
      for (std::size_t a = 0; a < n; ++a)
      {
        const auto node = static_cast<std::size_t>(own.facet_nodes[f * n + a]);
        const double x = own.x[node * d + i];
        lower = a == 0 ? x : std::min(lower, x);
        upper = a == 0 ? x : std::max(upper, x);
      }
      overlaps = lower <= box[d + i] and upper >= box[i];
    }
    if (overlaps)
      facets.push_back(static_cast<Index>(f));
  }
  return facets;
}

/// What one rank sends to another, appended rank by rank
struct Parcel
{
  std::vector<int> facet_counts, node_counts, dof_counts;
  std::vector<std::int64_t> facets; ///< id, node ids, dof ids per facet
  std::vector<std::int64_t> nodes;  ///< global node number
  std::vector<double> positions;    ///< X, x, x_old per node
  std::vector<std::int64_t> dofs;   ///< global dof number, first row
  std::vector<Index> send_dofs;
};

/// Sorted, unique entities (nodes or dofs) of some facets
std::vector<Index> used(const std::vector<Index>& table, std::size_t n,
                        const std::vector<Index>& facets)
{
  std::vector<Index> entities;
  for (const Index f : facets)
    for (std::size_t a = 0; a < n; ++a)
      entities.push_back(table[static_cast<std::size_t>(f) * n + a]);
  std::sort(entities.begin(), entities.end());
  entities.erase(std::unique(entities.begin(), entities.end()), entities.end());
  return entities;
}

void pack(const Surface& own, std::span<const std::int64_t> node_ids,
          std::span<const std::int64_t> dof_ids,
          const std::vector<Index>& facets, Parcel& out)
{
  const auto d = static_cast<std::size_t>(own.gdim);
  const auto nodes = static_cast<std::size_t>(own.nodes_per_facet());
  const auto dofs = static_cast<std::size_t>(own.dofs_per_facet());
  for (const Index facet : facets)
  {
    const auto f = static_cast<std::size_t>(facet);
    out.facets.push_back(own.facet_id[f]);
    for (std::size_t a = 0; a < nodes; ++a)
      out.facets.push_back(
          node_ids[static_cast<std::size_t>(own.facet_nodes[f * nodes + a])]);
    for (std::size_t a = 0; a < dofs; ++a)
      out.facets.push_back(
          dof_ids[static_cast<std::size_t>(own.facet_dofs[f * dofs + a])]);
  }
  const auto used_nodes = used(own.facet_nodes, nodes, facets);
  for (const Index node : used_nodes)
  {
    const auto k = static_cast<std::size_t>(node);
    out.nodes.push_back(node_ids[k]);
    for (const auto* array : {&own.X, &own.x, &own.x_old})
      for (std::size_t i = 0; i < d; ++i)
        out.positions.push_back((*array)[k * d + i]);
  }
  const auto used_dofs = used(own.facet_dofs, dofs, facets);
  for (const Index dof : used_dofs)
  {
    const auto k = static_cast<std::size_t>(dof);
    out.dofs.insert(out.dofs.end(), {dof_ids[k], own.rows[k]});
    out.send_dofs.push_back(dof);
  }
  out.facet_counts.push_back(static_cast<int>(facets.size()));
  out.node_counts.push_back(static_cast<int>(used_nodes.size()));
  out.dof_counts.push_back(static_cast<int>(used_dofs.size()));
}

/// Local number of each global one, in order of first appearance
class Numbering
{
public:
  /// @return local number and whether it is new
  std::pair<Index, bool> operator()(std::int64_t global)
  {
    const auto [it, fresh] =
        _local.try_emplace(global, static_cast<Index>(_local.size()));
    return {it->second, fresh};
  }

private:
  std::unordered_map<std::int64_t, Index> _local;
};

struct Received
{
  std::vector<std::int64_t> facets, nodes, dofs;
  std::vector<double> positions;
};

/// The fetched facets as one surface; `place` gets the dof of each received
Surface unpack(const Surface& own, const Received& r, std::vector<Index>& place)
{
  const auto d = static_cast<std::size_t>(own.gdim);
  const auto n = static_cast<std::size_t>(own.nodes_per_facet());
  const auto m = static_cast<std::size_t>(own.dofs_per_facet());
  Surface s;
  s.shape = own.shape;
  s.degree = own.degree;
  s.node_degree = own.node_degree;
  s.gdim = own.gdim;
  Numbering node_number, dof_number;
  for (std::size_t k = 0; k < r.nodes.size(); ++k)
  {
    if (not node_number(r.nodes[k]).second)
      continue;
    const double* from = r.positions.data() + 3 * d * k;
    s.X.insert(s.X.end(), from, from + d);
    s.x.insert(s.x.end(), from + d, from + 2 * d);
    s.x_old.insert(s.x_old.end(), from + 2 * d, from + 3 * d);
  }
  for (std::size_t k = 0; k < r.dofs.size(); k += 2)
  {
    const auto [local, fresh] = dof_number(r.dofs[k]);
    place.push_back(local);
    if (fresh)
      s.rows.push_back(r.dofs[k + 1]);
  }
  for (std::size_t k = 0; k < r.facets.size(); k += 1 + n + m)
  {
    s.facet_id.push_back(r.facets[k]);
    for (std::size_t a = 0; a < n; ++a)
      s.facet_nodes.push_back(node_number(r.facets[k + 1 + a]).first);
    for (std::size_t a = 0; a < m; ++a)
      s.facet_dofs.push_back(dof_number(r.facets[k + 1 + n + a]).first);
  }
  s.neighbours = find_neighbours(s);
  return s;
}
} // namespace

Halo::Halo(MPI_Comm comm, const Surface& own,
           std::span<const std::int64_t> node_ids,
           std::span<const std::int64_t> dof_ids,
           std::span<const double> wanted)
    : _comm(comm)
{
  int size = 1;
  MPI_Comm_size(comm, &size);
  const int width = 2 * own.gdim;
  std::vector<double> boxes(static_cast<std::size_t>(size * width));
  MPI_Allgather(wanted.data(), width, MPI_DOUBLE, boxes.data(), width,
                MPI_DOUBLE, comm);
  Parcel parcel;
  for (int r = 0; r < size; ++r)
    pack(own, node_ids, dof_ids, facets_in(own, boxes.data() + r * width),
         parcel);
  const auto send = [&]<class T>(const std::vector<T>& data,
                                 const std::vector<int>& counts, int w)
  {
    _bytes_sent += static_cast<std::int64_t>(data.size() * sizeof(T));
    return exchange(comm, data, counts, transposed(comm, counts), w);
  };
  const int facet_width = 1 + own.nodes_per_facet() + own.dofs_per_facet();
  Received r;
  r.facets = send(parcel.facets, parcel.facet_counts, facet_width);
  r.nodes = send(parcel.nodes, parcel.node_counts, 1);
  r.positions = send(parcel.positions, parcel.node_counts, 3 * own.gdim);
  r.dofs = send(parcel.dofs, parcel.dof_counts, 2);
  _send_counts = parcel.dof_counts;
  _recv_counts = transposed(comm, _send_counts);
  _send_dofs = std::move(parcel.send_dofs);
  _surface = unpack(own, r, _place);
}

std::vector<double> Halo::fetch(std::span<const double> own, int width) const
{
  const auto w = static_cast<std::size_t>(width);
  std::vector<double> send;
  send.reserve(_send_dofs.size() * w);
  for (const Index dof : _send_dofs)
  {
    const auto values = own.subspan(static_cast<std::size_t>(dof) * w, w);
    send.insert(send.end(), values.begin(), values.end());
  }
  const auto recv = exchange(_comm, send, _send_counts, _recv_counts, width);
  _bytes_sent += static_cast<std::int64_t>(send.size() * sizeof(double));
  std::vector<double> values(_surface.rows.size() * w, 0.0);
  for (std::size_t k = 0; k < _place.size(); ++k)
    std::copy_n(recv.begin() + static_cast<std::ptrdiff_t>(k * w), w,
                values.begin() + static_cast<std::ptrdiff_t>(
                                     static_cast<std::size_t>(_place[k]) * w));
  return values;
}
} // namespace raymortar
