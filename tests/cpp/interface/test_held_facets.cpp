#include "interface/held.h"
#include <Eigen/Dense>

using namespace raymortar;
using namespace raymortar::test;

namespace
{
/// Reference area of a facet, and integrals over it by its even spread over xi
template <class F>
double area_of(const Surface& s, Index facet)
{
  const auto rule = rule_on(F::shape, 6);
  double area = 0.0;
  for (std::size_t q = 0; q < rule.weights.size(); ++q)
    area +=
        rule.weights[q] * frame_at<F>(s.nodes<F>(s.X, facet),
                                      rule.points[q].template head<F::tdim>())
                              .jacobian;
  return area;
}

/// Integral of the squares of what polynomials of one degree less cannot
/// follow, of a field with these nodal values, on a facet of area 1: a least
/// squares fit at the points of a rule
template <class F>
double roughness(const Vec<F::dofs>& nodal)
{
  const auto rule = rule_on(F::shape, 8);
  const auto n = static_cast<Eigen::Index>(rule.weights.size());
  const Eigen::Index terms = F::degree == 1 ? 1 : 1 + F::tdim;
  Eigen::MatrixXd A(n, terms);
  Eigen::VectorXd v(n);
  for (Eigen::Index q = 0; q < n; ++q)
  {
    const typename F::RefPoint xi = rule.points[q].template head<F::tdim>();
    const double root = std::sqrt(rule.weights[q] / F::Ref::measure);
    A(q, 0) = root;
    if (terms > 1)
      A.row(q).tail(F::tdim) = root * xi.transpose();
    v[q] = root * F::Disp::values(xi).dot(nodal);
  }
  return (v - A * A.colPivHouseholderQr().solve(v)).squaredNorm();
}

/// The form of a facet's block at a field with these nodal values
template <class F>
double form(const FacetBlock& facet, const Eigen::MatrixXd& nodal)
{
  const Eigen::Index n = nodal.size();
  const Eigen::Map<const Eigen::MatrixXd> B(facet.block.data(), n, n);
  EXPECT_LE((B - B.transpose()).norm(), 1e-15 * B.norm());
  const Eigen::Map<const Eigen::VectorXd> lam(nodal.data(), n);
  return lam.dot(B * lam);
}

/// Blocks are those of (5.5) with the given weights of components and a share
/// of what lies opposite
template <class F>
void expect_blocks(const ContactState& s, const HeldFacets& held,
                   const Eigen::MatrixXd& W,
                   const std::function<double(Index)>& share)
{
  ASSERT_EQ(held.facets.size(), s.slave.facet_id.size());
  std::mt19937 random(5);
  const Eigen::Index m = W.rows();
  // W = sum of w v v^T: along each v the field is a scalar one
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> modes(W);
  for (const FacetBlock& facet : held.facets)
  {
    ASSERT_EQ(facet.block.size(),
              static_cast<std::size_t>(F::dofs * m * F::dofs * m));
    const double area = area_of<F>(s.slave, facet.slave);
    Eigen::MatrixXd nodal(m, F::dofs);
    for (double& value : nodal.reshaped())
      value = random_vector<1>(random, 1.0)[0];
    double expected = 0.0;
    for (Eigen::Index k = 0; k < m; ++k)
      expected += modes.eigenvalues()[k] *
                  roughness<F>(nodal.transpose() * modes.eigenvectors().col(k));
    expected *=
        share(facet.slave) * area * std::pow(area, 1.0 / F::tdim) / modulus;
    EXPECT_NEAR(form<F>(facet, nodal), expected, 1e-13);
    // What is left alone
    EXPECT_NEAR(form<F>(facet, Eigen::MatrixXd::Ones(m, F::dofs)), 0.0, 1e-15);
  }
}

double whole(Index) { return 1.0; }

/// With what is left where friction keeps what nothing feels, (5.23)
HeldFacets rest_of(HeldFacets held)
{
  EXPECT_EQ(held.facets.size(), held.rest.size());
  held.facets = held.rest;
  return held;
}

template <class F>
class HeldFacetsTest : public testing::Test
{
};
} // namespace

TYPED_TEST_SUITE(HeldFacetsTest, HeldTypes, );

TYPED_TEST(HeldFacetsTest, WhatIsHeldOnBothSidesIsDampedInFull)
{
  using F = TypeParam;
  constexpr int D = F::gdim;
  const auto plates = paired_plates<F>(true);
  const ContactState& s = plates->state();
  const auto found = [&](Law law)
  { return find<F>(s, law, everything<F>, everything<F>); };
  expect_blocks<F>(s, found(Law::friction), Mat<D, D>::Identity(), whole);
  const Vec<D> n = Vec<D>::Unit(D - 1);
  expect_blocks<F>(s, rest_of(found(Law::friction)), n * n.transpose(), whole);
  expect_blocks<F>(s, found(Law::vector), n * n.transpose(), whole);
  expect_blocks<F>(s, found(Law::scalar), Eigen::MatrixXd::Ones(1, 1), whole);
  for (const std::int8_t known : found(Law::vector).known)
    EXPECT_EQ(known, 1);
}

