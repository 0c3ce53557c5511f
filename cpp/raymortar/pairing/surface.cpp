#include "raymortar/pairing/surface.h"
#include "raymortar/geometry/dispatch.h"
#include "raymortar/geometry/frame.h"
#include <algorithm>
#include <array>

namespace raymortar
{
namespace
{
/// An edge by its sorted corner nodes, and where it was seen
struct Edge
{
  std::array<Index, 2> ends;
  Index facet;
  int number;
};

template <class F>
std::vector<Edge> collect_edges(const Surface& s)
{
  std::vector<Edge> edges;
  edges.reserve(static_cast<std::size_t>(s.num_facets()) * F::Ref::edges);
  for (Index f = 0; f < s.num_facets(); ++f)
  {
    const Index* node =
        s.facet_nodes.data() + static_cast<std::size_t>(f) * F::nodes;
    for (int e = 0; e < F::Ref::edges; ++e)
    {
      const auto corner = [&](int k)
      { return node[F::Ref::cycle[static_cast<std::size_t>(k)]]; };
      const Index a = corner(e);
      // The "edges" of an interval are its ends
      const Index b = F::tdim == 1 ? a : corner((e + 1) % F::Ref::edges);
      edges.push_back({{std::min(a, b), std::max(a, b)}, f, e});
    }
  }
  return edges;
}

template <class F>
std::vector<Index> neighbours_of(const Surface& s)
{
  std::vector<Edge> edges = collect_edges<F>(s);
  std::sort(edges.begin(), edges.end(),
            [](const Edge& a, const Edge& b) { return a.ends < b.ends; });
  std::vector<Index> result(edges.size(), no_index);
  for (std::size_t i = 0; i < edges.size();)
  {
    std::size_t j = i;
    while (j < edges.size() and edges[j].ends == edges[i].ends)
      ++j;
    const auto slot = [](const Edge& e)
    {
      return static_cast<std::size_t>(e.facet) * F::Ref::edges +
             static_cast<std::size_t>(e.number);
    };
    if (j - i == 2)
    {
      result[slot(edges[i])] = edges[i + 1].facet;
      result[slot(edges[i + 1])] = edges[i].facet;
    }
    i = j;
  }
  return result;
}

template <class F>
std::vector<double> displaced_nodes(const Surface& s, std::span<const double> u)
{
  std::vector<double> x = s.X;
  if constexpr (F::degree == F::node_degree)
  {
    for (std::size_t i = 0; i < x.size(); ++i)
      x[i] += u[i];
    return x;
  }
  // Node values of the lower-degree displacement; nodes shared by facets get
  // the same value from each
  for (Index f = 0; f < s.num_facets(); ++f)
  {
    const auto dofs = s.dofs_of<F>(f);
    for (std::size_t a = 0; a < F::nodes; ++a)
    {
      const auto node = static_cast<std::size_t>(
          s.facet_nodes[static_cast<std::size_t>(f) * F::nodes + a]);
      const typename F::RefPoint xi(F::Node::points[a].data());
      const Vec<F::dofs> N = F::Disp::values(xi);
      for (std::size_t i = 0; i < F::gdim; ++i)
      {
        double value = 0.0;
        for (int b = 0; b < F::dofs; ++b)
          value +=
              N[b] *
              u[static_cast<std::size_t>(dofs[static_cast<std::size_t>(b)]) *
                    F::gdim +
                i];
        x[node * F::gdim + i] = s.X[node * F::gdim + i] + value;
      }
    }
  }
  return x;
}
} // namespace

int Surface::nodes_per_facet() const
{
  return with_facet_type(*this, []<class F>(F) { return F::nodes; });
}

int Surface::dofs_per_facet() const
{
  return with_facet_type(*this, []<class F>(F) { return F::dofs; });
}

int Surface::corners() const
{
  return with_facet_type(*this, []<class F>(F) { return F::Ref::corners; });
}

std::vector<double> displaced(const Surface& s, std::span<const double> u)
{
  return with_facet_type(s,
                         [&]<class F>(F) { return displaced_nodes<F>(s, u); });
}

std::vector<Index> find_neighbours(const Surface& s)
{
  return with_geometry(s, [&]<class F>(F) { return neighbours_of<F>(s); });
}

std::vector<double> diameters(const Surface& s,
                              const std::vector<double>& positions)
{
  return with_geometry(s,
                       [&]<class F>(F)
                       {
                         std::vector<double> d;
                         d.reserve(static_cast<std::size_t>(s.num_facets()));
                         for (Index f = 0; f < s.num_facets(); ++f)
                           d.push_back(diameter<F>(s.nodes<F>(positions, f)));
                         return d;
                       });
}

double largest_diameter(const Surface& s, const std::vector<double>& positions)
{
  return with_geometry(s,
                       [&]<class F>(F)
                       {
                         double d = 0.0;
                         for (Index f = 0; f < s.num_facets(); ++f)
                           d = std::max(d,
                                        diameter<F>(s.nodes<F>(positions, f)));
                         return d;
                       });
}
} // namespace raymortar
