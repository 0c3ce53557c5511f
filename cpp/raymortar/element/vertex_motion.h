// Motion of segment vertices on the slave, with the bodies.
#pragma once

#include "raymortar/geometry/curvature.h"
#include "raymortar/geometry/patch.h"
#include "raymortar/mortar/segmentation.h"

namespace raymortar
{
/// @brief The matrix of (3.9) or (3.10), inverted.
template <class F>
struct VertexSystem
{
  static constexpr int D = F::gdim;
  static constexpr int T = F::tdim;

  /// Edges do not run along each other: else their crossing may be anywhere
  bool regular = false;
  bool crosses = false;
  Mat<D, D> inverse; ///< unknowns (dxi, dg) or (ds, dt, dg)
  Mat<T, D> by_u;    ///< dxi per right-hand side

  /// @param[in] along_xi How the point on the ray moves with xi, length
  /// @param[in] along_m Tangent of the master's edge; crossings only
  VertexSystem(const Mat<D, T>& along_xi, const Vec<D>& n,
               const Vec<D>& along_m, const Break& hangs_on)
      : crosses(hangs_on.motion == Break::Motion::crossing or
                hangs_on.motion == Break::Motion::flat_crossing)
  {
    Mat<D, D> A;
    Mat<T, D> by_z = Mat<T, D>::Zero(); // dxi of the unknowns
    A.col(D - 1) = n;
    if (crosses)
    {
      by_z.col(0) = hangs_on.along_s.template head<T>();
      A.col(0) = along_xi * by_z.col(0);
      A.col(1) = -along_m;
    }
    else
    {
      A.template leftCols<T>() = along_xi;
      by_z.template leftCols<T>().setIdentity();
    }
    regular = std::abs(A.determinant()) >
              tolerance::along * A.colwise().norm().prod();
    if (not regular)
      return;
    inverse = A.inverse();
    by_u = by_z * inverse;
  }
};

/// @brief A point of a master facet by the ends of a part of one of its edges:
/// its displacement is (1 - share) u(begin) + share u(end).
struct MasterPlace
{
  Vec<2> begin; ///< reference coordinates
  Vec<2> end;
  double share = 0.0;
};

/// @brief dxi of a vertex. Zero where two edges run along each other: their
/// crossing may be anywhere on them.
template <class F>
struct VertexMotion
{
  static constexpr int D = F::gdim;
  static constexpr int T = F::tdim;
  Mat<T, F::dofs* D> by_slave =
      Mat<T, F::dofs * D>::Zero();         ///< by the slave's displacement dofs
  Mat<T, D> by_master = Mat<T, D>::Zero(); ///< by the master's displacement
  MasterPlace place{Vec<2>::Zero(), Vec<2>::Zero()}; ///< there
};

/// @brief Positions of a master facet of type F.
template <class F>
struct MasterNodes
{
  typename F::NodeMatrix nodes; ///< deformed, (gdim, nodes). Length

  [[nodiscard]] Vec<F::gdim> at(const Vec<2>& eta) const
  {
    return nodes * F::Node::values(eta.template head<F::tdim>());
  }
  /// Derivative along a direction in eta
  [[nodiscard]] Vec<F::gdim> along(const Vec<2>& eta,
                                   const Vec<2>& direction) const
  {
    return nodes * (F::Node::gradients(eta.template head<F::tdim>()) *
                    direction.template head<F::tdim>());
  }
};

/// @brief A slave facet at a point: its frame and how shape functions turn it.
template <class F>
struct SlaveGeometry
{
  Frame<F::gdim> slave;
  Vec<F::dofs> N_s;           ///< shape functions at xi
  Mat<F::gdim, F::tdim> dual; ///< of the tangents, see dual_tangents
  Mat<F::gdim, F::dofs> G_s;  ///< surface gradients of N_s, 1/length

  SlaveGeometry(const typename F::NodeMatrix& nodes,
                const typename F::RefPoint& xi)
      : slave(frame_at<F>(nodes, xi)), N_s(F::Disp::values(xi)),
        dual(dual_tangents<F::gdim>(slave)),
        G_s(dual * F::Disp::gradients(xi).transpose())
  {
  }
};

/// @brief (3.5) or (3.6) differentiated.
/// @param[in] slave Deformed nodes, (gdim, nodes). Length
/// @param[in] master Like MasterNodes, of any facet type
/// @param[in] hangs_on Motion::corner or crossing
/// [theory (3.9), (3.10)]
template <class F, class Master>
[[nodiscard]] VertexMotion<F>
vertex_motion(const typename F::NodeMatrix& slave, const Master& master,
              const typename F::RefPoint& xi, const Break& hangs_on)
{
  constexpr int D = F::gdim;
  const SlaveGeometry<F> p(slave, xi);
  const double g = p.slave.n.dot(master.at(hangs_on.eta) - p.slave.x);
  const VertexSystem<F> system(
      p.slave.t + g * curvature_at<F>(slave, xi, p.slave, p.dual).n, p.slave.n,
      master.along(hangs_on.eta, hangs_on.along_m), hangs_on);
  VertexMotion<F> motion;
  if (not system.regular)
    return motion;
  // Applied to du_m - du_s - g dn, with dn = - sum_a G_a (n . du_a)
  const auto& by_u = system.by_u;
  const Mat<F::tdim, F::dofs> turn = (g * by_u) * p.G_s;
  for (int a = 0; a < F::dofs; ++a)
    for (int i = 0; i < D; ++i)
      for (int t = 0; t < F::tdim; ++t)
        motion.by_slave(t, a * D + i) =
            turn(t, a) * p.slave.n[i] - p.N_s[a] * by_u(t, i);
  motion.by_master = by_u;
  motion.place.begin = hangs_on.eta;
  motion.place.end = hangs_on.eta;
  return motion;
}

/// @brief A slave patch through its corners, in the order of Lagrange<S, 1>,
/// and the normal along which masters are projected.
template <class F>
struct FlatPatch
{
  static constexpr int D = F::gdim;
  static constexpr int T = F::tdim;
  static constexpr int corners = F::Ref::corners;
  using Shapes = Lagrange<F::shape, 1>;

