#include "interfaces.h"

using namespace raymortar;
using namespace raymortar::test;

namespace
{
/// Intervals: slave nodes at -0.7, 0, 0.7, of which the first is held; master
/// nodes at -1, -1/3, 1/3, 1, of which all or the first are
struct PlateScene
{
  Interface interface;
  std::vector<double> slave, master;

  explicit PlateScene(const Plates& plates = {}, bool all_masters = false)
      : interface(make_plates<Interval1>(plates)),
        slave(interface.state().slave.rows.size(), 0.0),
        master(interface.state().master.rows.size(), all_masters ? 1.0 : 0.0)
  {
    const ContactState& s = interface.state();
    hold_leftmost(s.slave, slave);
    hold_leftmost(s.master, master);
  }

  void begin() { begin_step(interface, slave, master); }

  [[nodiscard]] const std::vector<FacetBlock>& facets() const
  {
    return interface.damping().facets();
  }

private:
  static void hold_leftmost(const Surface& s, std::vector<double>& fixed)
  {
    std::size_t at = 0;
    for (std::size_t k = 0; k < s.X.size(); k += 2)
      if (s.X[k] < s.X[at])
        at = k;
    fixed[at] = fixed[at + 1] = 1.0;
  }
};

/// The master moved along the surface
Eigen::VectorXd shifted(const Interface& interface, double by)
{
  const Numbers numbers(interface.state());
  Eigen::VectorXd x = pressed(interface.state(), 1, 0.02, 0.0);
  for (Eigen::Index k = 0; k < numbers.master(); k += 2)
    x[numbers.slave() + k] = by;
  x.tail(x.size() - numbers.slave() - numbers.master()).array() += 1.0;
  for (Eigen::Index k = numbers.slave() + numbers.master(); k < x.size();
       k += 3)
    x[k] = -1.0;
  return x;
}
} // namespace

TEST(DampingTerm, DampsTheFacetUpToAHeldNode)
{
  PlateScene scene;
  scene.begin();
  ASSERT_EQ(scene.facets().size(), 1U);
}

TEST(DampingTerm, ResidualDoesNotDependOnTheOrderOfCalls)
{
  PlateScene one, other;
  one.begin();
  other.begin();
  const Eigen::VectorXd x = shifted(one.interface, 0.0);
  const Eigen::VectorXd y = shifted(one.interface, 0.2);
  const Eigen::VectorXd z = shifted(one.interface, 5.0); // faces nothing
  const Eigen::VectorXd first = residual_at(one.interface, x);
  residual_at(one.interface, z);
  const Eigen::VectorXd second = residual_at(one.interface, y);
  EXPECT_EQ(residual_at(other.interface, y), second);
  residual_at(other.interface, z);
  EXPECT_EQ(residual_at(other.interface, x), first);
  EXPECT_EQ(residual_at(other.interface, y), second);
}

TEST(DampingTerm, DecidesAnewWithEachStep)
{
  PlateScene scene;
  scene.begin();
  const auto first = scene.facets().at(0).block;
  const Eigen::VectorXd y = shifted(scene.interface, 0.2);
  residual_at(scene.interface, y);
  EXPECT_EQ(scene.facets().at(0).block, first);
  const Numbers numbers(scene.interface.state());
  scene.interface.set_old_master(
      {y.data() + numbers.slave(), static_cast<std::size_t>(numbers.master())});
  scene.begin();
  EXPECT_NE(scene.facets().at(0).block, first);
}

TEST(DampingTerm, IsInverseToTheModulus)
{
  PlateScene scene;
  scene.begin();
  const Eigen::VectorXd x = shifted(scene.interface, 0.0);
  const auto with = [&](double modulus)
  {
    scene.interface.damping().set_modulus(modulus);
    return residual_at(scene.interface, x);
  };
  const Eigen::VectorXd none = with(1e300), one = with(1.0), two = with(2.0);
  EXPECT_GT((one - none).norm(), 1e-3);
  EXPECT_LT((one - none - 2.0 * (two - none)).norm(), 1e-12);
}

/// They may meet in the step that begins
TEST(DampingTerm, LooksBeyondTheReach)
{
  PlateScene scene({.gap = 1.0, .reach = 0.1});
  scene.begin();
  PlateScene near;
  near.begin();
  ASSERT_EQ(scene.facets().size(), 1U);
  for (std::size_t k = 0; k < scene.facets()[0].block.size(); ++k)
    EXPECT_NEAR(scene.facets()[0].block[k], near.facets()[0].block[k], 1e-12);
}

TEST(DampingTerm, LeavesOutWhatFacesNothing)
{
  PlateScene scene({.slave_width = 2.5}, true);
  scene.begin();
  // The facet from -2.5 to 0 does face the master
  EXPECT_EQ(scene.facets().size(), 1U);
  PlateScene aside({.slave_width = 4.5, .slave_cells = 4}, true);
  aside.begin();
  EXPECT_TRUE(aside.facets().empty());
}

TEST(DampingTerm, LeavesOutWhatHasNoHeldNodes)
{
  PlateScene scene;
  std::fill(scene.slave.begin(), scene.slave.end(), 0.0);
  scene.begin();
  EXPECT_TRUE(scene.facets().empty());
}
