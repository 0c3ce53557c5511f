// Ties: tangents against differences, invariance, balances, what stays.
#include "differences.h"
#include "interfaces.h"
#include "raymortar/ties/tie_term.h"

using namespace raymortar;
using namespace raymortar::test;

namespace
{
template <class F>
class TieTermTest : public testing::Test
{
};

struct Options
{
  TieGap gap = TieGap::keep;
  bool penalty = false;
  double distance = 0.05;  ///< between the surfaces
  double width = 0.7;      ///< of the slave; the master's is 1
  bool other_kind = false; ///< whether the master's facets are of another kind
};

double wave(double x, double y)
{
  return 0.04 * std::sin(2.0 * x) - 0.03 * x * y;
}

/// Two bent surfaces, tied
template <class F>
Interface tied(const Options& options)
{
  InterfaceInput in = plates_input<F>({.slave_width = options.width});
  in.slave = make_surface(
      {F::shape, F::degree, F::node_degree, 2, false},
      graph(options.width, [&](double x, double y)
            { return wave(x, y) + options.distance * (1.0 + 0.2 * x); }));
  in.terms = std::make_shared<TieTerms>(options.gap);
  if (options.penalty)
  {
    in.method = Method::penalty;
    in.multipliers = {};
  }
  Grid grid{F::shape, F::degree, F::node_degree, 3, true};
  if (options.other_kind)
  {
    grid.degree = grid.node_degree = 3 - F::degree;
    if (F::shape != Shape::interval)
      grid.shape =
          F::shape == Shape::triangle ? Shape::quadrilateral : Shape::triangle;
    in.master_kind = FacetKind{grid.shape, grid.degree, grid.node_degree};
  }
  Interface interface(in);
  interface.set_master(make_surface(grid, graph(1.0, wave)));
  interface.set_gamma(
      std::vector<double>(interface.state().slave.facet_dofs.size(), 7.0), 3.0,
      {});
  interface.pair();
  return interface;
}

/// Unknowns of any size, seeded
Eigen::VectorXd rough(const Interface& interface, double size)
{
  return pressed(interface.state(), 11, 0.0, size);
}

/// Rotation of the space, positions x -> Q X, of displacements and tractions
template <int D>
Eigen::VectorXd turned(const Interface& interface, const Mat<D, D>& Q,
                       const Eigen::VectorXd& x)
{
  const ContactState& s = interface.state();
  Eigen::VectorXd y = x;
  const auto turn = [&](Eigen::Index first, const std::vector<double>& X)
  {
    for (std::size_t k = 0; k < X.size(); k += D)
    {
      const Eigen::Map<const Vec<D>> place(X.data() + k);
      auto u = y.segment<D>(first + static_cast<Eigen::Index>(k));
      u = (Q * (place + u) - place).eval();
    }
  };
  const Numbers numbers(s);
  turn(0, s.slave.X);
  turn(numbers.slave(), s.master.X);
  for (Eigen::Index k = numbers.slave() + numbers.master(); k < y.size();
       k += D)
    y.segment<D>(k) = (Q * y.segment<D>(k)).eval();
  return y;
}

template <int D>
Mat<D, D> rotation()
{
  if constexpr (D == 2)
    return Eigen::Rotation2Dd(2.0).toRotationMatrix();
  else
    return Eigen::AngleAxisd(2.0, Vec<3>(1, 2, -1).normalized())
        .toRotationMatrix();
}

const std::vector<Options> each_option = {
    {},
    {.gap = TieGap::close},
    {.penalty = true},
    {.gap = TieGap::close, .penalty = true},
    {.width = 1.2},
    {.other_kind = true},
    {.penalty = true, .other_kind = true}};
} // namespace

TYPED_TEST_SUITE(TieTermTest, AllFacets, );

/// The unknown is the traction over the scale, and rows are multiplied by it
TYPED_TEST(TieTermTest, TangentIsTheDerivativeOfTheResidual)
{
  for (const Options& options : each_option)
  {
    Interface interface = tied<TypeParam>(options);
    const Eigen::VectorXd x = rough(interface, 0.1);
    const auto f = [&](const Eigen::VectorXd& y)
    { return residual_at(interface, y); };
    f(x);
    Eigen::MatrixXd A = tangent_of(interface).value;
    const Numbers numbers(interface.state());
    A.rightCols(x.size() - numbers.slave() - numbers.master()) /=
        interface.state().multipliers.scale;
    expect_derivative(f, x, A);
  }
}

