// One point of a tie, whatever the facets there are.
#pragma once

#include "raymortar/element/target.h"
#include "raymortar/geometry/frame.h"
#include "raymortar/geometry/predicates.h"

namespace raymortar
{
/// @brief Displacements of an element's dofs, slave before master, (gdim,
/// dofs).
template <int D>
using TieDisplacements = Eigen::Matrix<double, D, Eigen::Dynamic, 0, D, 18>;

/// @brief What a point of a tie keeps of the undeformed bodies.
template <int D>
struct TiePoint
{
  static constexpr int T = D - 1;
  double weight;          ///< area that the point stands for
  double gap;             ///< g_0; 0 where it is none to rounding. Length
  Vec<D> n0;              ///< slave's normal
  double gamma;           ///< coefficient of a penalty, traction per length
  Eigen::VectorXd test;   ///< shape functions of the multiplier
  Eigen::VectorXd across; ///< those of the displacements: - slave's, master's
  Eigen::Matrix<double, Eigen::Dynamic, T> dN;    ///< slave's, along xi
  Eigen::Matrix<double, Eigen::Dynamic, T> dNode; ///< of its positions

  TiePoint(const ContactState& s, std::size_t q, Index master)
  {
    const auto xi = Vec<T>(s.points.xi[q].template head<T>());
    const auto eta = Vec<T>(s.hits.eta[q].template head<T>());
    const Surface &slave = s.slave, &other = s.master;
    const Index facet = s.points.slave[q];
    const auto N = shape_taylor<T>(slave.shape, slave.degree, xi);
    const auto M = shape_taylor<T>(other.shape, other.degree, eta);
    dN = N.template middleCols<T>(1);
    dNode = shape_taylor<T>(slave.shape, slave.node_degree, xi)
                .template middleCols<T>(1);
    across.resize(N.rows() + M.rows());
    across << -N.col(0), M.col(0);
    if (s.multipliers.components > 0)
      test = shape_taylor<T>(slave.shape, s.multipliers.degree, xi).col(0);
    weight = s.points.area[q];
    gamma = coefficient(s, facet, master, N.col(0));
    const AnyFacet<D> undeformed(slave, slave.X, facet);
    n0 = frame(undeformed).n;
    const bool none =
        std::abs(s.hits.gap[q]) <= tolerance::touch * undeformed.diameter();
    gap = none ? 0.0 : s.hits.gap[q];
  }

  /// Tangents and normal of the slave
  [[nodiscard]] Frame<D> frame(const AnyFacet<D>& slave) const
  {
    Frame<D> f;
    f.x.setZero();
    f.t = slave.nodes * dNode;
    set_normal(f);
    return f;
  }

private:
  static double coefficient(const ContactState& s, Index facet, Index master,
                            const Eigen::VectorXd& N)
  {
    const auto first =
        static_cast<Eigen::Index>(facet) * N.size(); // of the facet's dofs
    const Eigen::Map<const Eigen::VectorXd> nodal(s.gamma.nodal.data() + first,
                                                  N.size());
    return nodal.dot(N) *
           s.pair_factors.of(s.slave.body_of(facet), s.master.body_of(master));
  }
};

/// @brief How far a tie is open at a point, and how that varies.
template <int D>
struct TieOpening
{
  Vec<D> n; ///< slave's present normal
  Vec<D> c; ///< x_m - x_s - g_0 n, or x_m - x_s where gaps are closed. Length
  /// Surface gradients of the slave's shape functions, (gdim, slave dofs);
  /// empty where nothing turns
  Eigen::Matrix<double, D, Eigen::Dynamic> G;

  /// @param[in] u Displacements of slave's and master's dofs
  /// @param[in] turns Whether the gap is kept, and is not zero
  TieOpening(const TiePoint<D>& p, const AnyFacet<D>& slave,
             const TieDisplacements<D>& u, bool turns)
  {
    const Frame<D> f = p.frame(slave);
    n = f.n;
    // In displacements: of undeformed bodies it is zero, not a rounding error
    c = u * p.across + p.gap * p.n0;
    if (not turns)
      return;
    c -= p.gap * n;
    G = dual_tangents(f) * p.dN.transpose();
  }
};

template <int D>
void put_at(std::vector<double>& values, std::size_t q, const Vec<D>& value)
{
  Eigen::Map<Vec<D>>(values.data() + static_cast<std::size_t>(D) * q) = value;
}

/// @brief Results of a tie at points that have no master.
template <int D>
PointResults tied_nowhere(const ContactState& s)
{
  const std::size_t n = s.points.size();
  const std::vector<double> numbers(n, 0.0), vectors(n * D, 0.0);
  PointResults r{.status = std::vector(n, ContactStatus::none),
                 .gap = numbers,
                 .pressure = numbers,
                 .traction = vectors,
                 .weight = s.points.area,
                 .x = vectors,
                 .normal = vectors,
                 .contact_normal = vectors,
                 .master_normal = vectors,
                 .gamma = numbers,
                 .slip = vectors,
                 .closing = numbers,
                 .friction = vectors,
                 .dissipated = numbers};
  for (std::size_t q = 0; q < n; ++q)
  {
    const Frame<D> f = frame_at<TaylorFacet<D>>(
        AnyFacet<D>(s.slave, s.slave.x, s.points.slave[q])
            .taylor(s.points.xi[q]),
        Vec<D - 1>::Zero());
    put_at<D>(r.x, q, f.x);
    put_at<D>(r.normal, q, f.n);
    put_at<D>(r.contact_normal, q, f.n);
  }
  return r;
}
} // namespace raymortar
