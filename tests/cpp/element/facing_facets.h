// A slave facet and a master facet that face each other, for elements of every
// kind of law.
#pragma once

#include "differences.h"
#include "facet_types.h"
#include "raymortar/element/element.h"
#include "raymortar/geometry/ray.h"
#include "raymortar/law/augmented.h"
#include "raymortar/law/penalty.h"

namespace raymortar::test
{
/// Facet type, degree of the multiplier and law of an element
template <class Facet, int Degree, class L>
struct Case
{
  using F = Facet;
  static constexpr int multiplier_degree = Degree;
  using Law = L;
  using Kernel = Element<Facet, Degree, L>;
  using Layout = typename Kernel::Layout;
  using Data = typename Kernel::Data;
};

/// A slave facet and a master facet that faces it at about the gap, with
/// points on the slave whose rays meet the master
template <class C>
struct FacingFacets
{
  using F = typename C::F;
  using Layout = typename C::Layout;
  using Miss = SlavePoint<F, C::multiplier_degree, typename C::Law>;
  using Hit = HitPoint<F, C::multiplier_degree, typename C::Law>;
  static constexpr int D = F::gdim;

  typename C::Data start;
  std::vector<ElementPoint<F>> points;

  FacingFacets(std::mt19937& random, double gap, bool current)
  {
    start.slave = random_nodes<F>(random, 0.04);
    start.master = 1.4 * random_nodes<F>(random, 0.04);
    const double up = D == 2 ? -1 : 1;
    start.master.row(D - 1) *= -1;
    start.master.row(D - 1).array() += up * gap;
    start.master.template topRows<D - 1>().array() -= 0.2;
    // Turned about to face the slave: the first two axes change places, or
    // the only one its direction
    if constexpr (D == 3)
      start.master.row(0).swap(start.master.row(1));
    else
      start.master.row(0) = -start.master.row(0).array() + 1;
    // The slave was of another shape before
    start.reference = start.slave;
    start.reference.row(0) *= 1.3;
    start.reference.row(D - 1).array() +=
        0.2 * start.slave.row(0).array().square();
    fill_random(random, start.lam, 1.0);
    start.lam.array() -= 1.5;
    start.lam_scale = 0.7;
    start.gamma = Vec<F::dofs>::Constant(5) + random_vector<F::dofs>(random, 1);
    start.measure = current ? Measure::current : Measure::reference;
    if constexpr (is_frictional<typename C::Law>)
    {
      auto& old = start.history;
      const bool slip = random() % 2 == 0;
      old.slave_old = start.slave;
      old.master_old = start.master;
      if constexpr (D == 3)
      {
        // Both have turned about the normal since then, and been stretched
        spin(old.slave_old, 0.05, 1.1);
        spin(old.master_old, -0.04, 0.9);
      }
      old.slave_old.row(0).array() += slip ? 0.5 : 0.01;
      // With a multiplier a length
      old.traction_old.setConstant(Layout::multiplier_dofs > 0 ? 0.02 : 0.1);
      old.friction = Coulomb{slip ? 0.4 : 20.0};
    }
    for (int q = 0; q < 5; ++q)
      points.push_back({0.8 * random_inside<F>(random), F::RefPoint::Zero(),
                        0.1 + 0.05 * q, 0.12 + 0.03 * q, 0});
    start.offset.setConstant(random() % 2 == 0 ? 0.01 : 0.0);
  }

  static void spin(typename F::NodeMatrix& nodes, double angle, double stretch)
  {
    const double c = std::cos(angle), s = std::sin(angle);
    Mat<2, 2> turn;
    turn << stretch * c, -s, stretch * s, c;
    nodes.template topRows<2>() = (turn * nodes.template topRows<2>()).eval();
  }

  /// As sections of solids of revolution about an axis that is near
  void revolve()
  {
    static_assert(D == 2);
    start.measure = moves(start.measure) ? Measure::current_of_revolution
                                         : Measure::reference_of_revolution;
    for (auto* nodes : {&start.slave, &start.master, &start.reference})
      nodes->row(0).array() += 0.2;
    if constexpr (is_frictional<typename C::Law>)
      for (auto* nodes : {&start.history.slave_old, &start.history.master_old})
        nodes->row(0).array() += 0.2;
  }