  Mat<D, corners> x;
  Mat<F::dofs, corners> N;    ///< displacement's shape functions at the corners
  typename F::RefPoint begin; ///< first corner on the facet
  Mat<T, T> from_xi;
  Vec<D> n;
  Mat<D, corners> G; ///< surface gradients of the shapes at the barycentre

  FlatPatch(const typename F::NodeMatrix& nodes, const Patch& patch)
  {
    Mat<T, corners> xi;
    for (int c = 0; c < corners; ++c)
    {
      // Patches list their corners going around
      const int k = corners == 4 and c > 1 ? 5 - c : c;
      const int node = patch.node[static_cast<std::size_t>(k)];
      xi.col(c) = typename F::RefPoint(
          F::Node::points[static_cast<std::size_t>(node)].data());
      x.col(c) = nodes.col(node);
      N.col(c) = F::Disp::values(xi.col(c));
    }
    begin = xi.col(0);
    const Mat<T, T> to_xi = xi.template middleCols<T>(1).colwise() - begin;
    from_xi = to_xi.inverse();
    // On triangles it is the same everywhere
    const Mat<corners, T> dN = Shapes::gradients(F::RefPoint::Constant(0.5));
    const Mat<D, T> t = x * dN;
    n = normal_of(t).normalized();
    G = dual_tangents<D>(t) * dN.transpose();
  }
};

/// @brief The same of a vertex that has kept its flat place: the patches
/// through the corners are the facets, and the slave patch has one normal.
/// @param[in] hangs_on Motion::flat_corner or flat_crossing
template <class F, class Master>
[[nodiscard]] VertexMotion<F>
flat_motion(const FlatPatch<F>& slave, const Master& master,
            const typename F::RefPoint& xi, const Break& hangs_on)
{
  constexpr int D = F::gdim;
  using Shapes = typename FlatPatch<F>::Shapes;
  const typename F::RefPoint at = slave.from_xi * (xi - slave.begin);
  VertexMotion<F> motion;
  motion.place.begin = hangs_on.eta;
  motion.place.end = hangs_on.eta + hangs_on.along_m;
  const Vec<FlatPatch<F>::corners> N = Shapes::values(at);
  const Vec<D> x_m = master.at(motion.place.begin);
  const VertexSystem<F> system(slave.x * Shapes::gradients(at) * slave.from_xi,
                               slave.n, master.at(motion.place.end) - x_m,
                               hangs_on);
  if (not system.regular)
    return motion;
  // The vertex solves the system: position on the edge and height remain
  const Vec<D> z = system.inverse * (x_m - slave.x * N);
  motion.place.share = system.crosses ? z[1] : 0.0;
  motion.by_master = system.by_u;
  const Mat<F::tdim, FlatPatch<F>::corners> turn =
      (z[D - 1] * system.by_u) * slave.G;
  for (int a = 0; a < F::dofs; ++a)
    for (int c = 0; c < FlatPatch<F>::corners; ++c)
      for (int i = 0; i < D; ++i)
        for (int t = 0; t < F::tdim; ++t)
          motion.by_slave(t, a * D + i) +=
              slave.N(a, c) *
              (turn(t, c) * slave.n[i] - N[c] * system.by_u(t, i));
  return motion;
}

/// @brief The same of a vertex of a segment, on the true facets or where the
/// flat patches have it.
/// @param[in] vertex Number in the segmentation
template <class F, class Master>
[[nodiscard]] VertexMotion<F>
segment_vertex_motion(const Segmentation& s, const Segment& of,
                      const typename F::NodeMatrix& slave, const Master& master,
                      std::size_t vertex)
{
  const Break& hangs_on = s.breaks[vertex];
  const typename F::RefPoint xi = s.vertices[vertex].template head<F::tdim>();
  if (not hangs_on.is_flat())
    return vertex_motion<F>(slave, master, xi, hangs_on);
  const Patch& patch =
      patches<F>(s.subdivided)[static_cast<std::size_t>(of.slave_patch)];
  return flat_motion<F>(FlatPatch<F>(slave, patch), master, xi, hangs_on);
}

} // namespace raymortar
