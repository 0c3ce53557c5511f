#include "differences.h"
#include "facet_types.h"
#include "raymortar/element/segment_motion.h"
#include "rules.h"
#include "surfaces.h"

using namespace raymortar;
using namespace raymortar::test;

namespace
{
/// Which master the points of a segment are taken to hit
enum class Hit
{
  own,   ///< that of the segment
  other, ///< the next one
  none
};

/// Masters of which the further one is seen beside the nearer
enum class Masters
{
  one,
  two
};

/// Two plates that cover each other in part, turned against each other, with
/// nodes displaced at random: all vertices of their segments move
template <class F>
class Plates
{
  static constexpr int D = F::gdim;
  using Motion = SegmentMotion<D>;
  /// Unknowns of an element: of each side, and a scalar multiplier at corners
  static constexpr int side = D * F::dofs;
  static constexpr int multipliers = F::template Basis<1>::nodes;
  static constexpr int alone = side + multipliers;
  static constexpr int size = alone + side;

public:
  Plates(std::mt19937& random, Hit hit, Masters masters) : _hit(hit)
  {
    const bool layered = masters == Masters::two;
    const Grid grid{F::shape, F::degree, F::node_degree, 2, true};
    _state.slave = make_surface(grid, plate(0.5, 0.0));
    _state.master = make_surface(
        {grid.shape, grid.degree, grid.node_degree, layered ? 1 : 2, false},
        [](double s, double t)
        {
          const double x = 1.1 * s - 0.4;
          const double y = 0.9 * t - 0.3;
          return Vec<3>(x - 0.3 * y, y + 0.3 * x, 0.1);
        });
    // One facet of it reaches beyond the slave
    if (layered)
      _state.master = joined(
          _state.master,
          make_surface({grid.shape, grid.degree, grid.node_degree, 1, false},
                       [](double s, double t)
                       { return Vec<3>(6.0 * s - 1.0, 6.0 * t - 1.0, 0.4); }));
    _start = Vector::Zero(num_unknowns());
    for (double& value : _start)
      value = random_vector<1>(random, 0.02)[0];
    // Exact to rounding, so that it makes no difference which tiles there are
    _state.segment_rules = segment_rules(F::shape, 14);
    pair(_start);
  }

  [[nodiscard]] const Vector& start() const { return _start; }
  [[nodiscard]] std::size_t couplings() const { return _couplings; }

  /// Sum of weight times integrand over all points where they are now
  [[nodiscard]] Vector sum(const Vector& u)
  {
    pair(u);
    Vector total = Vector::Zero(num_rows());
    for (std::size_t e = 0; e < _state.elements.size(); ++e)
    {
      const auto rows = rows_of(e);
      for (const Index q : _state.elements.points_of(e))
      {
        const auto at = integrand(e, _state.points.xi[q]);
        for (std::size_t r = 0; r < rows.size(); ++r)
          total[rows[r]] += _state.points.weight[q] * at.f[r];
      }
    }
    return total;
  }

  /// Its derivative by all displacements, as the class under test finds it
  [[nodiscard]] Matrix derivative()
  {
    pair(_start);
    Matrix J = Matrix::Zero(num_rows(), num_unknowns());
    const auto motion = std::make_unique<Motion>(_state);
    for (std::size_t e = 0; e < _state.elements.size(); ++e)
      add_element(e, *motion, J);
    return J;
  }

private:
  struct Wave
  {
    Vec<size> f;
    Mat<size, F::tdim> f_xi;
  };

  [[nodiscard]] Eigen::Index num_unknowns() const
  {
    return D * (_state.slave.num_dofs() + _state.master.num_dofs());
  }

  /// Those of the multiplier come last, each facet's by themselves
  [[nodiscard]] Eigen::Index num_rows() const
  {
    return num_unknowns() + _state.slave.num_facets() * multipliers;
  }

  void pair(const Vector& u)
  {
    ContactState& s = _state;
    const Eigen::Index n = D * s.slave.num_dofs();
    const Vector slave = u.head(n), master = u.tail(u.size() - n);
    s.slave.x = displaced(s.slave, {slave.data(), slave.data() + slave.size()});
    s.master.x =
        displaced(s.master, {master.data(), master.data() + master.size()});
    s.segmentation = segments_of(s.slave, s.master, {1.0, 1.0, false});
    s.points = make_points(s.slave, s.segmentation, s.segment_rules,
                           rule_on(F::shape, 2), false);
    Hits hits;
    for (const Index seed : s.points.seed)
      hits.master.push_back(_hit == Hit::none    ? no_index
                            : _hit == Hit::other ? other(seed)
                                                 : seed);
    s.elements = group_points(s.points, hits);
  }

  [[nodiscard]] Index other(Index master) const
  {
    return (master + 1) % _state.master.num_facets();
  }

  [[nodiscard]] std::vector<Eigen::Index> dofs(const Surface& of, Index facet,
                                               Eigen::Index first) const
  {
    std::vector<Eigen::Index> all;
    for (const Index dof : of.dofs_of<F>(facet))
      for (int i = 0; i < D; ++i)
        all.push_back(first + D * dof + i);
    return all;
  }

  [[nodiscard]] std::vector<Eigen::Index> slave_dofs(std::size_t e) const
  {
    return dofs(_state.slave, _state.elements.slave[e], 0);
  }

  [[nodiscard]] std::vector<Eigen::Index> master_dofs(Index master) const
  {
    return dofs(_state.master, master, D * _state.slave.num_dofs());
  }