  /// Unknowns: displacements and multiplier, at the start position
  [[nodiscard]] Eigen::VectorXd unknowns() const
  {
    Eigen::VectorXd z = Eigen::VectorXd::Zero(Layout::size);
    z.segment(Layout::side, Layout::multiplier_dofs) =
        Eigen::Map<const Eigen::VectorXd>(start.lam.data(), start.lam.size());
    return z;
  }

  /// Displaced by z: nodes follow the dofs by their shape functions
  [[nodiscard]] typename C::Data at(const Eigen::VectorXd& z) const
  {
    typename C::Data e = start;
    for (int a = 0; a < F::nodes; ++a)
    {
      const Vec<F::dofs> N = F::Disp::values(typename F::RefPoint(
          F::Node::points[static_cast<std::size_t>(a)].data()));
      for (int b = 0; b < F::dofs; ++b)
      {
        e.slave.col(a) += N[b] * z.segment<D>(D * b);
        e.master.col(a) += N[b] * z.segment<D>(Layout::master + D * b);
      }
    }
    e.lam = Eigen::Map<const decltype(e.lam)>(z.data() + Layout::side);
    return e;
  }

  /// The point with its ray cast anew
  [[nodiscard]] ElementPoint<F> cast(const typename C::Data& e,
                                     ElementPoint<F> q) const
  {
    const auto frame = frame_at<F>(e.slave, q.xi);
    const auto hit = intersect<F>(frame.x, frame.n, e.master,
                                  flat_guess<F>(frame.x, frame.n, e.master));
    EXPECT_EQ(hit.status, RayStatus::hit);
    EXPECT_LT(frame.n.dot(frame_at<F>(e.master, hit.eta).n), -0.5);
    q.eta = hit.eta;
    q.g = hit.g;
    return q;
  }

  [[nodiscard]] Eigen::VectorXd residual(const Eigen::VectorXd& z,
                                         bool hit) const
  {
    const auto kernel = std::make_unique<typename C::Kernel>();
    kernel->b.setZero();
    const typename C::Data e = at(z);
    for (const ElementPoint<F>& q : points)
    {
      if (hit)
        kernel->add_hit(Hit(e, cast(e, q)));
      else
        kernel->add_miss(Miss(e, q));
    }
    return kernel->b;
  }

  [[nodiscard]] Eigen::MatrixXd tangent(const Eigen::VectorXd& z,
                                        bool hit) const
  {
    const auto kernel = std::make_unique<typename C::Kernel>();
    kernel->A.setZero();
    const typename C::Data e = at(z);
    for (const ElementPoint<F>& point : points)
    {
      const auto q = hit ? cast(e, point) : point;
      if (not hit)
        kernel->add_miss_tangent(e, q, Miss(e, q));
      else
      {
        const Hit p(e, q);
        kernel->add_hit_tangent(e, p, {e, q, p});
      }
    }
    return kernel->A;
  }

  void expect_tangent(bool hit) const
  {
    const Eigen::MatrixXd A = tangent(unknowns(), hit);
    expect_derivative([&](const Eigen::VectorXd& z) -> Eigen::VectorXd
                      { return residual(z, hit); },
                      unknowns(), A);
  }
};

/// Kinds of facets, multipliers and laws that typed tests run over
using Line12 = FacetType<Shape::interval, 1, 2>;
using ElementCases =
    testing::Types<Case<Interval1, 1, NormalAugmentedLagrangian>,
                   Case<Interval2, 2, FrictionalAugmentedLagrangian>,
                   Case<Line12, 0, NormalPenalty>,
                   Case<Triangle1, 1, VectorAugmentedLagrangian>,
                   Case<Triangle2, 1, NormalAugmentedLagrangian>,
                   Case<Quad1, 0, FrictionalPenalty>>;
} // namespace raymortar::test
