#include "facet_types.h"
#include "raymortar/mortar/segmentation.h"
#include "surfaces.h"

using namespace raymortar;
using namespace raymortar::test;

namespace
{
/// Sum of the covered shares over the number of facets
double coverage(const Segmentation& s)
{
  return total(s.covered) / static_cast<double>(s.covered.size());
}

void expect_covered(const Segmentation& s, double tolerance)
{
  for (const double share : s.covered)
    ASSERT_NEAR(share, 1, tolerance);
  EXPECT_TRUE(s.degenerate.empty());
}

/// Vertices finite and in the reference facet, segments with an area, in order.
/// True breaks on curved and warped facets may lie outside by a slack
void expect_valid(const Segmentation& s, Shape shape, double slack = 2e-15)
{
  Index last = 0;
  std::int32_t end = 0;
  for (const Segment& segment : s.segments)
  {
    EXPECT_GE(segment.slave, last);
    EXPECT_EQ(segment.begin, end);
    EXPECT_GE(segment.size, shape == Shape::interval ? 2 : 3);
    last = segment.slave;
    end += segment.size;
  }
  EXPECT_EQ(s.vertices.size(), static_cast<std::size_t>(end));
  EXPECT_EQ(s.provenance.size(), s.vertices.size());
  for (const Vec<2>& v : s.vertices)
  {
    const double amount = shape == Shape::interval
                              ? violation<Shape::interval>(v.head<1>()).amount
                          : shape == Shape::triangle
                              ? violation<Shape::triangle>(v).amount
                              : violation<Shape::quadrilateral>(v).amount;
    ASSERT_LT(amount, slack);
  }
}

double bowl(double x, double y) { return 0.2 * (x * x - 0.5 * y * y + x * y); }

Map raised(double w, double gap)
{
  return graph(w, [gap](double x, double y) { return bowl(x, y) + gap; });
}
} // namespace

TEST(Segmentation, FlatFacetsAreCoveredExactly)
{
  std::mt19937 random(1);
  for (const Shape shape : all_shapes)
    for (int trial = 0; trial < 40; ++trial)
    {
      Surface slave =
          make_surface({shape, 1, 1, 1 + trial % 6, true}, plate(1, 0));
      Surface master = make_surface({shape, 1, 1, 1 + trial % 7, false},
                                    plate(1 + 0.1 * (trial % 2), 0.1));
      jitter(slave, random, 0.1 / (1 + trial % 6));
      jitter(master, random, 0.1 / (1 + trial % 7));
      turn_and_shift(slave, 0.2 * trial, 0.3);
      turn_and_shift(master, 0.2 * trial, 0.3);
      const auto s = segments_of(slave, master, {0.2, 0.1, false});
      expect_covered(s, 1e-12);
      expect_valid(s, shape);
    }
}

TEST(Segmentation, CurvedFacetsAreCoveredByALargerMaster)
{
  for (const Shape shape : all_shapes)
    for (const bool subdivide : {false, true})
      for (int n = 2; n < 6; ++n)
      {
        const Surface slave =
            make_surface({shape, 2, 2, 4, true}, raised(1, 0));
        const Surface master =
            make_surface({shape, 2, 2, n, false}, raised(1.2, 0.05));
        const auto s = segments_of(slave, master, {0.2, 0.1, subdivide});
        expect_covered(s, 1e-12);
        expect_valid(s, shape, tolerance::break_move);
      }
}

TEST(Segmentation, SubdividedFacetsHaveSegmentsOnEveryPatch)
{
  for (const Shape shape : all_shapes)
  {
    const Surface slave = make_surface({shape, 2, 2, 2, true}, raised(1, 0));
    const Surface master = make_surface({shape, 2, 2, 2, false}, raised(1, 0));
    const auto s = segments_of(slave, master, {0.2, 0.1, true});
    std::array<int, 4> seen{};
    for (const Segment& segment : s.segments)
    {
      ++seen[static_cast<std::size_t>(segment.slave_patch)];
      EXPECT_EQ(segment.slave_patch >= (shape == Shape::interval ? 2 : 4),
                false);
    }
    EXPECT_GT(seen[1], 0);
    EXPECT_EQ(seen[3] > 0, shape != Shape::interval);
  }
}

