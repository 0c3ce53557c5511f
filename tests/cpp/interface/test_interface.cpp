#include "interfaces.h"
#include "raymortar/core/error.h"
#include <set>

using namespace raymortar;
using namespace raymortar::test;

namespace
{
template <class F>
class InterfaceTest : public testing::Test
{
};

/// Central differences of the residual, paired anew
Eigen::MatrixXd differences(Interface& interface, const Eigen::VectorXd& x)
{
  constexpr double h = 1e-6;
  Eigen::MatrixXd J(x.size(), x.size());
  for (Eigen::Index j = 0; j < x.size(); ++j)
  {
    const Eigen::VectorXd e = h * Eigen::VectorXd::Unit(x.size(), j);
    J.col(j) = (residual_at(interface, x + e) - residual_at(interface, x - e)) /
               (2.0 * h);
  }
  return J;
}

/// All terms: the slave overhangs the rim, and nodes are held on both sides
template <class F>
void expect_tangent(Measure measure)
{
  Interface interface =
      make_plates<F>({.slave_width = 1.2, .measure = measure});
  const ContactState& s = interface.state();
  std::vector<double> slave(s.slave.rows.size(), 0.0);
  slave[0] = slave[1] = slave[2] = 1.0;
  begin_step(interface, slave, std::vector<double>(s.master.rows.size(), 1.0));
  const Eigen::VectorXd x = pressed(s, 3, 0.03);
  const Eigen::MatrixXd expected = differences(interface, x);
  residual_at(interface, x);
  const Eigen::MatrixXd found = tangent_of(interface).value;
  const double scale = expected.cwiseAbs().maxCoeff();
  EXPECT_GT(scale, 0.0);
  EXPECT_LT((found - expected).cwiseAbs().maxCoeff(), 1e-6 * scale);
}
} // namespace

TYPED_TEST_SUITE(InterfaceTest, AllFacets, );

TYPED_TEST(InterfaceTest, TangentIsTheDerivativeOfTheResidual)
{
  expect_tangent<TypeParam>(Measure::reference);
}

TEST(Interface, TangentOfRevolutionIsTheDerivativeOfTheResidual)
{
  for (const Measure measure :
       {Measure::reference_of_revolution, Measure::current_of_revolution})
  {
    expect_tangent<Interval1>(measure);
    expect_tangent<Interval2>(measure);
  }
}

TEST(Interface, RefusesToTurnSurfacesInSpace)
{
  const Plates plates{.measure = Measure::reference_of_revolution};
  EXPECT_THROW(make_plates<Quad1>(plates), Error);
}

/// Room is made by needs alone
TYPED_TEST(InterfaceTest, BlocksAreWhereTheTermsNeedRoom)
{
  Interface interface = make_plates<TypeParam>({.slave_width = 1.2});
  residual_at(interface, pressed(interface.state(), 5, 0.03, 0.03));
  const PatternNeeds needs = interface.needs();
  std::set<std::pair<Index, Index>> pairs, coupled;
  for (const auto& [slave, master] : needs.pairs)
    pairs.emplace(slave, master);
  for (const auto& [slave, first, second] : needs.couplings)
    coupled.insert({{first, second}, {second, first}});
  const auto facet = [](const Unknowns& u)
  { return u.slave != no_index ? u.slave : u.multiplier; };
  for (const auto& [rows, columns] : tangent_of(interface).blocks)
    for (const Unknowns& u : {rows, columns})
    {
      const Index slave = facet(u) == no_index ? facet(columns) : facet(u);
      if (u.master != no_index and slave != no_index)
      {
        EXPECT_TRUE(pairs.contains({slave, u.master}));
      }
      else if (rows.master != no_index and rows.master != columns.master)
      {
        EXPECT_TRUE(coupled.contains({rows.master, columns.master}));
      }
    }
  EXPECT_FALSE(pairs.empty());
}

TYPED_TEST(InterfaceTest, ForcesAreInBalance)
{
  Interface interface = make_plates<TypeParam>({});
  Eigen::VectorXd x = pressed(interface.state(), 7, 0.03);
  const Numbers numbers(interface.state());
  x.tail(x.size() - numbers.slave() - numbers.master()).array() -= 1.0;
  const Eigen::VectorXd b = residual_at(interface, x);
  constexpr int d = TypeParam::gdim;
  const Eigen::Index nodes = (numbers.slave() + numbers.master()) / d;
  const Eigen::Map<const Eigen::MatrixXd> forces(b.data(), d, nodes);
  EXPECT_GT(forces.cwiseAbs().maxCoeff(), 0.01);
  EXPECT_LT(forces.rowwise().sum().cwiseAbs().maxCoeff(), 1e-12);
}

TEST(Interface, FixesThePointsBetweenPairings)
{
  Interface interface = make_plates<Interval1>({});
  const ContactState& s = interface.state();
  residual_at(interface, pressed(s, 1, 0.0, 0.0));
  const auto xi = s.points.xi;
  const auto eta = s.hits.eta;
  const Eigen::VectorXd x = pressed(s, 1, 0.0, 0.1);
  interface.move_slave(
      {x.data(), static_cast<std::size_t>(Numbers(s).slave())});
  interface.cast();
  EXPECT_FALSE(s.moving_segments);
  EXPECT_EQ(s.points.xi, xi);
  EXPECT_NE(s.hits.eta, eta);
  interface.pair();
  EXPECT_TRUE(s.moving_segments);
  EXPECT_NE(s.points.xi, xi);
}

TEST(Interface, TakesFieldsByName)
{
  Interface interface = make_plates<Quad1>({});
  const std::vector<double> values(interface.state().slave.facet_dofs.size(),
                                   0.3);
  interface.set_field("friction_coefficient", values);
  EXPECT_EQ(interface.state().friction_coefficient.nodal, values);
  EXPECT_THROW(interface.set_field("colour", values), Error);
}

TEST(Interface, ClearanceLooksDeeper)
{
  Interface interface = make_plates<Interval1>({});
  const FacetDistances before = interface.pipeline().rules().distances;
  std::vector<double> offset(interface.state().slave.facet_dofs.size(), 0.0);
  offset[0] = 0.2;
  EXPECT_TRUE(interface.set_offset(offset));
  EXPECT_FALSE(interface.set_offset(offset));
  const FacetDistances& now = interface.pipeline().rules().distances;
  EXPECT_DOUBLE_EQ(now[0].depth, before[0].depth + 0.2);
  EXPECT_DOUBLE_EQ(now[0].reach, before[0].reach);
  EXPECT_DOUBLE_EQ(now[1].depth, before[1].depth);
}

TEST(Interface, MethodAndFrictionChooseTheLaw)
{
  const auto closed = [](const InterfaceInput& in)
  {
    Interface interface(in);
    interface.set_master(master_plate<Interval1>({}));
    residual_at(interface, pressed(interface.state(), 1, 0.03, 0.0));
    const auto status = interface.assembler().results(interface.state()).status;
    return status.at(0);
  };
  InterfaceInput in = plates_input<Interval1>({});
  EXPECT_EQ(closed(in), ContactStatus::slip);
  in.friction = Stick();
  EXPECT_EQ(closed(in), ContactStatus::stick);
  in.multipliers = make_multipliers<Interval1>(in.slave, 1);
  EXPECT_THROW(Interface{in}, Error);
  in.multipliers = {};
  in.method = Method::penalty;
  EXPECT_EQ(closed(in), ContactStatus::stick);
  in.friction.reset();
  EXPECT_EQ(closed(in), ContactStatus::slip);
}
