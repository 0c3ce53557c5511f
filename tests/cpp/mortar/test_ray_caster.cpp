#include "facet_types.h"
#include "raymortar/mortar/ray_caster.h"
#include "rays.h"
#include "rules.h"

using namespace raymortar;
using namespace raymortar::test;

namespace
{
/// A plate that faces the slave: its height over the slave, and how thick it is
struct Layer
{
  double height;
  double thickness;
};

/// One slave facet at height 0 that looks up at layers, the last one on
/// another grid than the others
template <class F>
struct Layers
{
  Surface slave = make_surface({F::shape, F::degree, F::node_degree, 1, true},
                               plate(0.5, 0));
  Surface master;
  FacetDistances range{1.0, 1.0};

  explicit Layers(const std::vector<Layer>& layers)
  {
    for (std::size_t k = 0; k < layers.size(); ++k)
    {
      Surface one = make_surface({F::shape, F::degree, F::node_degree,
                                  k + 1 == layers.size() ? 3 : 2, false},
                                 plate(1, layers[k].height));
      const auto facets = static_cast<std::size_t>(one.num_facets());
      auto thickness = master.thickness;
      thickness.insert(thickness.end(), facets, layers[k].thickness);
      master = k == 0 ? one : joined(master, one);
      master.thickness = thickness;
    }
  }

  /// The slave was lower by this at the last accepted step
  void come_from_below(double distance)
  {
    for (std::size_t k = F::gdim - 1; k < slave.x.size(); k += F::gdim)
      slave.x_old[k] = slave.x[k] - distance;
  }

  void limit_depth_by_thickness(double thickness_s)
  {
    const auto n = static_cast<std::size_t>(slave.num_facets());
    range =
        FacetDistances(std::vector<SearchDistances>(n, {1.0, 1.0, 0.0}), true);
    slave.thickness.assign(n, thickness_s);
  }

  [[nodiscard]] Hits hits() const
  {
    const Segmentation s = segments_of(slave, master, {range, false});
    EXPECT_NEAR(total(s.covered), static_cast<double>(slave.num_facets()),
                1e-12);
    return cast_rays(slave, master,
                     make_points(slave, s, segment_rules(F::shape, 3),
                                 rule_on(F::shape, 3), false),
                     range);
  }

  /// Every point has this gap
  void expect_gap(double gap) const
  {
    const Hits h = hits();
    ASSERT_FALSE(h.gap.empty());
    for (std::size_t q = 0; q < h.gap.size(); ++q)
    {
      EXPECT_EQ(h.status[q], RayStatus::hit);
      EXPECT_NEAR(h.gap[q], gap, 1e-13);
    }
  }
};

template <class F>
class RayCasterTest : public testing::Test
{
};
constexpr double unknown = std::numeric_limits<double>::infinity();
} // namespace

TYPED_TEST_SUITE(RayCasterTest, AllFacets, );

TYPED_TEST(RayCasterTest, NearestOfOpenLayersIsMet)
{
  Layers<TypeParam>({{0.3, 0.1}, {0.1, 0.1}, {0.5, 0.1}}).expect_gap(0.1);
  Layers<TypeParam>({{0.1, unknown}, {0.3, unknown}}).expect_gap(0.1);
}

TYPED_TEST(RayCasterTest, BodyThatThePointIsWithinGoesBeforeWhatLiesAhead)
{
  for (const double sunk : {0.02, 0.05, 0.08, 0.0999})
  {
    Layers<TypeParam>({{-sunk, 0.1}, {0.12 - sunk, 0.1}}).expect_gap(-sunk);
    Layers<TypeParam>({{0.12 - sunk, 0.1}, {-sunk, 0.1}}).expect_gap(-sunk);
  }
}

TYPED_TEST(RayCasterTest, WithoutAPastABodyThatHasBeenPassedGivesWay)
{
  Layers<TypeParam>({{-0.11, 0.1}, {0.01, 0.1}}).expect_gap(0.01);
  Layers<TypeParam>({{-0.08, unknown}, {0.04, unknown}}).expect_gap(0.04);
}

