#include "facet_types.h"
#include "raymortar/element/facet_field.h"
#include <gtest/gtest.h>

using namespace raymortar;
using namespace raymortar::test;

namespace
{
template <class F>
class Field : public testing::Test
{
};
TYPED_TEST_SUITE(Field, AllFacets);
} // namespace

TYPED_TEST(Field, IsZeroWithoutValues)
{
  using F = TypeParam;
  const FacetField field;
  EXPECT_TRUE(field.empty());
  EXPECT_TRUE((field.template nodes<F, 2>(3).isZero(0.0)));
  EXPECT_EQ(field.template at<F>(3, Vec<F::dofs>::Ones()), 0.0);
}

TYPED_TEST(Field, HasTheValuesOfItsFacet)
{
  using F = TypeParam;
  FacetField field;
  for (int k = 0; k < 3 * F::dofs; ++k)
    field.nodal.push_back(0.5 * k);
  for (Index facet = 0; facet < 3; ++facet)
    for (int a = 0; a < F::dofs; ++a)
    {
      const double value = 0.5 * (facet * F::dofs + a);
      EXPECT_EQ(field.template nodes<F>(facet)(0, a), value);
      EXPECT_EQ(field.template at<F>(facet, Vec<F::dofs>::Unit(a)), value);
    }
}

TYPED_TEST(Field, HasOneVectorAfterTheOther)
{
  using F = TypeParam;
  FacetField field;
  for (int k = 0; k < 2 * F::dofs * 2; ++k)
    field.nodal.push_back(k);
  const Mat<2, F::dofs> nodes = field.template nodes<F, 2>(1);
  for (int a = 0; a < F::dofs; ++a)
    EXPECT_EQ(nodes(1, a), 2 * (F::dofs + a) + 1);
}
