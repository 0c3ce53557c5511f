// Rays from anywhere onto a bowl, and where they meet it.
#pragma once

#include "facet_types.h"
#include "raymortar/mortar/points.h"
#include "surfaces.h"

namespace raymortar::test
{
inline double bowl(double x, double y)
{
  return 0.5 * std::sin(3 * x + 0.3) * std::cos(2 * y + 0.1);
}

inline Map raised(double w, double amount, double gap)
{
  return graph(w,
               [=](double x, double y) { return amount * bowl(x, y) + gap; });
}

/// Rays from anywhere: one small slave facet each, whose normal is the ray
template <class F>
struct Rays
{
  Surface slave{
      F::shape, F::degree, F::node_degree, F::gdim, {}, {}, {}, {}, {}, {},
      {},       {}};
  IntegrationPoints points;

  void add(const typename F::Point& x, const typename F::Point& n, Index seed)
  {
    constexpr int D = F::gdim;
    const double middle = F::shape == Shape::triangle ? 1.0 / 3 : 0.5;
    Mat<D, D - 1> t;
    if constexpr (D == 2)
      t = Vec<2>(-n[1], n[0]);
    else
    {
      t.col(0) = n.unitOrthogonal();
      t.col(1) = n.cross(t.col(0));
    }
    for (const auto& point : F::Node::points)
    {
      const typename F::RefPoint from_middle =
          typename F::RefPoint(point.data()) - F::RefPoint::Constant(middle);
      const typename F::Point node = x + t * from_middle;
      slave.facet_nodes.push_back(static_cast<Index>(slave.x.size() / D));
      slave.x.insert(slave.x.end(), node.data(), node.data() + D);
    }
    points.slave.push_back(slave.num_facets());
    points.seed.push_back(seed);
    points.xi.push_back(Vec<2>::Constant(middle));
    slave.facet_id.push_back(slave.num_facets());
  }
};

template <class F>
Index neighbour(const Surface& s, Index facet, int edge)
{
  return s.neighbours[static_cast<std::size_t>(facet * F::Ref::edges + edge)];
}

/// Edge of a facet that it shares with another
template <class F>
int edge_to(const Surface& s, Index facet, Index other)
{
  int e = 0;
  while (neighbour<F>(s, facet, e) != other)
    ++e;
  return e;
}

/// Reference point on an edge; in 2D the end that stands for it
template <class F>
typename F::RefPoint on_edge(int e, double along)
{
  const auto corner = [&](int k)
  {
    const int c = F::Ref::cycle[static_cast<std::size_t>(k % F::Ref::corners)];
    return typename F::RefPoint(
        F::Node::points[static_cast<std::size_t>(c)].data());
  };
  if (F::tdim == 1)
    return corner(e);
  return corner(e) + along * (corner(e + 1) - corner(e));
}
} // namespace raymortar::test
