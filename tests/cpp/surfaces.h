// Structured surfaces over the unit square: flat, curved and moved.
#pragma once

#include "raymortar/geometry/dispatch.h"
#include "raymortar/mortar/points.h"
#include <functional>
#include <numeric>
#include <random>

namespace raymortar::test
{
/// @brief What a surface is made of. In 2D the second parameter is unused.
struct Grid
{
  Shape shape = Shape::interval;
  int degree = 1;
  int node_degree = 1;
  int n = 1;      ///< cells along each direction; a cell makes two triangles
  bool up = true; ///< the side the normals point to
};

/// Point (x, y, z) at (s, t) in the unit square; 2D takes (x, z) at (s, 0)
using Map = std::function<Vec<3>(double s, double t)>;

/// Height over the plate [-w, w]^2
inline Map graph(double w, std::function<double(double x, double y)> z)
{
  return [=](double s, double t)
  {
    const double x = w * (2 * s - 1), y = w * (2 * t - 1);
    return Vec<3>(x, y, z(x, y));
  };
}

inline Map plate(double w, double z)
{
  return graph(w, [z](double, double) { return z; });
}

namespace detail
{
/// Lattice numbers of the nodes of all facets, (facets, nodes per facet)
template <class Element, class F>
std::vector<Index> lattice_facets(int n, int degree)
{
  std::vector<Index> table;
  const int width = degree * n + 1;
  const int rows = F::tdim == 1 ? 1 : n;
  const int halves = F::shape == Shape::triangle ? 2 : 1;
  for (int cell = 0; cell < n * rows * halves; ++cell)
    for (const auto& p : Element::points)
    {
      const int square = cell / halves;
      std::array<int, 2> at = {0, 0};
      for (std::size_t i = 0; i < F::tdim; ++i)
      {
        const double from_corner = cell % halves == 0 ? p[i] : 1 - p[i];
        at[i] = static_cast<int>(degree * from_corner);
      }
      table.push_back(at[0] + degree * (square % n) +
                      width * (at[1] + degree * (square / n)));
    }
  return table;
}

template <class F>
Surface make(const Grid& grid, const Map& map)
{
  const int K = F::node_degree, P = F::degree, last = K * grid.n;
  Surface s{F::shape, P, K, F::gdim, {}, {}, {}, {}, {}, {}, {}, {}};
  // Normals of increasing parameters point down in 2D and up in 3D
  const bool mirror = grid.up == (F::tdim == 1);
  for (int j = 0; j <= (F::tdim == 1 ? 0 : last); ++j)
    for (int i = 0; i <= last; ++i)
    {
      const int k = mirror ? last - i : i;
      const Vec<3> x =
          map(static_cast<double>(k) / last, static_cast<double>(j) / last);
      s.X.push_back(x[0]);
      if (F::gdim == 3)
        s.X.push_back(x[1]);
      s.X.push_back(x[2]);
    }
  s.x = s.x_old = s.X;
  s.facet_nodes = lattice_facets<typename F::Node, F>(grid.n, K);
  s.facet_dofs = lattice_facets<typename F::Disp, F>(grid.n, P);
  const int width = P * grid.n + 1;
  const int dofs = F::tdim == 1 ? width : width * width;
  for (int k = 0; k < F::gdim * dofs; ++k)
    s.rows.push_back(k);
  s.facet_id.resize(s.facet_nodes.size() / F::nodes);
  for (std::size_t f = 0; f < s.facet_id.size(); ++f)
    s.facet_id[f] = static_cast<GlobalIndex>(f);
  s.neighbours = find_neighbours(s);
  return s;
}
} // namespace detail

inline Surface make_surface(const Grid& grid, const Map& map)
{
  return with_facet_type(grid, [&]<class F>(F)
                         { return detail::make<F>(grid, map); });
}

inline int dimension(Shape shape) { return shape == Shape::interval ? 2 : 3; }

/// Move every node, all positions alike
template <int D>
void transform(Surface& s, const std::function<Vec<D>(const Vec<D>&)>& move)
{
  for (std::size_t k = 0; k < s.X.size(); k += D)
  {
    Eigen::Map<Vec<D>> x(s.X.data() + k);
    x = move(x);
  }
  s.x = s.x_old = s.X;
}

/// Rotation about an oblique axis, then a shift along all axes
inline void turn_and_shift(Surface& s, double angle, double shift)
{
  if (s.gdim == 2)
    transform<2>(s,
                 [=](const Vec<2>& x) -> Vec<2> {
                   return Eigen::Rotation2Dd(angle) * x + Vec<2>(shift, -shift);
                 });
  else
    transform<3>(s,
                 [=](const Vec<3>& x) -> Vec<3>
                 {
                   const Eigen::AngleAxisd turn(angle,
                                                Vec<3>(1, 2, 3).normalized());
                   return turn * x + Vec<3>(shift, -shift, shift);
                 });
}

/// Move the inner nodes of a flat surface of degree 1 within its plane
inline void jitter(Surface& s, std::mt19937& random, double amount)
{
  const auto d = static_cast<std::size_t>(s.gdim);
  const auto corners = static_cast<std::size_t>(s.corners());
  std::vector<bool> rim(s.X.size() / d, false);
  const bool quad = s.shape == Shape::quadrilateral;
  for (std::size_t k = 0; k < s.neighbours.size(); ++k)
    if (s.neighbours[k] == no_index)
      for (std::size_t e = k % corners; e < k % corners + d - 1; ++e)
      {
        const std::size_t c = e % corners;
        const std::size_t corner = quad and c > 1 ? 5 - c : c;
        rim[static_cast<std::size_t>(s.facet_nodes[k - k % corners + corner])] =
            true;
      }
  std::uniform_real_distribution<double> move(-amount, amount);
  for (std::size_t node = 0; node < rim.size(); ++node)
    for (std::size_t i = 0; i + 1 < d and not rim[node]; ++i)
      s.X[node * d + i] += move(random);
  s.x = s.x_old = s.X;
}

inline double total(const std::vector<double>& values)
{
  return std::accumulate(values.begin(), values.end(), 0.0);
}

/// Candidates and segments
inline Segmentation segments_of(const Surface& slave, const Surface& master,
                                const SegmentationOptions& options)
{
  return make_segments(slave, master,
                       find_candidates(slave, master, options.distances),
                       options);
}

/// Two surfaces of one kind as one, nodes apart
inline Surface joined(Surface a, const Surface& b)
{
  const auto d = static_cast<std::size_t>(a.gdim);
  const auto append = [](auto& to, const auto& from, auto shift)
  {
    for (const auto value : from)
      to.push_back(value + shift);
  };
  append(a.facet_nodes, b.facet_nodes, static_cast<Index>(a.X.size() / d));
  append(a.facet_dofs, b.facet_dofs, a.num_dofs());
  append(a.facet_id, b.facet_id, static_cast<GlobalIndex>(a.num_facets()));
  append(a.rows, b.rows, static_cast<GlobalIndex>(a.num_dofs() * a.gdim));
  append(a.X, b.X, 0.0);
  a.x = a.x_old = a.X;
  a.neighbours = find_neighbours(a);
  return a;
}
} // namespace raymortar::test