TEST(Segmentation, MatchingGridsGiveOneSegmentPerFacet)
{
  for (const Shape shape : all_shapes)
  {
    const Surface slave = make_surface({shape, 1, 1, 4, true}, plate(1, 0));
    Surface master = make_surface({shape, 1, 1, 4, false}, plate(1, 0));
    const auto s = segments_of(slave, master, {0.2, 0.1, false});
    expect_covered(s, 1e-14);
    // Mirrored triangles have the other diagonal
    const std::size_t per_facet = shape == Shape::triangle ? 2 : 1;
    EXPECT_EQ(s.segments.size(), per_facet * s.covered.size());
  }
}

TEST(Segmentation, PartialOverlapCoversItsExactShare)
{
  for (const Shape shape : all_shapes)
    for (const double part : {1e-6, 0.01, 0.3, 0.75, 0.999999})
    {
      const Surface slave = make_surface({shape, 1, 1, 3, true}, plate(1, 0));
      const Surface master =
          make_surface({shape, 1, 1, 4, false}, [&](double s, double t)
                       { return Vec<3>(-1 + 2 * part * s, 2 * t - 1, 0.1); });
      const auto covering = segments_of(slave, master, {0.2, 0.1, false});
      EXPECT_NEAR(coverage(covering), part, 1e-14);
      expect_valid(covering, shape);
    }
}

TEST(Segmentation, FlippedMasterIsNoContact)
{
  for (const Shape shape : all_shapes)
    for (const double height : {0.1, 0.0, -0.05})
    {
      const Surface slave = make_surface({shape, 1, 1, 3, true}, plate(1, 0));
      const Surface master =
          make_surface({shape, 1, 1, 4, true}, plate(1, height));
      EXPECT_TRUE(
          segments_of(slave, master, {0.2, 0.1, false}).segments.empty());
    }
}

TEST(Segmentation, BackFaceDoesNotHideTheFaceBehindIt)
{
  for (const Shape shape : all_shapes)
  {
    const Surface slave = make_surface({shape, 1, 1, 3, true}, plate(1, 0));
    const Surface back = make_surface({shape, 1, 1, 4, true}, plate(1, 0.01));
    const Surface face = make_surface({shape, 1, 1, 2, false}, plate(1, 0.1));
    const auto s = segments_of(slave, joined(back, face), {0.2, 0.1, false});
    expect_covered(s, 1e-12);
    for (const Segment& segment : s.segments)
      EXPECT_GE(segment.master, back.num_facets());
  }
}

TEST(Segmentation, NearerLayerWinsOnFacetsOfAnySize)
{
  // A small plate in front of a large one: once over the middle, nowhere twice
  for (const Shape shape : all_shapes)
    for (const int n : {1, 4})
    {
      const Surface slave = make_surface({shape, 1, 1, n, true}, plate(1, 0));
      const Surface far =
          make_surface({shape, 1, 1, 3, false}, plate(1.2, 0.15));
      const Surface near =
          make_surface({shape, 1, 1, 2, false}, plate(0.5, 0.05));
      const auto s = segments_of(slave, joined(far, near), {0.2, 0.1, false});
      expect_covered(s, 1e-12);
      const auto small = segments_of(slave, near, {0.2, 0.1, false});
      const auto twice =
          segments_of(slave, joined(near, near), {0.2, 0.1, false});
      EXPECT_NEAR(coverage(small), shape == Shape::interval ? 0.5 : 0.25,
                  1e-14);
      EXPECT_NEAR(coverage(twice), coverage(small), 1e-12);
    }
}

TEST(Segmentation, MastersOutOfRangeAreLeftOut)
{
  // Beyond the range and the slack for curvature, a quarter of the facet
  for (const Shape shape : all_shapes)
    for (const double height : {0.9, -0.8})
    {
      const Surface slave = make_surface({shape, 1, 1, 4, true}, plate(1, 0));
      const Surface master =
          make_surface({shape, 1, 1, 4, false}, plate(1, height));
      EXPECT_TRUE(
          segments_of(slave, master, {0.2, 0.1, false}).segments.empty());
    }
}