TYPED_TEST(RayCasterTest, OldPositionsTellTheLayer)
{
  for (const double was_before : {0.0, 0.02, 3.0})
  {
    Layers<TypeParam> scene({{-0.25, 0.1}, {-0.13, 0.1}, {-0.01, 0.1}});
    scene.come_from_below(0.25 + was_before);
    scene.expect_gap(-0.25);
    scene.come_from_below(0.13);
    scene.expect_gap(-0.13);
  }
}

TYPED_TEST(RayCasterTest, AnOpenLayerAheadIsLeftForANearerOne)
{
  Layers<TypeParam> scene({{0.3, 0.1}, {0.1, 0.1}});
  scene.come_from_below(-0.2); // between the two
  scene.expect_gap(0.1);
}

TYPED_TEST(RayCasterTest, DefaultDepthEndsWhereBodiesAreThin)
{
  const auto deep = [](double sunk, double t_m, double t_s, double before)
  {
    Layers<TypeParam> scene({{-sunk, t_m}});
    scene.limit_depth_by_thickness(t_s);
    scene.come_from_below(before);
    const Hits h = scene.hits();
    return std::all_of(h.status.begin(), h.status.end(),
                       [](RayStatus s) { return s == RayStatus::too_deep; });
  };
  Layers<TypeParam> scene({{-0.09, 0.1}});
  scene.limit_depth_by_thickness(unknown);
  scene.expect_gap(-0.09);
  EXPECT_TRUE(deep(0.11, 0.1, unknown, 0.0));
  EXPECT_TRUE(deep(0.09, 0.1, 0.06, 0.0)); // half of both is 0.08
  scene = Layers<TypeParam>({{-0.09, 0.1}});
  scene.limit_depth_by_thickness(0.06);
  scene.come_from_below(0.02); // it was less deep than that
  scene.expect_gap(-0.09);
}

TYPED_TEST(RayCasterTest, OnlyDoubtLooksBack)
{
  const auto looks_back = [](const Layers<TypeParam>& scene)
  { return scene.hits().hang_on_past; };
  EXPECT_FALSE(looks_back(Layers<TypeParam>({{-0.1, 1.0}})));
  EXPECT_FALSE(looks_back(Layers<TypeParam>({{0.1, 0.1}, {0.3, 0.1}})));
  EXPECT_TRUE(looks_back(Layers<TypeParam>({{-0.1, 0.2}, {0.3, 0.1}})));
}

/// Rays along x, little downwards, of points at height z in front of, within
/// and beside a master whose edge points down
template <class F>
Hits hits_at_edge(const std::vector<std::array<double, 2>>& points,
                  double thickness = unknown)
{
  Surface master =
      make_surface({F::shape, F::degree, F::node_degree, 2, false},
                   graph(1, [](double x, double) { return std::abs(x); }));
  master.thickness.assign(static_cast<std::size_t>(master.num_facets()),
                          thickness);
  Rays<F> rays;
  for (const auto& [x, z] : points)
  {
    typename F::Point at = F::Point::Constant(0.1), n = F::Point::Zero();
    at[0] = x;
    at[F::gdim - 1] = z;
    n[0] = 1.0;
    n[F::gdim - 1] = -0.05;
    Index seed = 0;
    while (master.nodes<F>(master.x, seed).row(0).mean() > 0.0)
      ++seed;
    rays.add(at, n.normalized(), seed);
  }
  return cast_rays(rays.slave, master, rays.points, {3, 30});
}

TYPED_TEST(RayCasterTest, RaysThatPassTheMasterAcrossAnEdgeDoNotComeOutOfIt)
{
  const Hits h =
      hits_at_edge<TypeParam>({{-0.9, 0.2}, {0.3, 0.6}, {0.9, -0.01}});
  EXPECT_EQ(h.status[0], RayStatus::hit);
  EXPECT_GT(h.gap[0], 0.6);
  EXPECT_EQ(h.status[1], RayStatus::hit);
  EXPECT_LT(h.gap[1], -0.9);
  EXPECT_EQ(h.status[2], RayStatus::no_facet);
}

TYPED_TEST(RayCasterTest, ThroughAThinMasterRaysComeOutOfIt)
{
  EXPECT_EQ(hits_at_edge<TypeParam>({{0.9, -0.01}}, 0.02).status[0],
            RayStatus::hit);
  EXPECT_EQ(hits_at_edge<TypeParam>({{0.9, -0.01}}, 0.2).status[0],
            RayStatus::no_facet);
}