TYPED_TEST(TieTermTest, TangentIsSymmetric)
{
  for (const Options& options : each_option)
  {
    Interface interface = tied<TypeParam>(options);
    residual_at(interface, rough(interface, 0.1));
    const Eigen::MatrixXd A = tangent_of(interface).value;
    EXPECT_GT(A.norm(), 0.1);
    EXPECT_LT((A - A.transpose()).norm(), 1e-13 * A.norm());
  }
}

TYPED_TEST(TieTermTest, KeptGapsAreFreeOfStressUnderAnyRigidMotion)
{
  constexpr int D = TypeParam::gdim;
  for (const bool penalty : {false, true})
  {
    Interface interface = tied<TypeParam>({.penalty = penalty});
    const Eigen::VectorXd zero =
        Eigen::VectorXd::Zero(Numbers(interface.state()).size());
    EXPECT_EQ(residual_at(interface, zero).norm(), 0.0);
    EXPECT_LT(residual_at(interface, turned<D>(interface, rotation<D>(), zero))
                  .norm(),
              1e-14);
  }
}

TYPED_TEST(TieTermTest, ForcesTurnWithTheBodies)
{
  constexpr int D = TypeParam::gdim;
  for (const bool penalty : {false, true})
  {
    Interface interface =
        tied<TypeParam>({.penalty = penalty, .other_kind = true});
    const Eigen::VectorXd x = rough(interface, 0.1);
    Eigen::VectorXd expected = residual_at(interface, x);
    for (Eigen::Index k = 0; k < x.size(); k += D)
      expected.segment<D>(k) = (rotation<D>() * expected.segment<D>(k)).eval();
    const Eigen::VectorXd found =
        residual_at(interface, turned<D>(interface, rotation<D>(), x));
    EXPECT_LT((found - expected).norm(), 1e-13 * expected.norm());
  }
}

TYPED_TEST(TieTermTest, ForcesOfSlaveAndMasterAreOpposite)
{
  constexpr int D = TypeParam::gdim;
  for (const Options& options : each_option)
  {
    Interface interface = tied<TypeParam>(options);
    const Eigen::VectorXd b = residual_at(interface, rough(interface, 0.1));
    const Numbers numbers(interface.state());
    Vec<D> sum = Vec<D>::Zero(), magnitude = Vec<D>::Zero();
    for (Eigen::Index k = 0; k < numbers.slave() + numbers.master(); k += D)
    {
      sum += b.segment<D>(k);
      magnitude += b.segment<D>(k).cwiseAbs();
    }
    EXPECT_GT(magnitude.minCoeff(), 1e-3);
    EXPECT_LT(sum.norm(), 1e-14 * magnitude.norm() * 10.0);
  }
}

TYPED_TEST(TieTermTest, NothingIsPairedAgain)
{
  Interface interface = tied<TypeParam>({});
  const auto points = interface.state().points.xi;
  residual_at(interface, rough(interface, 0.5));
  interface.cast();
  EXPECT_EQ(interface.state().points.xi, points);
  EXPECT_EQ(interface.pipeline().statistics().pairings, 1);
}

TYPED_TEST(TieTermTest, BlocksAreWhereItNeedsRoom)
{
  Interface interface = tied<TypeParam>({.width = 1.2});
  residual_at(interface, rough(interface, 0.1));
  const PatternNeeds needs = interface.needs();
  for (const auto& [rows, columns] : tangent_of(interface).blocks)
  {
    const auto same = [&](const PatternNeeds::Pair& pair)
    { return pair.slave == rows.slave and pair.master == rows.master; };
    EXPECT_TRUE(rows.master == no_index or
                std::any_of(needs.pairs.begin(), needs.pairs.end(), same));
  }
}

/// Plates that touch: all blocks are constant
TYPED_TEST(TieTermTest, WithoutGapsTheTangentIsConstant)
{
  InterfaceInput in = plates_input<TypeParam>({.gap = 0.0});
  in.terms = std::make_shared<TieTerms>(TieGap::keep);
  Interface interface(in);
  interface.set_master(master_plate<TypeParam>({}));
  interface.pair();
  const auto* tie = dynamic_cast<const TieKernel*>(&interface.assembler());
  ASSERT_NE(tie, nullptr);
  EXPECT_EQ(tie->turning_elements(), 0U);
  const Eigen::VectorXd x = rough(interface, 0.3);
  const Eigen::VectorXd b = residual_at(interface, x);
  const Eigen::MatrixXd A = tangent_of(interface).value;
  EXPECT_LT((A * x - b).norm(), 1e-13 * b.norm());
  residual_at(interface, 2.0 * x);
  EXPECT_EQ(tangent_of(interface).value, A);
}