TYPED_TEST(HeldFacetsTest, FreeMasterBalancesAll)
{
  using F = TypeParam;
  const auto plates = paired_plates<F>(true);
  const ContactState& s = plates->state();
  for (const Law law : {Law::vector, Law::scalar, Law::friction})
  {
    EXPECT_TRUE(find<F>(s, law, everything<F>, nothing<F>).facets.empty());
    EXPECT_TRUE(find<F>(s, law, nothing<F>, everything<F>).facets.empty());
  }
}

TYPED_TEST(HeldFacetsTest, RollersAlongTheSurfaceCountWithFrictionOnly)
{
  using F = TypeParam;
  constexpr int D = F::gdim;
  const auto plates = paired_plates<F>(true);
  const ContactState& s = plates->state();
  const Vec<D> along = Vec<D>::Ones() - Vec<D>::Unit(D - 1);
  const Held<F> rollers = [&](const Vec<D>&) { return along; };
  for (const Law law : {Law::vector, Law::scalar})
    EXPECT_TRUE(find<F>(s, law, rollers, everything<F>).facets.empty());
  const auto found = find<F>(s, Law::friction, rollers, everything<F>);
  expect_blocks<F>(s, found, along.asDiagonal().toDenseMatrix(), whole);
  // Unless the law keeps what they leave unfelt
  expect_blocks<F>(s, rest_of(found), Mat<D, D>::Zero(), whole);
}

TYPED_TEST(HeldFacetsTest, NodesHeldAlongTheSurfaceAreDampedNextToFreeOnes)
{
  using F = TypeParam;
  constexpr int D = F::gdim;
  const auto plates = paired_plates<F>(true);
  const ContactState& s = plates->state();
  const double edge = first_edge<F>(s);
  const Held<F> inside = [&](const Vec<D>& x) -> Vec<D>
  { return (is_at(edge, x[0]) ? 0.0 : 1.0) * Vec<D>::Unit(0); };
  const auto found = find<F>(s, Law::friction, inside, everything<F>);
  ASSERT_EQ(found.facets.size(), found.rest.size());
  std::mt19937 random(9);
  int mixed = 0;
  for (std::size_t k = 0; k < found.facets.size(); ++k)
  {
    const auto f = static_cast<std::size_t>(found.facets[k].slave);
    Mat<D, F::dofs> nodal = Mat<D, F::dofs>::Zero();
    nodal.row(0) = random_vector<F::dofs>(random, 1.0).transpose();
    const double full = form<F>(found.facets[k], nodal);
    EXPECT_GT(full, 0.0);
    const bool is_mixed = found.unfelt[f * D] == 0;
    mixed += is_mixed;
    EXPECT_EQ(form<F>(found.rest[k], nodal), is_mixed ? full : 0.0);
  }
  EXPECT_GT(mixed, 0);
}

// Against an oblique surface one free axis along it, or none, moves the gap
TYPED_TEST(HeldFacetsTest, NothingIsDampedWhereGapsTakeWhatIsFree)
{
  using F = TypeParam;
  constexpr int D = F::gdim;
  const auto plates =
      paired_plates<F>(true, [](Surface& s) { turn_and_shift(s, 1.2, 0.0); });
  const ContactState& s = plates->state();
  const Held<F> first = [](const Vec<D>&) { return Vec<D>::Unit(0); };
  const auto found = find<F>(s, Law::friction, first, everything<F>);
  expect_blocks<F>(s, rest_of(found), Mat<D, D>::Zero(), whole);
}

TYPED_TEST(HeldFacetsTest, NormalOfATiltedSurfaceWeighsTheComponents)
{
  using F = TypeParam;
  constexpr int D = F::gdim;
  const auto plates =
      paired_plates<F>(true, [](Surface& s) { turn_and_shift(s, 1.2, 0.0); });
  const ContactState& s = plates->state();
  const Vec<D> n =
      frame_at<F>(s.slave.nodes<F>(s.slave.X, 0), F::RefPoint::Zero()).n;
  bool damped = false, free = false;
  for (int held = 0; held < D; ++held)
  {
    const Held<F> one = [&](const Vec<D>&) { return Vec<D>::Unit(held); };
    const double w = std::max(0.0, 1.0 - 2.0 * (1.0 - n[held] * n[held])) *
                     n[held] * n[held];
    const auto found = find<F>(s, Law::vector, one, everything<F>);
    (w > 0.0 ? damped : free) = true;
    if (w > 0.0)
      expect_blocks<F>(s, found, w * n * n.transpose(), whole);
    else
      EXPECT_TRUE(found.facets.empty());
  }
  EXPECT_TRUE(damped and free) << n;
}

