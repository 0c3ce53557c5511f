#include "../fem/zones.h"
#include "facet_types.h"
#include "raymortar/rigid/body.h"
#include "raymortar/system/contact_system.h"
#include <gtest/gtest.h>
#include <numeric>

using namespace raymortar;
using namespace raymortar::test;

namespace
{
using Facet = Interval1;

/// A vector of this rank
class OwnedVector
{
public:
  explicit OwnedVector(std::size_t size)
  {
    VecCreateSeq(PETSC_COMM_SELF, static_cast<PetscInt>(size), &_vector);
  }
  ~OwnedVector() { VecDestroy(&_vector); }
  OwnedVector(const OwnedVector&) = delete;
  OwnedVector& operator=(const OwnedVector&) = delete;

  [[nodiscard]] PetscVector get() const { return _vector; }
  [[nodiscard]] std::vector<double> values() const
  {
    const ReadArray array(_vector);
    return {array.values().begin(), array.values().end()};
  }
  void set(const std::vector<double>& values)
  {
    PetscScalar* array = nullptr;
    VecGetArray(_vector, &array);
    std::copy(values.begin(), values.end(), array);
    VecRestoreArray(_vector, &array);
  }

private:
  PetscVector _vector = nullptr;
};

/// Two plates, their multiplier and a body that is free along y
class ContactSystemTest : public testing::Test
{
protected:
  ContactSystemTest() : zone(paired_plates<Facet>(true))
  {
    const Surface& slave = zone->input().slave;
    const Surface& master = zone->input().master;
    d = static_cast<std::size_t>(slave.gdim);
    n_slave = static_cast<std::size_t>(slave.num_dofs());
    n_master = static_cast<std::size_t>(master.num_dofs());
    u.assign((n_slave + n_master) * d, 0.0);
    multiplier.assign(n_slave * d, 0.0);
    body.axis = {1};
    body.turns = {false};
    body.stiffness = {2.0};
    body.damping = {0.0};
    body.values = {0.25};
    body.accepted = {0.0};
    body.force = {0.0, 5.0, 0.0};
    size = u.size() + multiplier.size() + 1;
    std::vector<GlobalIndex> rows(u.size());
    std::iota(rows.begin(), rows.end(), 0);
    std::vector<Index> nodes(n_slave);
    std::iota(nodes.begin(), nodes.end(), 0);
    values.emplace(
        MPI_COMM_SELF,
        std::vector<FunctionValues>{{std::span<double>(u), u.size()}}, rows,
        std::vector<MultiplierValues>{{std::span<double>(multiplier), nodes,
                                       zone->input().multipliers.row,
                                       static_cast<int>(d)}},
        std::vector<BodyValues>{{&body, {static_cast<GlobalIndex>(size - 1)}}});
    SystemZone one{zone.get(), &positions, &statistics, 0,
                   nodes,      {},         nodes,       {}};
    one.master.resize(n_master);
    std::iota(one.master.begin(), one.master.end(),
              static_cast<Index>(n_slave));
    system.emplace(std::vector<SystemZone>{one}, u, *values);
  }

  /// An iterate in which the plates press
  [[nodiscard]] std::vector<double> iterate() const
  {
    std::vector<double> x(size, 0.0);
    for (std::size_t k = 0; k < n_slave; ++k)
      x[d * k + d - 1] = -0.02 - 1e-4 * static_cast<double>(k);
    for (std::size_t k = 0; k < multiplier.size(); ++k)
      x[u.size() + k] = -0.5;
    x.back() = 0.75;
    return x;
  }

  [[nodiscard]] RowGroups one_group() const
  {
    RowGroups groups;
    groups.of_row.assign(size, 0);
    groups.count = 1;
    groups.mass.assign(multiplier.size(), 1.0);
    return groups;
  }