/// Of gaps that close the residual of undeformed bodies is the gap's
TYPED_TEST(TieTermTest, ClosingPullsByTheGap)
{
  InterfaceInput in = plates_input<TypeParam>({.gap = 0.25});
  in.terms = std::make_shared<TieTerms>(TieGap::close);
  in.multipliers = {};
  in.method = Method::penalty;
  Interface interface(in);
  interface.set_master(master_plate<TypeParam>({}));
  interface.pair();
  const Numbers numbers(interface.state());
  const Eigen::VectorXd b =
      residual_at(interface, Eigen::VectorXd::Zero(numbers.size()));
  constexpr int D = TypeParam::gdim;
  double force = 0.0;
  for (Eigen::Index k = D - 1; k < numbers.slave(); k += D)
    force += b[k];
  // Residuals are against the forces: the slave is pulled down
  EXPECT_NEAR(force, 0.25 * std::pow(1.4, D - 1), 1e-12);
}

TYPED_TEST(TieTermTest, ResultsAreOfTheTie)
{
  Interface interface = tied<TypeParam>({.penalty = true, .width = 1.2});
  residual_at(interface, rough(interface, 0.1));
  const ContactState& s = interface.state();
  const PointResults r = interface.assembler().results(s);
  constexpr int D = TypeParam::gdim;
  Vec<D> force = Vec<D>::Zero();
  for (std::size_t q = 0; q < s.points.size(); ++q)
  {
    const bool hit = s.hits.status[q] == RayStatus::hit;
    EXPECT_EQ(r.status[q], hit ? ContactStatus::stick : ContactStatus::none);
    const Eigen::Map<const Vec<D>> t(r.traction.data() + D * q);
    const Eigen::Map<const Vec<D>> n(r.normal.data() + D * q);
    EXPECT_NEAR(r.pressure[q], t.dot(n), 1e-14);
    EXPECT_NEAR(r.gap[q], r.pressure[q] / 7.0, 1e-14);
    force += r.weight[q] * t;
  }
  const Eigen::VectorXd b = residual_at(interface, rough(interface, 0.1));
  for (Eigen::Index k = 0; k < Numbers(s).slave(); k += D)
    force += b.segment<D>(k);
  EXPECT_LT(force.norm(), 1e-13);
}

TEST(TieTerm, CoverCountsWhatRaysHit)
{
  Interface interface = tied<Triangle1>({.width = 1.2});
  ContactState s = interface.state();
  const double before = s.segmentation.covered[0];
  ASSERT_GT(before, 0.0);
  for (std::size_t q = 0; q < s.points.size(); ++q)
    if (s.points.slave[q] == 0)
      s.hits.status[q] = RayStatus::no_facet;
  count_hits_as_cover(s);
  EXPECT_EQ(s.segmentation.covered[0], 0.0);
  EXPECT_EQ(s.segmentation.covered[1],
            interface.state().segmentation.covered[1]);
}

TEST(TieTerm, CrossPointsDampAllComponents)
{
  Interface interface = tied<Interval1>({});
  const ContactState& s = interface.state();
  std::vector<std::int8_t> crossing(
      static_cast<std::size_t>(s.slave.num_dofs()), 0);
  crossing[0] = 1;
  interface.set_crossing(crossing);
  begin_step(interface, std::vector<double>(s.slave.rows.size(), 0.0),
             std::vector<double>(s.master.rows.size(), 0.0));
  ASSERT_EQ(interface.damping().facets().size(), 1U);
  const auto& block = interface.damping().facets()[0].block;
  const Eigen::Map<const Eigen::Matrix4d> B(block.data());
  // A constant traction is left alone, and all that varies is not
  EXPECT_LT((B * Eigen::Vector4d(1, 2, 1, 2)).norm(), 1e-15);
  EXPECT_GT(
      Eigen::Vector4d(1, 2, -1, -2).dot(B * Eigen::Vector4d(1, 2, -1, -2)),
      0.0);
}
