// Cuts of a slave facet by the true corners and edges of a master, seen along
// the slave's own rays.
#pragma once

#include "raymortar/geometry/curvature.h"
#include "raymortar/geometry/predicates.h"
#include <limits>

namespace raymortar
{
/// @brief Geometry that determines a vertex of a segment, and moves it with the
/// bodies.
struct Break
{
  enum class Motion : std::int8_t
  {
    fixed,        ///< to the slave: its own corner, or not known
    corner,       ///< under a corner of the master
    crossing,     ///< where an edge of the slave crosses one of the master
    flat_corner,  ///< the same two where the flat patches have them
    flat_crossing ///< instead of the true facets
  };
  Motion motion = Motion::fixed;
  /// The master's point there; flat_crossing: where the master's edge begins
  Vec<2> eta = Vec<2>::Zero();
  Vec<2> along_s = Vec<2>::Zero(); ///< of the slave's edge in xi; crossing
  Vec<2> along_m = Vec<2>::Zero(); ///< of the master's edge in eta; crossing
  Index master = no_index;         ///< the segment's own, or of a nearer layer

  [[nodiscard]] bool moves() const { return motion != Motion::fixed; }
  [[nodiscard]] bool is_flat() const
  {
    return motion == Motion::flat_corner or motion == Motion::flat_crossing;
  }
};

/// @brief An edge in reference coordinates: begin + s along, 0 <= s <= 1.
template <int T>
struct ReferenceEdge
{
  Vec<T> begin;
  Vec<T> along;

  [[nodiscard]] Vec<T> at(double s) const { return begin + s * along; }
  /// Nearest place on the edge's line
  [[nodiscard]] double place_of(const Vec<T>& xi) const
  {
    return along.dot(xi - begin) / along.squaredNorm();
  }
};

namespace detail
{
/// Step of Newton's method, or NaN where the columns nearly depend on each
/// other
template <int D>
[[nodiscard]] Vec<D> newton_step(const Mat<D, D>& A, const Vec<D>& r,
                                 double limit)
{
  const double volume = std::abs(A.determinant());
  if (not(volume > limit * A.colwise().norm().prod()))
    return Vec<D>::Constant(std::numeric_limits<double>::quiet_NaN());
  return A.inverse() * r;
}

/// Both neighbours at a break must find the same one: few steps from a start
/// that they share, or none
inline constexpr int break_steps = 8;
} // namespace detail

/// @brief Slave point whose ray meets a given point: x_s(xi) + g n(xi) = x
/// [theory (3.5)].
/// @param[in] slave Deformed slave nodes, (gdim, nodes). Length
/// @param[in,out] xi Start and, if true is returned, the solution
/// @return Whether it was found, not further off than tolerance::break_move
template <class F>
[[nodiscard]] bool ray_through(const typename F::NodeMatrix& slave,
                               const typename F::Point& x,
                               typename F::RefPoint& xi)
{
  constexpr int D = F::gdim;
  // From the target, where positions lose no digits to an offset
  const typename F::NodeMatrix nodes = slave.colwise() - x;
  typename F::RefPoint at = xi;
  Frame<D> f = frame_at<F>(nodes, at);
  double g = -f.n.dot(f.x);
  for (int step = 0; step < detail::break_steps; ++step)
  {
    Mat<D, D> A;
    A.template leftCols<D - 1>() = f.t + g * curvature_at<F>(nodes, at, f).n;
    A.col(D - 1) = f.n;
    const Vec<D> dz =
        detail::newton_step<D>(A, -f.x - g * f.n, tolerance::parallel);
    at += dz.template head<D - 1>();
    g += dz[D - 1];
    const double move = (at - xi).cwiseAbs().maxCoeff();
    if (not(move <= tolerance::astray))
      return false;
    if (dz.template head<D - 1>().cwiseAbs().maxCoeff() < tolerance::ray_step)
    {
      const bool near = move <= tolerance::break_move;
      xi = near ? at : xi;
      return near;
    }
    f = frame_at<F>(nodes, at);
  }
  return false;
}

/// @brief Where an edge of the slave, seen along its rays, crosses one of the
/// master: x_s(xi(s)) + g n(xi(s)) = x_m(eta(t))   [theory (3.6)].
/// @param[in,out] s, t Start and, if true is returned, the solution
/// @return Whether it was found, not further off than tolerance::break_move,
/// where the edges do not run along each other
template <class S, class M>
[[nodiscard]] bool cross_edges(const typename S::NodeMatrix& slave,
                               const ReferenceEdge<2>& edge_s,
                               const typename M::NodeMatrix& master,
                               const ReferenceEdge<2>& edge_m, double& s,
                               double& t) requires(S::gdim == 3)
{
  const Vec<3> origin = slave * S::Node::values(edge_s.at(s));
  const typename S::NodeMatrix nodes_s = slave.colwise() - origin;
  const typename M::NodeMatrix nodes_m = master.colwise() - origin;
  Vec<3> z(s, 0.0, t);
  for (int step = 0; step < detail::break_steps; ++step)
  {
    const Vec<2> xi = edge_s.at(z[0]), eta = edge_m.at(z[2]);
    const Frame<3> f = frame_at<S>(nodes_s, xi);
    const Vec<3> apart = nodes_m * M::Node::values(eta) - f.x;
    if (step == 0)
      z[1] = f.n.dot(apart);
    Mat<3, 3> A;
    A.col(0) = (f.t + z[1] * curvature_at<S>(nodes_s, xi, f).n) * edge_s.along;
    A.col(1) = f.n;
    A.col(2) = -(nodes_m * M::Node::gradients(eta)) * edge_m.along;
    const Vec<3> dz =
        detail::newton_step<3>(A, apart - z[1] * f.n, tolerance::along);
    z += dz;
    const double move = std::max(std::abs(z[0] - s), std::abs(z[2] - t));
    if (not(move <= tolerance::astray))
      return false;
    if (std::max(std::abs(dz[0]), std::abs(dz[2])) < tolerance::ray_step)
    {
      const bool near = move <= tolerance::break_move;
      s = near ? z[0] : s;
      t = near ? z[2] : t;
      return near;
    }
  }
  return false;
}
} // namespace raymortar