TEST(Segmentation, EmptyMasterLeavesEverythingUncovered)
{
  for (const Shape shape : all_shapes)
  {
    const Surface slave = make_surface({shape, 1, 1, 3, true}, plate(1, 0));
    Surface none = slave;
    none.facet_id.clear();
    const auto s = segments_of(slave, none, {0.2, 0.1, false});
    EXPECT_TRUE(s.segments.empty());
    EXPECT_EQ(s.covered, std::vector<double>(
                             static_cast<std::size_t>(slave.num_facets())));
    EXPECT_TRUE(segments_of(none, slave, {0.2, 0.1, false}).covered.empty());
  }
}

TEST(Segmentation, NotANumberStaysWhereItIs)
{
  for (const Shape shape : all_shapes)
    for (const bool in_slave : {true, false})
    {
      Surface slave = make_surface({shape, 1, 1, 3, true}, plate(1, 0));
      Surface master = make_surface({shape, 1, 1, 4, false}, plate(1, 0.1));
      Surface& broken = in_slave ? slave : master;
      broken.x[0] = NAN;
      // Every pair is tried, as a box without numbers meets nothing
      Candidates all;
      for (Index f = 0; f < slave.num_facets(); ++f)
      {
        for (Index m = 0; m < master.num_facets(); ++m)
          all.masters.push_back(m);
        all.offsets.push_back(static_cast<std::int64_t>(all.masters.size()));
      }
      const auto s = make_segments(slave, master, all, {0.2, 0.1, false});
      expect_valid(s, shape);
      EXPECT_EQ(s.degenerate.empty(), not in_slave);
      EXPECT_GT(coverage(s), 0.5);
      EXPECT_LT(coverage(s), 1);
    }
}

TEST(Segmentation, FacetsOfVeryDifferentSizeMeet)
{
  for (const Shape shape : all_shapes)
    for (const auto& [slaves, masters] : {std::pair{1, 100}, {100, 1}})
    {
      const Surface slave =
          make_surface({shape, 1, 1, slaves, true}, plate(1, 0));
      const Surface master =
          make_surface({shape, 1, 1, masters, false}, plate(1, 0.001));
      const auto s = segments_of(slave, master, {0.01, 0.01, false});
      expect_covered(s, 1e-11);
      expect_valid(s, shape);
    }
}

TEST(Segmentation, WarpedQuadrilateralsAreCovered)
{
  std::mt19937 random(2);
  for (int trial = 0; trial < 50; ++trial)
  {
    Surface slave =
        make_surface({Shape::quadrilateral, 1, 1, 3, true}, plate(1, 0));
    jitter(slave, random, 0.15);
    for (std::size_t k = 2; k < slave.x.size(); k += 3)
      slave.x[k] = 0.15 * random_vector<1>(random, 1)[0];
    const Surface master =
        make_surface({Shape::quadrilateral, 1, 1, 4, false}, plate(2, 0.3));
    const auto s = segments_of(slave, master, {1, 1, false});
    expect_covered(s, 1e-12);
    expect_valid(s, Shape::quadrilateral, tolerance::break_move);
  }
}

TEST(Segmentation, ScaleAndOffsetDoNotMatter)
{
  for (const Shape shape : all_shapes)
    for (const double scale : {1e-9, 1e-3, 1e6})
      for (const double offset : {0.0, 1e3, 1e6})
      {
        const auto at = [&](double w, double z) -> Map
        {
          return [=](double s, double t) -> Vec<3>
          { return scale * (plate(w, z)(s, t) + Vec<3>::Constant(offset)); };
        };
        const auto s =
            segments_of(make_surface({shape, 1, 1, 4, true}, at(1, 0)),
                        make_surface({shape, 1, 1, 5, false}, at(1.1, 0.05)),
                        {0.2 * scale, 0.1 * scale, false});
        expect_covered(s, 1e-12);
        expect_valid(s, shape);
      }
}