TYPED_TEST(HeldFacetsTest, ShareIsThatOfTheMastersNodesThatAreHeld)
{
  using F = TypeParam;
  constexpr int D = F::gdim;
  if constexpr (F::degree == 1)
  {
    const auto plates = paired_plates<F>(true);
    const ContactState& s = plates->state();
    // The master's outer column of nodes, 2/3 from the next: what is held
    // falls linearly from 1 to 0 between them, and is 0 on half of the slave
    const Held<F> column = [](const Vec<D>& x) -> Vec<D>
    { return Vec<D>::Constant(x[0] < -0.9 ? 1.0 : 0.0); };
    const HeldFacets held = find<F>(s, Law::friction, everything<F>, column);
    std::vector<double> shares;
    const auto share = [&](Index facet)
    {
      // By strips of the facet, which are as wide as the facet is there
      const auto x = s.slave.nodes<F>(s.slave.X, facet).row(0).eval();
      const double first = x.minCoeff(), length = x.maxCoeff() - first;
      const bool shrinks = (x.array() < x.mean()).count() == 2;
      double all = 0.0, opposite = 0.0;
      const int strips = 20000;
      for (int k = 0; k < strips; ++k)
      {
        const double at = (k + 0.5) / strips;
        const double width = F::shape != Shape::triangle ? 1.0
                             : shrinks                   ? 1.0 - at
                                                         : at;
        all += width;
        opposite +=
            width * std::max(0.0, 1.0 - 1.5 * (first + at * length + 1.0));
      }
      return opposite / all;
    };
    for (Index f = 0; f < s.slave.num_facets(); ++f)
      if (share(f) > 0.0)
        shares.push_back(share(f));
    ASSERT_EQ(held.facets.size(), shares.size());
    EXPECT_LT(shares.size(), s.slave.facet_id.size());
    std::mt19937 random(6);
    for (std::size_t k = 0; k < shares.size(); ++k)
    {
      const FacetBlock& facet = held.facets[k];
      const double area = area_of<F>(s.slave, facet.slave);
      Mat<D, F::dofs> nodal = Mat<D, F::dofs>::Zero();
      nodal.row(0) = random_vector<F::dofs>(random, 1.0).transpose();
      EXPECT_NEAR(form<F>(facet, nodal),
                  shares[k] * area * std::pow(area, 1.0 / F::tdim) / modulus *
                      roughness<F>(nodal.row(0).transpose()),
                  1e-8);
    }
  }
}

TYPED_TEST(HeldFacetsTest, StiffBodiesAreDampedLess)
{
  using F = TypeParam;
  const auto plates = paired_plates<F>(true);
  const ContactState& s = plates->state();
  const auto soft =
      find<F>(s, Law::friction, everything<F>, everything<F>, modulus);
  const auto stiff =
      find<F>(s, Law::friction, everything<F>, everything<F>, 4.0 * modulus);
  ASSERT_EQ(soft.facets.size(), stiff.facets.size());
  for (std::size_t f = 0; f < soft.facets.size(); ++f)
    for (std::size_t k = 0; k < soft.facets[f].block.size(); ++k)
      EXPECT_NEAR(soft.facets[f].block[k], 4.0 * stiff.facets[f].block[k],
                  1e-15);
}

TYPED_TEST(HeldFacetsTest, FacetsStayAsTheyWereWhenTheyFirstMetAMaster)
{
  using F = TypeParam;
  const auto plates = paired_plates<F>(true);
  Zone& zone = *plates;
  const auto all = fixed<F>(zone.state().slave, everything<F>);
  HeldFacets held;
  const auto find_more = [&](const Held<F>& master)
  {
    const ContactState& s = zone.state();
    find_held_facets(s, all, fixed<F>(s.master, master), modulus, held);
  };
  // Out of reach nothing is met
  std::vector<double> away(zone.input().master.rows.size(), 0.0);
  for (std::size_t k = F::gdim - 1; k < away.size(); k += F::gdim)
    away[k] = -5.0;
  move_master(zone, away);
  find_more(everything<F>);
  EXPECT_TRUE(held.facets.empty());
  for (const std::int8_t known : held.known)
    EXPECT_EQ(known, 0);
  move_master(zone, std::vector<double>(away.size(), 0.0));
  find_more(everything<F>);
  const auto first = held.facets;
  ASSERT_EQ(first.size(), zone.state().slave.facet_id.size());
  find_more(nothing<F>);
  ASSERT_EQ(held.facets.size(), first.size());
  for (std::size_t f = 0; f < first.size(); ++f)
    EXPECT_EQ(held.facets[f].block, first[f].block);
}

TEST(HeldFacets, MultipliersOfLowerDegreeAreLeftAlone)
{
  const auto left_alone = []<class F>(F)
  {
    const auto plates = paired_plates<F>(true);
    const auto held =
        find<F>(plates->state(), Law::friction, everything<F>, everything<F>);
    EXPECT_TRUE(held.facets.empty());
  };
  left_alone(Triangle2{});
  left_alone(Quad2{});
}
