#include "raymortar/element/cover.h"
#include "raymortar/element/vertex_motion.h"
#include "raymortar/geometry/dispatch.h"
#include "raymortar/geometry/facet_mass.h"
#include "raymortar/geometry/predicates.h"
#include <cmath>

namespace raymortar
{
namespace
{
/// Of the tie, in facet sizes over the shear modulus: with half of it or twice
/// as much the force changes by less than the error of the mesh
constexpr double tie_factor = 5.0;

/// How firmly a facet is tied by its covered share: like its cover at first,
/// without a kink where it becomes covered throughout [theory (5.10)]
double tie_weight(double share)
{
  return share * (1.0 - share) * (1.0 - share);
}

double tie_weight_slope(double share)
{
  return (1.0 - share) * (1.0 - 3.0 * share);
}

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
    sum += s.gamma[static_cast<std::size_t>(facet) * n + a];
  return sum / static_cast<double>(n);
}

/// Calls fn with matrices over the nodes of one facet: of products, and of
/// products of deviations from the mean
template <class Fn>
void with_matrices(const ContactState& s, Fn&& fn)
{
  const auto give = [&]<Shape S, int L>()
  {
    fn(Eigen::MatrixXd(unit_mass<S, L>()),
       Eigen::MatrixXd(unit_deviation<S, L>()));
  };
  if (s.slave.shape == Shape::triangle)
    give.template operator()<Shape::triangle, 1>();
  else if (s.slave.shape == Shape::quadrilateral)
    give.template operator()<Shape::quadrilateral, 1>();
  else if (s.multipliers.degree == 2)
    give.template operator()<Shape::interval, 2>();
  else
    give.template operator()<Shape::interval, 1>();
}

/// The same for each component: of the unknowns, node after node
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

/// Products of the nodes that are covered nowhere [theory (5.9)]
Eigen::MatrixXd drive(const ContactState& s, const CoverData& cover,
                      const Eigen::MatrixXd& mass, Index facet)
{
  const double area = s.points.whole[static_cast<std::size_t>(facet)];
  Eigen::MatrixXd B = area / mean_gamma(s, facet) * mass;
  const auto nodes = nodes_of(s, facet);
  for (std::size_t k = 0; k < nodes.size(); ++k)
    if (cover.nodes[static_cast<std::size_t>(nodes[k])] != 0)
    {
      B.row(static_cast<Eigen::Index>(k)).setZero();
      B.col(static_cast<Eigen::Index>(k)).setZero();
    }
  return B;
}

/// Of the deviations of a partly covered facet, its weight aside: area times a
/// compliance [theory (5.10)]
double tie_strength(const ContactState& s, const CoverData& cover, Index facet)
{
  const double area = s.points.whole[static_cast<std::size_t>(facet)];
  const double size = std::pow(area, 1.0 / (s.slave.gdim - 1));
  const double compliance = cover.shear_modulus > 0.0
                                ? size / cover.shear_modulus
                                : 1.0 / mean_gamma(s, facet);
  return tie_factor * compliance * area;
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

/// ds through the vertices of one segment
template <class F>
std::vector<double> share_slope(const ContactState& s, const Segment& of)
{
  constexpr int T = F::tdim;
  const auto slave = s.slave.template nodes<F>(s.slave.x, of.slave);
  const auto master = s.master.template nodes<F>(s.master.x, of.master);
  const auto begin = static_cast<std::size_t>(of.begin);
  const auto polygon = std::span(s.segmentation.vertices)
                           .subspan(begin, static_cast<std::size_t>(of.size));
  Mat<1, 2 * Variations<F>::side> ds = Mat<1, 2 * Variations<F>::side>::Zero();
  for (std::size_t v = 0; v < polygon.size(); ++v)
    if (s.segmentation.breaks[begin + v].motion != Break::Motion::fixed)
      ds += area_slope<T>(polygon, v) *
            segment_vertex_motion<F>(s.segmentation, of, slave, master,
                                     begin + v);
  ds /= F::Ref::measure;
  return {ds.data(), ds.data() + ds.size()};
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
                                     const CoverData& cover)
{
  std::vector<FacetBlock> blocks;
  if (s.multipliers.components == 0)
    return blocks;
  with_matrices(
      s,
      [&](const Eigen::MatrixXd& mass, const Eigen::MatrixXd& deviation)
      {
        for (Index f = 0; f < s.slave.num_facets(); ++f)
        {
          const Coverage coverage = coverage_of(s, f);
          if (coverage == Coverage::throughout)
            continue;
          const double share = share_of(s, f);
          blocks.push_back(
              {f, by_component(coverage == Coverage::nowhere
                                   ? drive(s, cover, mass, f)
                                   : Eigen::MatrixXd(tie_weight(share) *
                                                     tie_strength(s, cover, f) *
                                                     deviation),
                               s.multipliers.components)});
        }
      });
  return blocks;
}

std::vector<TieSlope> tie_slopes(const ContactState& s, const CoverData& cover)
{
  std::vector<TieSlope> slopes;
  if (s.multipliers.components == 0)
    return slopes;
  const auto add = [&]<class F>(const Eigen::MatrixXd& deviation, F)
  {
    for (const Segment& segment : s.segmentation.segments)
    {
      const Index f = segment.slave;
      if (coverage_of(s, f) != Coverage::partly)
        continue;
      const Eigen::MatrixXd change = -tie_weight_slope(share_of(s, f)) *
                                     tie_strength(s, cover, f) *
                                     tractions(s, f) * deviation;
      slopes.push_back({f,
                        segment.master,
                        {change.data(), change.data() + change.size()},
                        share_slope<F>(s, segment)});
    }
  };
  with_matrices(s,
                [&](const Eigen::MatrixXd&, const Eigen::MatrixXd& deviation) {
                  with_facet_type(s.slave, [&]<class F>(F type)
                                  { add(deviation, type); });
                });
  return slopes;
}
} // namespace raymortar
