#include "differences.h"
#include "raymortar/geometry/reference.h"
#include <random>

using namespace raymortar;
using namespace raymortar::test;

namespace
{
template <Shape S, int K>
struct Basis : Lagrange<S, K>
{
  static constexpr Shape shape = S;
  static constexpr int degree = K;
  using Point = Vec<Reference<S>::tdim>;
};

template <class B>
typename B::Point random_point(std::mt19937& random)
{
  std::uniform_real_distribution<double> unit(0, 1);
  typename B::Point xi;
  do
    for (Eigen::Index i = 0; i < xi.size(); ++i)
      xi[i] = unit(random);
  while (violation<B::shape>(xi).edge >= 0);
  return xi;
}

/// All monomials that the basis holds, at a point
template <class B>
std::vector<double> monomials(const typename B::Point& xi)
{
  std::vector<double> values;
  const int K = B::degree;
  const bool square = B::shape == Shape::quadrilateral;
  const double y = xi.size() == 2 ? xi[xi.size() - 1] : 0;
  for (int i = 0; i <= K; ++i)
    for (int j = 0; j <= (xi.size() == 1 ? 0 : K); ++j)
      if (square or i + j <= K)
        values.push_back(std::pow(xi[0], i) * std::pow(y, j));
  return values;
}

template <class B>
class ReferenceTest : public testing::Test
{
};
using Bases =
    testing::Types<Basis<Shape::interval, 1>, Basis<Shape::interval, 2>,
                   Basis<Shape::triangle, 1>, Basis<Shape::triangle, 2>,
                   Basis<Shape::quadrilateral, 1>,
                   Basis<Shape::quadrilateral, 2>>;
} // namespace

TYPED_TEST_SUITE(ReferenceTest, Bases, );

TYPED_TEST(ReferenceTest, ShapeFunctionsAddUpToOneAndGradientsToNothing)
{
  std::mt19937 random(1);
  for (int trial = 0; trial < 1000; ++trial)
  {
    const auto xi = random_point<TypeParam>(random);
    EXPECT_NEAR(TypeParam::values(xi).sum(), 1, 1e-15);
    EXPECT_LT(TypeParam::gradients(xi).colwise().sum().cwiseAbs().maxCoeff(),
              4e-15);
  }
}

TYPED_TEST(ReferenceTest, EachShapeFunctionIsOneAtItsPointAndZeroAtOthers)
{
  using Point = typename TypeParam::Point;
  for (std::size_t a = 0; a < TypeParam::points.size(); ++a)
  {
    const auto N = TypeParam::values(Point(TypeParam::points[a].data()));
    for (int b = 0; b < TypeParam::nodes; ++b)
      EXPECT_EQ(N[b], static_cast<int>(a) == b ? 1.0 : 0.0);
  }
}

TYPED_TEST(ReferenceTest, PolynomialsOfTheDegreeAreReproduced)
{
  using Point = typename TypeParam::Point;
  std::mt19937 random(2);
  for (int trial = 0; trial < 100; ++trial)
  {
    const Point xi = random_point<TypeParam>(random);
    const auto N = TypeParam::values(xi);
    std::vector<double> sum(monomials<TypeParam>(xi).size(), 0.0);
    for (std::size_t a = 0; a < TypeParam::points.size(); ++a)
    {
      const auto at = monomials<TypeParam>(Point(TypeParam::points[a].data()));
      for (std::size_t k = 0; k < sum.size(); ++k)
        sum[k] += N[static_cast<int>(a)] * at[k];
    }
    for (std::size_t k = 0; k < sum.size(); ++k)
      EXPECT_NEAR(sum[k], monomials<TypeParam>(xi)[k], 2e-15);
  }
}

TYPED_TEST(ReferenceTest, GradientsAreTheDerivativesOfTheValues)
{
  std::mt19937 random(3);
  for (int trial = 0; trial < 20; ++trial)
  {
    const auto xi = random_point<TypeParam>(random);
    expect_derivative([](const Eigen::VectorXd& at) -> Eigen::VectorXd
                      { return TypeParam::values(at); },
                      xi, TypeParam::gradients(xi));
  }
}

TYPED_TEST(ReferenceTest, ViolationNamesTheEdgeOfTheCycle)
{
  using Ref = Reference<TypeParam::shape>;
  using Point = typename TypeParam::Point;
  const auto corner = [](std::size_t k)
  {
    const auto node = static_cast<std::size_t>(Ref::cycle[k % Ref::corners]);
    return Point(TypeParam::points[node].data());
  };
  Point centre = Point::Zero();
  for (std::size_t k = 0; k < Ref::corners; ++k)
    centre += corner(k) / Ref::corners;
  EXPECT_EQ(violation<TypeParam::shape>(centre).edge, -1);
  EXPECT_LT(violation<TypeParam::shape>(centre).amount, 0);
  for (std::size_t e = 0; e < Ref::edges; ++e)
  {
    // An interval's "edges" are its ends
    const Point on =
        Ref::tdim == 1 ? corner(e) : Point(0.5 * (corner(e) + corner(e + 1)));
    EXPECT_NEAR(violation<TypeParam::shape>(on).amount, 0, 1e-16);
    const auto outside = violation<TypeParam::shape>(on + 0.1 * (on - centre));
    EXPECT_EQ(outside.edge, static_cast<int>(e));
    EXPECT_GT(outside.amount, 0.01);
  }
}