  /// Of the element: [slave | multiplier | master that is hit]
  [[nodiscard]] std::vector<Eigen::Index> rows_of(std::size_t e) const
  {
    auto rows = slave_dofs(e);
    for (int k = 0; k < multipliers; ++k)
      rows.push_back(num_unknowns() + _state.elements.slave[e] * multipliers +
                     k);
    if (const Index hit = _state.elements.master[e]; hit != no_index)
      for (const Eigen::Index row : master_dofs(hit))
        rows.push_back(row);
    return rows;
  }

  /// A wave for each row of the element
  [[nodiscard]] Wave integrand(std::size_t e, const Vec<2>& xi) const
  {
    Wave wave;
    for (int r = 0; r < size; ++r)
    {
      const Vec<2> k(1.0 + 0.1 * r, 0.7 - 0.05 * r);
      const double phase = k.head<F::tdim>().dot(xi.head<F::tdim>()) + r +
                           _state.elements.slave[e];
      wave.f[r] = std::sin(phase);
      wave.f_xi.row(r) = std::cos(phase) * k.head<F::tdim>().transpose();
    }
    return wave;
  }

  void add_element(std::size_t e, Motion& motion, Matrix& J)
  {
    const ContactState& s = _state;
    const Index hit = s.elements.master[e];
    // As blocks come, without rows and columns of a master that is not there
    const int n = hit == no_index ? alone : size;
    std::vector<double> A(static_cast<std::size_t>(n * n));
    const auto rows = rows_of(e);
    const CouplingSink couple = [&](std::size_t element, Index master,
                                    const double* block, int width,
                                    const double* hit_rows)
    {
      EXPECT_EQ(element, e);
      EXPECT_EQ(width, size);
      EXPECT_EQ(hit_rows == nullptr, hit == no_index);
      ++_couplings;
      const auto columns = master_dofs(master);
      for (int r = 0; r < alone; ++r)
        for (int c = 0; c < side; ++c)
          J(rows[r], columns[c]) += block[r * size + alone + c];
      for (int k = 0; hit_rows and k < side * side; ++k)
        J(rows[alone + k / side], columns[k % side]) += hit_rows[k];
    };
    const typename Motion::Element element{e, alone, n, A.data(), couple};
    for (const Index q : s.elements.points_of(e))
      motion.add(element, static_cast<std::size_t>(q),
                 as_taken(integrand(e, s.points.xi[q])));
    motion.finish(element);
    const auto columns = slave_dofs(e);
    for (int r = 0; r < n; ++r)
    {
      for (int c = 0; c < side; ++c)
        J(rows[r], columns[c]) += A[r * n + c];
      for (int c = alone; c < n; ++c)
        J(rows[r], rows[c]) += A[r * n + c];
    }
  }

  [[nodiscard]] static AnyIntegrand<D> as_taken(const Wave& wave)
  {
    AnyIntegrand<D> at;
    std::copy_n(wave.f.data(), size, at.f.begin());
    for (int j = 0; j < F::tdim; ++j)
      std::copy_n(wave.f_xi.data() + j * size, size,
                  at.f_xi[static_cast<std::size_t>(j)].begin());
    return at;
  }

  Hit _hit;
  ContactState _state;
  Vector _start;
  std::size_t _couplings = 0;
};

template <class F>
void expect_derivative_of_sum(unsigned seed, Hit hit,
                              Masters masters = Masters::one)
{
  std::mt19937 random(seed);
  Plates<F> plates(random, hit, masters);
  const Matrix J = plates.derivative();
  EXPECT_GT(J.norm(), 0.1);
  EXPECT_EQ(plates.couplings() > 0, hit != Hit::own or masters == Masters::two);
  // Along some directions, of all displacements at once
  Matrix directions(plates.start().size(), 4);
  for (double& value : directions.reshaped())
    value = random_vector<1>(random, 0.3)[0];
  expect_derivative([&](const Vector& t) -> Vector
                    { return plates.sum(plates.start() + directions * t); },
                    Vector::Zero(4), J* directions);
}

template <class F>
class MovingSegmentsTest : public testing::Test
{
};

template <class F>
class MovingSegmentsInThePlaneTest : public testing::Test
{
};
using PlaneFacets = testing::Types<Interval1, Interval2>;
} // namespace

TYPED_TEST_SUITE(MovingSegmentsTest, AllFacets, );
TYPED_TEST_SUITE(MovingSegmentsInThePlaneTest, PlaneFacets, );

TYPED_TEST(MovingSegmentsTest, PointsAndWeightsFollowTheVertices)
{
  expect_derivative_of_sum<TypeParam>(1, Hit::own);
}

TYPED_TEST(MovingSegmentsTest, ColumnsOfAnotherMasterAreHandedOn)
{
  expect_derivative_of_sum<TypeParam>(2, Hit::other);
}

TYPED_TEST(MovingSegmentsTest, PointsWithoutHitFollowTheMasterOfTheirSegment)
{
  expect_derivative_of_sum<TypeParam>(3, Hit::none);
}

// In space such vertices are fixed: theory 3, (a)
TYPED_TEST(MovingSegmentsInThePlaneTest, WhatIsSeenBesideANearerLayer)
{
  expect_derivative_of_sum<TypeParam>(4, Hit::own, Masters::two);
  expect_derivative_of_sum<TypeParam>(5, Hit::other, Masters::two);
}
