#include "interfaces.h"
#include <set>

using namespace raymortar;
using namespace raymortar::test;

namespace
{
template <class F>
class PipelineTest : public testing::Test
{
};

/// A slave that moves as a whole above a master
template <class F>
struct PipelineScene
{
  InterfaceInput in = plates_input<F>({});
  ContactState s;
  Pipeline pipeline{in, in.slave.num_facets()};

  PipelineScene()
  {
    s.slave = in.slave;
    s.master = master_plate<F>({});
    s.multipliers = in.multipliers;
  }

  void move(double by)
  {
    for (std::size_t k = 0; k < s.slave.x.size(); ++k)
      s.slave.x[k] = s.slave.X[k] + by;
    pipeline.forget_points();
  }

  [[nodiscard]] std::int64_t builds() const
  {
    return pipeline.statistics().candidate_builds;
  }
};

template <class T>
std::set<std::string> names_of(const T& counts, std::size_t& fields)
{
  std::set<std::string> names;
  fields = 0;
  for_each_field(counts,
                 [&](const char* name, auto)
                 {
                   names.insert(name);
                   ++fields;
                 });
  return names;
}
} // namespace

TYPED_TEST_SUITE(PipelineTest, AllFacets, );

TYPED_TEST(PipelineTest, DoesNothingWhereNothingHasMoved)
{
  PipelineScene<TypeParam> scene;
  EXPECT_TRUE(scene.pipeline.pair(scene.s));
  EXPECT_FALSE(scene.pipeline.pair(scene.s));
  EXPECT_EQ(scene.pipeline.statistics().pairings, 1);
  EXPECT_EQ(scene.pipeline.statistics().pairings_skipped, 1);
  EXPECT_FALSE(scene.s.points.xi.empty());
}

/// Half of the skin of 0.1 is for the slave
TYPED_TEST(PipelineTest, KeepsCandidatesWithinTheSkin)
{
  PipelineScene<TypeParam> scene;
  scene.pipeline.pair(scene.s);
  scene.move(0.04);
  EXPECT_TRUE(scene.pipeline.pair(scene.s));
  EXPECT_EQ(scene.builds(), 1);
  scene.move(0.06);
  EXPECT_TRUE(scene.pipeline.pair(scene.s));
  EXPECT_EQ(scene.builds(), 2);
}

TYPED_TEST(PipelineTest, KeptCandidatesFindWhatNewOnesFind)
{
  PipelineScene<TypeParam> kept, fresh;
  kept.pipeline.pair(kept.s);
  for (PipelineScene<TypeParam>* scene : {&kept, &fresh})
  {
    scene->move(0.03);
    scene->pipeline.pair(scene->s);
  }
  EXPECT_EQ(kept.s.points.xi, fresh.s.points.xi);
  EXPECT_EQ(kept.s.hits.master, fresh.s.hits.master);
  EXPECT_EQ(kept.s.hits.gap, fresh.s.hits.gap);
}

TEST(Pipeline, OtherMastersMakeOtherCandidates)
{
  PipelineScene<Triangle1> scene;
  scene.pipeline.pair(scene.s);
  EXPECT_FALSE(scene.pipeline.candidates().masters.empty());
  Surface none = scene.s.master;
  none.facet_id.clear();
  none.facet_nodes.clear();
  none.facet_dofs.clear();
  none.neighbours.clear();
  scene.s.master = none;
  scene.pipeline.forget_candidates();
  EXPECT_TRUE(scene.pipeline.pair(scene.s));
  EXPECT_TRUE(scene.pipeline.candidates().masters.empty());
  EXPECT_EQ(scene.builds(), 2);
}

TEST(Pipeline, CountsHaveANameEach)
{
  std::size_t fields = 0;
  EXPECT_EQ(names_of(PipelineStatistics(), fields).size(), fields);
  EXPECT_EQ(fields * 8, sizeof(PipelineStatistics));
}
