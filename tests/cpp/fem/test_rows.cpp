#include "facet_types.h"
#include "raymortar/fem/rows.h"
#include "zones.h"

using namespace raymortar;
using namespace raymortar::test;

namespace
{
template <class F>
class RowsTest : public testing::Test
{
};

/// Rows of a facet's components, from the tables
std::vector<PetscInt> expected(const Surface& s, Index facet)
{
  std::vector<PetscInt> rows;
  const int n = s.dofs_per_facet();
  for (int a = 0; a < n; ++a)
    for (int i = 0; i < s.gdim; ++i)
    {
      const auto dof = static_cast<std::size_t>(
          s.facet_dofs[static_cast<std::size_t>(facet * n + a)]);
      const auto width = static_cast<std::size_t>(s.gdim);
      rows.push_back(static_cast<PetscInt>(
          s.rows[dof * width + static_cast<std::size_t>(i)]));
    }
  return rows;
}

/// The same of its multipliers
std::vector<PetscInt> expected(const Multipliers& m, Index facet, Index facets)
{
  std::vector<PetscInt> rows;
  const Index nodes = static_cast<Index>(m.facet.size()) / facets;
  for (int a = 0; a < nodes; ++a)
    for (int i = 0; i < m.components; ++i)
      rows.push_back(static_cast<PetscInt>(
          m.row[static_cast<std::size_t>(
              m.facet[static_cast<std::size_t>(facet * nodes + a)])] +
          i));
  return rows;
}

template <class Check>
void for_each_element(const Zone& zone, Check&& check)
{
  const ContactElements& elements = zone.state().elements;
  ASSERT_GT(elements.size(), 0u);
  for (std::size_t e = 0; e < elements.size(); ++e)
    check(elements.slave[e], elements.master[e]);
}
} // namespace

TYPED_TEST_SUITE(RowsTest, AllFacets, );

TYPED_TEST(RowsTest, AreThoseOfTheTablesInAnyOrder)
{
  for (const bool by_node : {true, false})
  {
    const auto plates = paired_plates<TypeParam>(by_node);
    const Zone& zone = *plates;
    const ContactState& s = zone.state();
    for_each_element(
        zone,
        [&](Index slave, Index master)
        {
          std::vector<PetscInt> rows, all = expected(s.slave, slave);
          const auto more =
              expected(s.multipliers, slave, s.slave.num_facets());
          all.insert(all.end(), more.begin(), more.end());
          if (master != no_index)
          {
            const auto there = expected(s.master, master);
            all.insert(all.end(), there.begin(), there.end());
            master_rows(zone, master, Constrained::kept, rows);
            EXPECT_EQ(rows, there);
          }
          element_rows(zone, slave, master, Constrained::kept, rows);
          EXPECT_EQ(rows, all);
        });
  }
}

TYPED_TEST(RowsTest, OfPrescribedComponentsAreLeftOut)
{
  const auto plates = paired_plates<TypeParam>(false);
  Zone& zone = *plates;
  std::vector<double> slave(zone.input().slave.rows.size(), 0.0);
  std::vector<double> master(zone.input().master.rows.size(), 0.0);
  slave[1] = master[2] = 1.0;
  zone.set_fixed(slave, master);
  const std::vector<GlobalIndex> held{zone.input().slave.rows[1],
                                      zone.input().master.rows[2]};
  for_each_element(zone,
                   [&](Index s, Index m)
                   {
                     std::vector<PetscInt> kept, rows;
                     element_rows(zone, s, m, Constrained::kept, kept);
                     element_rows(zone, s, m, Constrained::left_out, rows);
                     for (PetscInt& row : kept)
                       if (row == held[0] or row == held[1])
                         row = -1;
                     EXPECT_EQ(rows, kept);
                   });
}

TYPED_TEST(RowsTest, MayBeOthersLater)
{
  const auto plates = paired_plates<TypeParam>(true);
  Zone& zone = *plates;
  const auto others = paired_plates<TypeParam>(false);
  const Zone& other = *others;
  const Rows rows = rows_of(zone.input().slave, zone.input().master, false);
  zone.set_rows(rows.slave, rows.master, rows.multiplier);
  for_each_element(zone,
                   [&](Index s, Index m)
                   {
                     std::vector<PetscInt> found, wanted;
                     element_rows(zone, s, m, Constrained::kept, found);
                     element_rows(other, s, m, Constrained::kept, wanted);
                     EXPECT_EQ(found, wanted);
                   });
}
