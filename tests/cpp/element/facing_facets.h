// A slave facet and a master facet that face each other, for elements of every
// kind of law.
#pragma once

#include "differences.h"
#include "facet_types.h"
#include "raymortar/element/assembler.h"
#include "raymortar/geometry/ray.h"
#include "raymortar/law/augmented.h"
#include "raymortar/law/frictional.h"
#include "raymortar/law/penalty.h"

namespace raymortar::test
{
/// Facet type, degree of the multiplier and law of an element
template <class Facet, int Degree, class L>
struct Case
{
  using F = Facet;
  using Law = L;
  static constexpr int multiplier_degree = Degree;
  static constexpr int components = Law::template multiplier_size<F::gdim>;
  static constexpr int multipliers = []
  {
    if constexpr (Degree > 0)
      return F::template Basis<Degree>::nodes;
    return 0;
  }();
  /// Unknowns come in the order [slave | multiplier | master]
  static constexpr int side = F::gdim * F::dofs;
  static constexpr int multiplier_dofs = components * multipliers;
  static constexpr int master = side + multiplier_dofs;
  static constexpr int size = 2 * side + multiplier_dofs;
};

/// Where they are, and what is known on the slave; length and traction
template <class C>
struct Facing
{
  using F = typename C::F;
  static constexpr int D = F::gdim;

  typename F::NodeMatrix slave, master, reference, slave_old, master_old;
  Mat<C::components, C::multipliers> lam; ///< per lam_scale
  double lam_scale = 0.7;
  Vec<F::dofs> gamma;
  Vec<F::dofs> offset = Vec<F::dofs>::Zero();
  bool couples_over_gaps = false;
  Mat<D, F::dofs> traction_old;
  Coulomb friction;
  bool has_coefficient = false;
  Vec<F::dofs> coefficient;
  Measure measure = Measure::reference;
};

struct FacingPoint
{
  Vec<2> xi;
  double weight, area;
};

/// A slave facet and a master facet that faces it at about the gap, with
/// points on the slave whose rays meet the master
template <class C>
struct FacingFacets
{
  using F = typename C::F;
  static constexpr int D = F::gdim;
  static constexpr bool has_friction = is_frictional<typename C::Law>;

  Facing<C> start;
  std::vector<FacingPoint> points;

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
    start.gamma = Vec<F::dofs>::Constant(5) + random_vector<F::dofs>(random, 1);
    start.measure = current ? Measure::current : Measure::reference;
    const bool slip = random() % 2 == 0;
    start.slave_old = start.slave;
    start.master_old = start.master;
    if constexpr (D == 3)
    {
      // Both have turned about the normal since then, and been stretched
      spin(start.slave_old, 0.05, 1.1);
      spin(start.master_old, -0.04, 0.9);
    }
    start.slave_old.row(0).array() += slip ? 0.5 : 0.01;
    // With a multiplier a length
    start.traction_old.setConstant(C::multiplier_dofs > 0 ? 0.02 : 0.1);
    start.friction = Coulomb{slip ? 0.4 : 20.0};
    for (int q = 0; q < 5; ++q)
    {
      Vec<2> xi = Vec<2>::Zero();
      xi.template head<F::tdim>() = 0.8 * random_inside<F>(random);
      points.push_back({xi, 0.1 + 0.05 * q, 0.12 + 0.03 * q});
    }
    const auto drawn = random();
    start.offset.setConstant(drawn % 2 == 0 ? 0.01 : 0.0);
    start.couples_over_gaps = drawn / 2 % 2 == 0;
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
    for (auto* nodes : {&start.slave, &start.master, &start.reference,
                        &start.slave_old, &start.master_old})
      nodes->row(0).array() += 0.2;
  }

  /// Unknowns: displacements and multiplier, at the start position
  [[nodiscard]] Vector unknowns() const
  {
    Vector z = Vector::Zero(C::size);
    z.segment(C::side, C::multiplier_dofs) =
        Eigen::Map<const Vector>(start.lam.data(), start.lam.size());
    return z;
  }

  /// Displaced by z: nodes follow the dofs by their shape functions
  [[nodiscard]] Facing<C> at(const Vector& z) const
  {
    Facing<C> e = start;
    for (int a = 0; a < F::nodes; ++a)
    {
      const Vec<F::dofs> N = F::Disp::values(typename F::RefPoint(
          F::Node::points[static_cast<std::size_t>(a)].data()));
      for (int b = 0; b < F::dofs; ++b)
      {
        e.slave.col(a) += N[b] * z.segment<D>(D * b);
        e.master.col(a) += N[b] * z.segment<D>(C::master + D * b);
      }
    }
    e.lam = Eigen::Map<const decltype(e.lam)>(z.data() + C::side);
    return e;
  }

  /// What the element stage reads, with all rays cast
  /// @param[in] hit Else no point meets the master
  [[nodiscard]] static ContactState
  state(const Facing<C>& e, const std::vector<FacingPoint>& points, bool hit)
  {
    ContactState s;
    s.slave = surface(e.reference, e.slave, e.slave_old);
    s.master = surface(e.master, e.master, e.master_old);
    s.measure = e.measure;
    s.gamma.nodal = values(e.gamma);
    s.offset.nodal = values(e.offset);
    s.couples_over_gaps = e.couples_over_gaps;
    if constexpr (has_friction)
    {
      s.friction = e.friction;
      s.traction_old.nodal = values(e.traction_old);
      if (e.has_coefficient)
        s.friction_coefficient.nodal = values(e.coefficient);
    }
    if constexpr (C::components == 0)
      s.method = Method::penalty;
    else
      set_multiplier(e, s.multipliers);
    for (const FacingPoint& q : points)
      add_point(e, q, hit, s);
    s.elements.slave = {0};
    s.elements.master = {hit ? 0 : no_index};
    s.elements.offsets.push_back(
        static_cast<std::int64_t>(s.elements.point.size()));
    return s;
  }