  std::unique_ptr<Zone> zone;
  std::size_t d = 0, n_slave = 0, n_master = 0, size = 0;
  std::vector<double> u, multiplier;
  RigidBody body;
  BlockPositions positions;
  AssemblyStatistics statistics;
  std::optional<CoupledValues> values;
  std::optional<ContactSystem> system;
};

TEST_F(ContactSystemTest, ValuesGoThereAndBack)
{
  OwnedVector x(size), back(size);
  x.set(iterate());
  const std::vector<double> scales{4.0};
  values->from_vector(x.get(), scales);
  EXPECT_EQ(multiplier[0], -2.0);
  EXPECT_EQ(body.values[0], 0.75);
  values->to_vector(back.get(), scales);
  EXPECT_EQ(back.values(), iterate());
}

TEST_F(ContactSystemTest, AnIterateIsTakenOnce)
{
  OwnedVector x(size);
  x.set(iterate());
  const std::vector<double> scales{1.0};
  EXPECT_TRUE(system->set_unknowns(x.get(), scales, false));
  EXPECT_FALSE(system->set_unknowns(x.get(), scales, false));
  EXPECT_TRUE(system->set_unknowns(x.get(), scales, true));
  u[0] += 1.0;
  EXPECT_TRUE(system->set_unknowns(x.get(), scales, false));
  EXPECT_EQ(u[0], 0.0);
  body.values[0] = 0.0;
  EXPECT_TRUE(system->set_unknowns(x.get(), scales, false));
  EXPECT_EQ(body.values[0], 0.75);
}

TEST_F(ContactSystemTest, FiniteMeansAllOfDisplacementAndMultiplier)
{
  EXPECT_TRUE(system->is_finite());
  multiplier[3] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(system->is_finite());
}

TEST_F(ContactSystemTest, ResidualIsThatOfItsZonesVolumeAndBodies)
{
  OwnedVector x(size), b(size), alone(size);
  x.set(iterate());
  system->set_unknowns(x.get(), std::vector<double>{1.0}, false);
  zone->set_gamma(
      std::vector<double>(zone->input().slave.facet_dofs.size(), 1.0), 1.0);
  system->pair(false);
  const std::vector<double> volume(u.size(), 0.5), none(u.size(), 0.0);
  system->set_groups(one_group());
  const std::vector<std::int8_t> free(u.size(), 0);
  const Norms norms =
      system->residual(b.get(), volume, {free, none, none, none, u}, true);
  VecSet(alone.get(), 0.0);
  add_residual(*zone, alone.get(), statistics);
  VecAssemblyBegin(alone.get());
  VecAssemblyEnd(alone.get());
  std::vector<double> expected = alone.values();
  EXPECT_GT(std::abs(expected[d - 1]), 1e-6);
  for (std::size_t k = 0; k < u.size(); ++k)
    expected[k] += 0.5;
  expected.back() -= 5.0 - 2.0 * 0.75;
  EXPECT_EQ(b.values(), expected);
  double square = 0.0;
  for (const double value : expected)
    square += value * value;
  EXPECT_DOUBLE_EQ(norms.residual[0], std::sqrt(square));
}

TEST_F(ContactSystemTest, ConstrainedRowsSayWhatIsLacking)
{
  OwnedVector b(size);
  system->set_groups(one_group());
  const std::vector<double> volume(u.size(), 0.5), none(u.size(), 0.0);
  std::vector<double> owned(u.size(), 0.0);
  std::vector<std::int8_t> fixed(u.size(), 0);
  fixed[1] = 1;
  owned[1] = 3.0;
  system->residual(b.get(), volume, {fixed, owned, none, none, u}, false);
  EXPECT_EQ(b.values()[0], 0.5);
  EXPECT_EQ(b.values()[1], -3.0);
}

TEST_F(ContactSystemTest, NormsAreByGroupAndLeaveConstrainedRowsOut)
{
  RowGroups groups;
  groups.of_row.assign(size, 0);
  std::fill(groups.of_row.begin() + static_cast<std::ptrdiff_t>(u.size()),
            groups.of_row.end() - 1, 1);
  groups.of_row.back() = 2;
  groups.count = 3;
  groups.mass.assign(multiplier.size(), 2.0);
  system->set_groups(groups);
  std::fill(multiplier.begin(), multiplier.end(), 3.0);
  const std::vector<double> b(size, 1.0), volume(u.size(), 0.0);
  std::vector<std::int8_t> fixed(u.size(), 0);
  fixed[0] = fixed[1] = 1;
  std::vector<double> increment(u.size(), 0.0), present(u.size(), -7.0);
  increment[2] = -0.5;
  const std::vector<double> none(u.size(), 0.0);
  const Norms found =
      system->norms(b, volume, {fixed, none, increment, none, present});
  EXPECT_DOUBLE_EQ(found.residual[0],
                   std::sqrt(static_cast<double>(u.size() - 2)));
  EXPECT_DOUBLE_EQ(found.residual[2], 1.0);
  EXPECT_DOUBLE_EQ(found.forces[1],
                   6.0 * std::sqrt(static_cast<double>(multiplier.size())));
  EXPECT_DOUBLE_EQ(found.forces[2], 5.0 - 2.0 * 0.25);
  EXPECT_EQ(found.lacking, std::vector<double>{0.5});
  EXPECT_EQ(found.sizes, std::vector<double>{7.0});
}

TEST_F(ContactSystemTest, LoadsChangeWhereABodyIsMet)
{
  EXPECT_FALSE(system->loads_changed()); // no zone meets the body
}
} // namespace
