// Facets of any kind, where targets were, and how vertices of segments move.
#pragma once

#include "raymortar/element/assembler.h"
#include "raymortar/element/taylor_facet.h"
#include "raymortar/element/vertex_motion.h"
#include "raymortar/geometry/taylor.h"

namespace raymortar
{
/// @brief Facet of a surface whose type is known at run time.
template <int D>
struct AnyFacet
{
  static constexpr int T = D - 1;
  using Nodes = Eigen::Matrix<double, D, Eigen::Dynamic, 0, D, 9>;
  Shape shape;
  int degree;
  Nodes nodes; ///< (gdim, nodes). Length

  AnyFacet(const Surface& s, const std::vector<double>& positions, Index facet)
      : shape(s.shape), degree(s.node_degree)
  {
    const auto n = static_cast<std::size_t>(s.nodes_per_facet());
    nodes.resize(D, static_cast<Eigen::Index>(n));
    for (std::size_t a = 0; a < n; ++a)
      nodes.col(static_cast<Eigen::Index>(a)) = Eigen::Map<const Vec<D>>(
          positions.data() +
          D * s.facet_nodes[static_cast<std::size_t>(facet) * n + a]);
  }

  /// Largest distance between two corners. Length
  [[nodiscard]] double diameter() const
  {
    const int corners = shape == Shape::interval   ? 2
                        : shape == Shape::triangle ? 3
                                                   : 4;
    double d = 0.0;
    for (int i = 0; i < corners; ++i)
      for (int j = 0; j < i; ++j)
        d = std::max(d, (nodes.col(i) - nodes.col(j)).norm());
    return d;
  }

  /// Taylor coefficients at a point
  [[nodiscard]] typename TaylorFacet<D>::NodeMatrix
  taylor(const Vec<2>& eta) const
  {
    const ShapeTaylor<T> N =
        shape_taylor<T>(shape, degree, Vec<T>(eta.template head<T>()));
    typename TaylorFacet<D>::NodeMatrix sum =
        TaylorFacet<D>::NodeMatrix::Zero();
    for (Eigen::Index a = 0; a < N.rows(); ++a)
      for (int c = 0; c < taylor_size<T>; ++c)
        for (int i = 0; i < D; ++i)
          sum(i, c) += nodes(i, a) * N(a, c);
    return sum;
  }
  [[nodiscard]] Vec<D> at(const Vec<2>& eta) const
  {
    return taylor(eta).col(0);
  }
  /// Derivative along a direction in eta
  [[nodiscard]] Vec<D> along(const Vec<2>& eta, const Vec<2>& direction) const
  {
    return taylor(eta).template middleCols<T>(1) * direction.template head<T>();
  }
};

/// @brief Position and unit normal at the accepted step.
template <int D>
struct OldTarget
{
  Vec<D> x;
  Vec<D> n;
};

/// @brief Where what a point has hit was at the accepted step.
/// @param[in] x Slave position there, n the normal
template <int D>
[[nodiscard]] OldTarget<D> old_target(const ContactState& s, std::size_t q,
                                      const Vec<D>& x, const Vec<D>& n);

/// @brief Motion of a vertex along the slave facet by the unknowns of one side.
template <int D>
using MotionColumns =
    Eigen::Matrix<double, D - 1, Eigen::Dynamic, D == 2 ? 1 : 0, D - 1, 9 * D>;

/// @brief Motion of a vertex of a segment, as VertexMotion has it.
template <int D>
struct AnyVertexMotion
{
  MotionColumns<D> by_slave; ///< by its dofs
  Mat<D - 1, D> by_master;
  MasterPlace place;
};

/// @param[in] vertex Number in the segmentation
template <int D>
[[nodiscard]] AnyVertexMotion<D>
any_vertex_motion(const ContactState& s, const Segment& of,
                  const AnyFacet<D>& master, std::size_t vertex);

/// @brief Motion of a vertex over the dofs of a master facet, (gdim - 1, dofs).
/// @param[in] by_master By the displacement of a place on the facet
template <int D>
[[nodiscard]] MotionColumns<D> master_columns(const Surface& master,
                                              const MasterPlace& place,
                                              const Mat<D - 1, D>& by_master);
} // namespace raymortar