  [[nodiscard]] Vector residual(const Vector& z, bool hit) const
  {
    const ContactState s = state(at(z), points, hit);
    Vector all = Vector::Zero(C::size);
    make_assembler(s)->residual(s, [&all](std::size_t, const double* b, int n)
                                { std::copy_n(b, n, all.data()); });
    return all;
  }

  [[nodiscard]] Matrix tangent(const Vector& z, bool hit) const
  {
    const ContactState s = state(at(z), points, hit);
    Matrix all = Matrix::Zero(C::size, C::size);
    const std::array<std::size_t, 1> one = {0};
    make_assembler(s)->tangent(
        s, one,
        [&all](std::size_t, const double* A, int n)
        {
          for (int i = 0; i < n; ++i)
            for (int j = 0; j < n; ++j)
              all(i, j) = A[i * n + j];
        },
        [](std::size_t, Index, const double*, int, const double*)
        { ADD_FAILURE() << "no segment moves"; });
    return all;
  }

  void expect_tangent(bool hit) const
  {
    expect_derivative([&](const Vector& z) -> Vector
                      { return residual(z, hit); },
                      unknowns(), tangent(unknowns(), hit));
  }

private:
  template <class Values>
  [[nodiscard]] static std::vector<double> values(const Values& of)
  {
    return {of.data(), of.data() + of.size()};
  }

  /// One facet with nodes of its own
  [[nodiscard]] static Surface surface(const typename F::NodeMatrix& X,
                                       const typename F::NodeMatrix& x,
                                       const typename F::NodeMatrix& x_old)
  {
    Surface s{F::shape,
              F::degree,
              F::node_degree,
              D,
              values(X),
              values(x),
              values(x_old),
              {},
              {},
              {},
              {},
              {0}};
    for (int a = 0; a < F::nodes; ++a)
      s.facet_nodes.push_back(a);
    for (int a = 0; a < F::dofs; ++a)
      s.facet_dofs.push_back(a);
    for (int k = 0; k < C::side; ++k)
      s.rows.push_back(k);
    s.neighbours.assign(static_cast<std::size_t>(s.corners()), no_index);
    return s;
  }

  static void set_multiplier(const Facing<C>& e, Multipliers& m)
  {
    m.degree = C::multiplier_degree;
    m.components = C::components;
    m.scale = e.lam_scale;
    for (int k = 0; k < C::multipliers; ++k)
    {
      m.facet.push_back(k);
      m.row.push_back(0);
    }
    m.value = values((e.lam_scale * e.lam).eval());
  }

  static void add_point(const Facing<C>& e, const FacingPoint& q, bool hit,
                        ContactState& s)
  {
    s.elements.point.push_back(static_cast<Index>(s.points.size()));
    s.points.xi.push_back(q.xi);
    s.points.weight.push_back(q.weight);
    s.points.area.push_back(q.area);
    s.points.slave.push_back(0);
    s.points.seed.push_back(0);
    Vec<2> eta = Vec<2>::Zero();
    double gap = 0.0;
    if (hit)
    {
      const auto frame = frame_at<F>(e.slave, q.xi.template head<F::tdim>());
      const auto ray = intersect<F>(frame.x, frame.n, e.master,
                                    flat_guess<F>(frame.x, frame.n, e.master));
      EXPECT_EQ(ray.status, RayStatus::hit);
      EXPECT_LT(frame.n.dot(frame_at<F>(e.master, ray.eta).n), -0.5);
      eta.template head<F::tdim>() = ray.eta;
      gap = ray.g;
    }
    s.hits.status.push_back(hit ? RayStatus::hit : RayStatus::no_facet);
    s.hits.master.push_back(hit ? 0 : no_index);
    s.hits.eta.push_back(eta);
    s.hits.gap.push_back(gap);
  }
};

/// Kinds of facets, multipliers and laws that typed tests run over
using Line12 = FacetType<Shape::interval, 1, 2>;
using Bent12 = FacetType<Shape::triangle, 1, 2>;
using ElementCases = testing::Types<
    Case<Interval1, 1, NormalAugmentedLagrangian>,
    Case<Interval1, 1, VectorAugmentedLagrangian>,
    Case<Interval2, 2, FrictionalAugmentedLagrangian>,
    Case<Interval2, 1, FrictionalAugmentedLagrangian>,
    Case<Interval2, 0, FrictionalPenalty>, Case<Line12, 0, NormalPenalty>,
    Case<Triangle1, 1, VectorAugmentedLagrangian>,
    Case<Triangle1, 1, FrictionalAugmentedLagrangian>,
    Case<Triangle2, 1, NormalAugmentedLagrangian>,
    Case<Triangle2, 0, FrictionalPenalty>,
    Case<Bent12, 1, FrictionalAugmentedLagrangian>,
    Case<Quad1, 0, FrictionalPenalty>, Case<Quad1, 0, NormalPenalty>,
    Case<Quad2, 1, FrictionalAugmentedLagrangian>,
    Case<Quad2, 1, VectorAugmentedLagrangian>>;
} // namespace raymortar::test
