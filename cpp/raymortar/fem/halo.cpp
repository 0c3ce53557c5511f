#include "raymortar/fem/halo.h"
#include "raymortar/core/sorted.h"
#include "raymortar/pairing/candidates.h"
#include <algorithm>
#include <bit>
#include <numeric>
#include <unordered_map>

namespace raymortar
{
namespace
{
/// Kinds of items that travel
enum : int
{
  facets_kind,
  nodes_kind,
  dofs_kind,
  kinds
};

/// Values of a facet before its nodes: number, thickness and body
constexpr std::size_t facet_header = 3;

/// Boxes of all ranks, rank by rank
struct Published
{
  std::vector<double> boxes;
  std::vector<int> offsets; ///< values, (ranks + 1,)
};

Published publish(MPI_Comm comm, std::span<const double> wanted)
{
  int size = 1;
  MPI_Comm_size(comm, &size);
  std::vector<int> counts(size);
  const int mine = static_cast<int>(wanted.size());
  MPI_Allgather(&mine, 1, MPI_INT, counts.data(), 1, MPI_INT, comm);
  Published all;
  all.offsets.assign(counts.size() + 1, 0);
  std::partial_sum(counts.begin(), counts.end(), all.offsets.begin() + 1);
  all.boxes.resize(all.offsets.back());
  MPI_Allgatherv(wanted.data(), mine, MPI_DOUBLE, all.boxes.data(),
                 counts.data(), all.offsets.data(), MPI_DOUBLE, comm);
  return all;
}

/// Owned facets that each rank wants, ascending; calls fn(rank, facets)
template <int D, class Fn>
void for_each_demand(const Surface& own, const Published& all, Fn&& fn)
{
  const std::vector<Box<D>> boxes = facet_boxes<D>(own);
  const AabbTree<D> tree(boxes);
  std::vector<Index> facets;
  for (std::size_t r = 0; r + 1 < all.offsets.size(); ++r)
  {
    facets.clear();
    for (int k = all.offsets[r]; k < all.offsets[r + 1]; k += 2 * D)
    {
      const double* box = all.boxes.data() + k;
      tree.query(
          {Eigen::Map<const Vec<D>>(box), Eigen::Map<const Vec<D>>(box + D)},
          facets);
    }
    sort_unique(facets);
    if (not facets.empty())
      fn(static_cast<int>(r), facets);
  }
}

/// Data from one rank to another, appended rank by rank
struct Parcel
{
  std::vector<int> ranks;
  std::vector<std::int64_t> counts; ///< facets, nodes, dofs of each rank
  /// Per facet: id, bits of the thickness behind it, body, node ids, dof ids
  std::vector<std::int64_t> facets;
  std::vector<std::int64_t> nodes; ///< global node number
  std::vector<double> positions;   ///< X, x, x_old per node
  std::vector<std::int64_t> dofs;  ///< global dof number, rows
  std::vector<Index> send_facets, send_dofs;
};

/// Sorted, unique entities (nodes or dofs) of some facets
std::vector<Index> used(const std::vector<Index>& table, std::size_t n,
                        const std::vector<Index>& facets)
{
  std::vector<Index> entities;
  for (const Index f : facets)
    for (std::size_t a = 0; a < n; ++a)
      entities.push_back(table[f * n + a]);
  sort_unique(entities);
  return entities;
}

void pack(const Surface& own, std::span<const std::int64_t> node_ids,
          std::span<const std::int64_t> dof_ids, int rank,
          const std::vector<Index>& facets, Parcel& out)
{
  const std::size_t d = own.gdim;
  const std::size_t nodes = own.nodes_per_facet();
  const std::size_t dofs = own.dofs_per_facet();
  for (const Index facet : facets)
  {
    const std::size_t f = facet;
    out.facets.push_back(own.facet_id[f]);
    out.facets.push_back(
        std::bit_cast<std::int64_t>(own.thickness_behind(facet)));
    out.facets.push_back(own.body_of(facet));
    for (std::size_t a = 0; a < nodes; ++a)
      out.facets.push_back(node_ids[own.facet_nodes[f * nodes + a]]);
    for (std::size_t a = 0; a < dofs; ++a)
      out.facets.push_back(dof_ids[own.facet_dofs[f * dofs + a]]);
  }
  const auto used_nodes = used(own.facet_nodes, nodes, facets);
  for (const Index node : used_nodes)
  {
    const std::size_t k = node;
    out.nodes.push_back(node_ids[k]);
    for (const auto* array : {&own.X, &own.x, &own.x_old})
      for (std::size_t i = 0; i < d; ++i)
        out.positions.push_back((*array)[k * d + i]);
  }
  const auto used_dofs = used(own.facet_dofs, dofs, facets);
  for (const Index dof : used_dofs)
  {
    const std::size_t k = dof;
    out.dofs.push_back(dof_ids[k]);
    for (std::size_t i = 0; i < d; ++i)
      out.dofs.push_back(own.rows[k * d + i]);
    out.send_dofs.push_back(dof);
  }
  out.send_facets.insert(out.send_facets.end(), facets.begin(), facets.end());
  out.ranks.push_back(rank);
  for (const std::size_t n :
       {facets.size(), used_nodes.size(), used_dofs.size()})
    out.counts.push_back(static_cast<std::int64_t>(n));
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
  const std::size_t d = own.gdim;
  const std::size_t n = own.nodes_per_facet();
  const std::size_t m = own.dofs_per_facet();
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
  for (std::size_t k = 0; k < r.dofs.size(); k += 1 + d)
  {
    const auto [local, fresh] = dof_number(r.dofs[k]);
    place.push_back(local);
    const std::int64_t* rows = r.dofs.data() + k + 1;
    if (fresh)
      s.rows.insert(s.rows.end(), rows, rows + d);
  }
  for (std::size_t k = 0; k < r.facets.size(); k += facet_header + n + m)
  {
    const std::int64_t* nodes = r.facets.data() + k + facet_header;
    s.facet_id.push_back(r.facets[k]);
    s.thickness.push_back(std::bit_cast<double>(r.facets[k + 1]));
    s.body.push_back(static_cast<Index>(r.facets[k + 2]));
    for (std::size_t a = 0; a < n; ++a)
      s.facet_nodes.push_back(node_number(nodes[a]).first);
    for (std::size_t a = 0; a < m; ++a)
      s.facet_dofs.push_back(dof_number(nodes[n + a]).first);
  }
  s.neighbours = find_neighbours(s);
  return s;
}

/// Rows of a table in the order in which they are sent
template <class T>
std::vector<T> chosen_rows(std::span<const T> table, std::size_t width,
                           const std::vector<Index>& rows)
{
  std::vector<T> items;
  items.reserve(rows.size() * width);
  for (const Index row : rows)
  {
    const auto values = table.subspan(row * width, width);
    items.insert(items.end(), values.begin(), values.end());
  }
  return items;
}
} // namespace

Halo::Halo(MPI_Comm comm, const Surface& own,
           std::span<const std::int64_t> node_ids,
           std::span<const std::int64_t> dof_ids,
           std::span<const double> wanted)
{
  const Published all = publish(comm, wanted);
  Parcel parcel;
  const auto add = [&](int rank, const std::vector<Index>& facets)
  { pack(own, node_ids, dof_ids, rank, facets, parcel); };
  if (own.gdim == 2)
    for_each_demand<2>(own, all, add);
  else
    for_each_demand<3>(own, all, add);
  _exchange.emplace(comm, std::move(parcel.ranks), std::move(parcel.counts),
                    kinds);
  const int facet_width = static_cast<int>(facet_header) +
                          own.nodes_per_facet() + own.dofs_per_facet();
  Received r;
  r.facets = _exchange->send(parcel.facets, facets_kind, facet_width);
  r.nodes = _exchange->send(parcel.nodes, nodes_kind, 1);
  r.positions = _exchange->send(parcel.positions, nodes_kind, 3 * own.gdim);
  r.dofs = _exchange->send(parcel.dofs, dofs_kind, 1 + own.gdim);
  _send_facets = std::move(parcel.send_facets);
  _send_dofs = std::move(parcel.send_dofs);
  _surface = unpack(own, r, _place);
  _facet_traffic = _exchange->traffic();
}

std::vector<double> Halo::fetch(std::span<const double> own, int width) const
{
  const std::size_t w = width;
  const std::vector<double> received =
      _exchange->send(chosen_rows(own, w, _send_dofs), dofs_kind, width);
  std::vector<double> values(_surface.num_dofs() * w, 0.0);
  for (std::size_t k = 0; k < _place.size(); ++k)
    std::copy_n(received.begin() + static_cast<std::ptrdiff_t>(k * w), w,
                values.begin() + static_cast<std::ptrdiff_t>(_place[k] * w));
  return values;
}

std::vector<double> Halo::fetch_facets(std::span<const double> own,
                                       int width) const
{
  return _exchange->send(chosen_rows(own, width, _send_facets), facets_kind,
                         width);
}

std::vector<std::int64_t> Halo::fetch_facets(std::span<const std::int64_t> own,
                                             int width) const
{
  return _exchange->send(chosen_rows(own, width, _send_facets), facets_kind,
                         width);
}

Traffic Halo::value_traffic() const
{
  const Traffic& all = _exchange->traffic();
  return {all.messages - _facet_traffic.messages,
          all.bytes - _facet_traffic.bytes};
}
} // namespace raymortar
