#include "bent_facets.h"
#include "raymortar/element/measure.h"

using namespace raymortar;
using namespace raymortar::test;

namespace
{
using Line12 = FacetType<Shape::interval, 1, 2>;
using Lines = testing::Types<Interval1, Line12, Interval2>;
constexpr std::array measures = {Measure::reference, Measure::current,
                                 Measure::reference_of_revolution,
                                 Measure::current_of_revolution};

/// A bent line off the axis, undeformed and deformed
template <class F>
struct Line
{
  typename F::NodeMatrix reference, deformed;
  typename F::RefPoint xi;

  explicit Line(std::mt19937& random)
      : reference(random_nodes<F>(random, 0.1)),
        deformed(random_nodes<F>(random, 0.1)), xi(random_inside<F>(random))
  {
    reference.row(0).array() += 0.4;
    deformed.row(0).array() += 0.5;
  }

  /// Area per reference area of the deformed line
  [[nodiscard]] static double area(Measure measure,
                                   const typename F::NodeMatrix& nodes,
                                   const typename F::RefPoint& at)
  {
    return area_of<2>(measure, 1.0, 0.0, frame_at<F>(nodes, at));
  }
};

template <class F>
class MeasureTest : public testing::Test
{
};
} // namespace

TYPED_TEST_SUITE(MeasureTest, Lines, );

TEST(Measure, OfRevolutionIsThatOfAFullTurn)
{
  // Half the length of a cone's side, with the radius in its middle
  const Frame<2> frame =
      frame_at<Interval1>(Mat<2, 2>{{1.0, 4.0}, {0.0, 4.0}}, Vec<1>(0.5));
  EXPECT_DOUBLE_EQ(area_of(Measure::current, 0.5, 7.0, frame), 2.5);
  EXPECT_DOUBLE_EQ(area_of(Measure::current_of_revolution, 0.5, 7.0, frame),
                   2.5 * 2.0 * std::numbers::pi * 2.5);
  EXPECT_EQ(area_of(Measure::reference, 0.5, 7.0, frame), 7.0);
  EXPECT_EQ(area_of(Measure::reference_of_revolution, 0.5, 7.0, frame), 7.0);
}

TEST(Measure, OfRevolutionLeavesSpaceAlone)
{
  // There is no such measure in 3D; kernels there do not ask
  std::mt19937 random(1);
  const auto nodes = random_nodes<Triangle2>(random, 0.1);
  const Frame<3> frame = frame_at<Triangle2>(nodes, Vec<2>(0.2, 0.3));
  EXPECT_EQ(area_of(Measure::current_of_revolution, 0.5, 0.0, frame),
            area_of(Measure::current, 0.5, 0.0, frame));
}

TYPED_TEST(MeasureTest, VariationIsTheDerivativeOfTheLogarithm)
{
  using F = TypeParam;
  std::mt19937 random(2);
  for (const Measure measure : measures)
    for (int trial = 0; moves(measure) and trial < 10; ++trial)
    {
      const Line<F> line(random);
      const auto log_area = [&](const Vector& u)
      {
        typename F::NodeMatrix nodes = line.deformed;
        for (int a = 0; a < F::nodes; ++a)
        {
          const Vec<F::dofs> N = F::Disp::values(typename F::RefPoint(
              F::Node::points[static_cast<std::size_t>(a)].data()));
          for (int b = 0; b < F::dofs; ++b)
            nodes.col(a) += N[b] * u.template segment<2>(2 * b);
        }
        const double area = Line<F>::area(measure, nodes, line.xi);
        return Vector(Vector::Constant(1, std::log(area)));
      };
      const auto frame = frame_at<F>(line.deformed, line.xi);
      auto rows = no_rows<1, 2>();
      add_area<1, 2>(measure, frame, dual_tangents<2>(frame), Vec<1>(1.0),
                     rows);
      expect_derivative(log_area, Vector::Zero(2 * F::dofs),
                        by_dofs<F, 1>(rows, line.xi));
    }
}

TYPED_TEST(MeasureTest, AlongTheFacetIsTheDerivativeByItsCoordinate)
{
  using F = TypeParam;
  std::mt19937 random(3);
  for (const Measure measure : measures)
    for (int trial = 0; trial < 10; ++trial)
    {
      const Line<F> line(random);
      const auto& nodes = moves(measure) ? line.deformed : line.reference;
      const Measure moved =
          revolves(measure) ? Measure::current_of_revolution : Measure::current;
      const auto frame = frame_at<F>(line.deformed, line.xi);
      const auto along =
          area_along<F>(measure, line.reference, line.xi, frame,
                        curvature_at<F>(line.deformed, line.xi, frame));
      EXPECT_DOUBLE_EQ(along.jacobian, Line<F>::area(moved, nodes, line.xi));
      expect_derivative(
          [&](const Vector& xi)
          {
            const double area = Line<F>::area(moved, nodes, xi);
            return Vector(Vector::Constant(1, std::log(area)));
          },
          line.xi, along.log_jacobian);
    }
}
