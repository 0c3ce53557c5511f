#include "raymortar/element/cover.h"
#include "raymortar/element/segment_target.h"
#include "raymortar/geometry/dispatch.h"
#include "raymortar/geometry/facet_mass.h"
#include "raymortar/geometry/predicates.h"
#include <algorithm>
#include <cmath>

namespace raymortar
{
namespace
{
double share_of(const ContactState& s, Index facet)
{
  return s.segmentation.covered[static_cast<std::size_t>(facet)];
}

/// Multiplier nodes of a facet
std::span<const Index> nodes_of(const ContactState& s, Index facet)
{
  const std::size_t n = s.multipliers.facet.size() /
                        static_cast<std::size_t>(s.slave.num_facets());
  return std::span(s.multipliers.facet)
      .subspan(static_cast<std::size_t>(facet) * n, n);
}

/// Mean of gamma over the nodes of a facet
double mean_gamma(const ContactState& s, Index facet)
{
  const auto n = static_cast<std::size_t>(s.slave.dofs_per_facet());
  double sum = 0.0;
  for (std::size_t a = 0; a < n; ++a)
    sum += s.gamma.nodal[static_cast<std::size_t>(facet) * n + a];
  return sum / static_cast<double>(n);
}

/// Over the nodes of a facet of area 1: products, and products of the
/// deviations from the mean
struct UnitMatrices
{
  Eigen::MatrixXd mass;
  Eigen::MatrixXd deviation;
};

UnitMatrices unit_matrices(const ContactState& s)
{
  const auto of = []<Shape S, int L>() -> UnitMatrices {
    return {unit_mass<S, L>(), unit_deviation<S, L>()};
  };
  if (s.slave.shape == Shape::triangle)
    return of.template operator()<Shape::triangle, 1>();
  if (s.slave.shape == Shape::quadrilateral)
    return of.template operator()<Shape::quadrilateral, 1>();
  if (s.multipliers.degree == 2)
    return of.template operator()<Shape::interval, 2>();
  return of.template operator()<Shape::interval, 1>();
}

/// Repeat a matrix of nodes for each component; unknowns go node after node
std::vector<double> by_component(const Eigen::MatrixXd& B, int components)
{
  const Eigen::Index n = B.rows() * components;
  std::vector<double> block(static_cast<std::size_t>(n * n), 0.0);
  for (Eigen::Index k = 0; k < n; ++k)
    for (Eigen::Index j = k % components; j < n; j += components)
      block[static_cast<std::size_t>(k * n + j)] =
          B(k / components, j / components);
  return block;
}

/// B of a facet, and its derivative by the covered share
struct FacetMatrices
{
  Eigen::MatrixXd value;
  Eigen::MatrixXd slope;
};

bool any_of(const std::vector<std::int8_t>& marks, std::span<const Index> nodes)
{
  return std::any_of(nodes.begin(), nodes.end(),
                     [&](Index node)
                     { return marks[static_cast<std::size_t>(node)] != 0; });
}

/// Products of the nodes that are not marked, over gamma
Eigen::MatrixXd drive(const ContactState& s, const Eigen::MatrixXd& mass,
                      Index facet, const std::vector<std::int8_t>& marks)
{
  const double area = s.points.whole[static_cast<std::size_t>(facet)];
  Eigen::MatrixXd B = area / mean_gamma(s, facet) * mass;
  const auto nodes = nodes_of(s, facet);
  for (std::size_t k = 0; k < nodes.size(); ++k)
    if (marks[static_cast<std::size_t>(nodes[k])] != 0)
    {
      B.row(static_cast<Eigen::Index>(k)).setZero();
      B.col(static_cast<Eigen::Index>(k)).setZero();
    }
  return B;
}

/// Factor of the deviations on a partly covered facet: area times compliance
double tie_strength(const ContactState& s, const CoverData& cover, Index facet)
{
  const double area = s.points.whole[static_cast<std::size_t>(facet)];
  const double size = s.points.width[static_cast<std::size_t>(facet)];
  const double compliance = cover.shear_modulus > 0.0
                                ? size / cover.shear_modulus
                                : 1.0 / mean_gamma(s, facet);
  return compliance * area;
}

/// A polynomial of the covered share
struct ShareWeight
{
  double value;
  double slope;
};

/// Beyond the rim a tie acts at once where the rim enters a facet. Within, it
/// begins with s^2, so that no row there jumps  [theory (4.34)]
ShareWeight tie_weight(double share, RimSide side)
{
  const double left = 1.0 - share, square = left * left;
  if (side == RimSide::beyond)
    return {square, -2.0 * left};
  constexpr int steepness = 32; // at s = 0.2 it is at 73 %
  const double chord = 1.0 - share * share;
  const double rest = std::pow(chord, steepness - 1);
  return {square * (1.0 - chord * rest),
          2.0 * square * steepness * share * rest -
              2.0 * left * (1.0 - chord * rest)};
}

/// Matrices that replace the law on the uncovered part of a facet [theory
/// (5.9), (5.10)]
FacetMatrices matrices(const ContactState& s, const CoverData& cover,
                       const UnitMatrices& unit, Index facet, RimSide side)
{
  if (coverage_of(s, facet) == Coverage::nowhere)
    return {drive(s, unit.mass, facet, cover.nodes), {}};
  const double left = 1.0 - share_of(s, facet);
  if (any_of(cover.corners, nodes_of(s, facet)))
  {
    const Eigen::MatrixXd B = drive(s, unit.mass, facet, cover.corners);
    return {left * B, -B};
  }
  const Eigen::MatrixXd B = tie_strength(s, cover, facet) * unit.deviation;
  const ShareWeight weight = tie_weight(share_of(s, facet), side);
  return {weight.value * B, weight.slope * B};
}

/// Derivative of the area of a polygon of reference coordinates by vertex v
template <int T>
Mat<1, T> area_slope(std::span<const Vec<2>> polygon, std::size_t v)
{
  if constexpr (T == 1)
    return Mat<1, 1>(v == 0 ? -1.0 : 1.0);
  else
  {
    const std::size_t n = polygon.size();
    const Vec<2> across = polygon[(v + 1) % n] - polygon[(v + n - 1) % n];
    return 0.5 * Mat<1, 2>(across[1], -across[0]);
  }
}

/// ds through the vertices that one target moves, over the unknowns [slave |
/// target]
template <int D>
std::vector<double> share_slope(const ContactState& s, const Segment& of,
                                const SegmentTarget<D>& target)
{
  const auto begin = static_cast<std::size_t>(of.begin);
  const auto polygon = std::span(s.segmentation.vertices)
                           .subspan(begin, static_cast<std::size_t>(of.size));
  const Eigen::Index side = D * s.slave.dofs_per_facet();
  const Eigen::Index other = target.unknowns();
  Eigen::RowVectorXd ds = Eigen::RowVectorXd::Zero(side + other);
  for (std::size_t v = 0; v < polygon.size(); ++v)
  {
    if (not target.moves(begin + v))
      continue;
    const Mat<1, D - 1> by_xi = area_slope<D - 1>(polygon, v);
    const auto motion = target.motion(begin + v);
    ds.head(side) += by_xi * motion.by_slave;
    ds.tail(other) += by_xi * target.columns(motion);
  }
  if (s.slave.shape == Shape::triangle)
    ds /= Reference<Shape::triangle>::measure;
  return {ds.data(), ds.data() + ds.size()};
}

template <int D>
void add_slopes(const ContactState& s, const Segment& of,
                const Eigen::MatrixXd& change, std::vector<ShareSlope>& slopes)
{
  visit_targets<D>(s, of,
                   [&](const SegmentTarget<D>& target)
                   {
                     slopes.push_back(
                         {of.slave,
                          target.number(),
                          {change.data(), change.data() + change.size()},
                          share_slope<D>(s, of, target)});
                   });
}

/// Nodal tractions of a facet, (components, nodes)
Eigen::MatrixXd tractions(const ContactState& s, Index facet)
{
  const auto nodes = nodes_of(s, facet);
  const int m = s.multipliers.components;
  Eigen::MatrixXd lam(m, nodes.size());
  for (std::size_t k = 0; k < nodes.size(); ++k)
    lam.col(static_cast<Eigen::Index>(k)) = Eigen::Map<const Eigen::VectorXd>(
        s.multipliers.value.data() +
            static_cast<std::size_t>(nodes[k]) * static_cast<std::size_t>(m),
        m);
  return lam;
}
} // namespace

Coverage coverage_of(const ContactState& s, Index facet)
{
  const double share = share_of(s, facet);
  if (share <= tolerance::coverage)
    return Coverage::nowhere;
  return share < 1.0 - tolerance::coverage ? Coverage::partly
                                           : Coverage::throughout;
}

std::vector<std::int8_t> covered_nodes(const ContactState& s)
{
  std::vector<std::int8_t> covered(s.multipliers.row.size(), 0);
  if (s.multipliers.components == 0)
    return covered;
  for (Index f = 0; f < s.slave.num_facets(); ++f)
    if (coverage_of(s, f) != Coverage::nowhere)
      for (const Index node : nodes_of(s, f))
        covered[static_cast<std::size_t>(node)] = 1;
  return covered;
}

std::vector<FacetBlock> cover_blocks(const ContactState& s,
                                     const CoverData& cover, RimSide side)
{
  std::vector<FacetBlock> blocks;
  if (s.multipliers.components == 0)
    return blocks;
  const UnitMatrices unit = unit_matrices(s);
  for (Index f = 0; f < s.slave.num_facets(); ++f)
    if (coverage_of(s, f) != Coverage::throughout)
      blocks.push_back({f, by_component(matrices(s, cover, unit, f, side).value,
                                        s.multipliers.components)});
  return blocks;
}

std::vector<ShareSlope> share_slopes(const ContactState& s,
                                     const CoverData& cover, RimSide side)
{
  std::vector<ShareSlope> slopes;
  if (s.multipliers.components == 0)
    return slopes;
  const UnitMatrices unit = unit_matrices(s);
  for (const Segment& segment : s.segmentation.segments)
  {
    const Index f = segment.slave;
    if (coverage_of(s, f) != Coverage::partly)
      continue;
    const Eigen::MatrixXd change =
        -tractions(s, f) * matrices(s, cover, unit, f, side).slope;
    if (s.slave.gdim == 2)
      add_slopes<2>(s, segment, change, slopes);
    else
      add_slopes<3>(s, segment, change, slopes);
  }
  return slopes;
}
} // namespace raymortar
