// Element loops of laws that hold at nodes, in one dimension; units
// nodal_assembler_*.cpp instantiate them.
#pragma once

#include "raymortar/element/assembler_impl.h"
#include "raymortar/nodes/choose_nodal_law.h"
#include "raymortar/nodes/nodal_assembler.h"
#include "raymortar/nodes/nodal_element.h"

namespace raymortar
{
/// @brief As PointsOf: nodes have the conditions.
template <int D, class Law>
struct NodalPoints : AnyPoints<D, Law>
{
  using Base = AnyPoints<D, Law>;
  using Kernel = NodalElement<D, Law>;
  using Hit = HitPoint<D, Law>;
  static constexpr int T = D - 1;
  using Functions = NodeFunctions;
  const NodeFunctions* functions;               ///< null: shape functions
  std::optional<FacetConditions<D, Law>> nodes; ///< where they are asked for

  NodalPoints(const ContactState& s, const Wanted& wanted,
              const NodeFunctions* those)
      : Base(s, wanted, those ? &those->tractions : nullptr), functions(those)
  {
  }

  void prepare() { nodes.emplace(this->state, functions); }

  void take(std::size_t element)
  {
    Base::take(element);
    if (nodes)
      nodes->take(this->state.elements.slave[element],
                  this->shapes.multipliers);
  }

  void place(std::size_t q)
  {
    Base::place(q);
    if (nodes)
      nodes->place(this->shapes);
  }

  void add_tangent(Kernel& kernel, const Hit& p,
                   const HitSlopes<D, Law>& slopes) const
  {
    kernel.add_node_tangents(this->data, p, slopes, this->shapes, *nodes);
  }

  /// Rows of nodes
  void add_integrand(const Hit& p, const HitSlopes<D, Law>& slopes,
                     AnyIntegrand<D>& out) const;

  template <class Response>
  [[nodiscard]] ContactStatus status(const Response&) const
  {
    return nodes->nearest_status();
  }

  /// Add what the nodes have between them, and take what they store off the
  /// work of tractions
  void add_elastic_slip(const HitPoint<D, Law, false>& p, std::size_t q,
                        PointResults& r) const
  {
    if constexpr (is_frictional<Law>)
      for (int k = 0; k < nodes->size(); ++k)
      {
        const double share = nodes->test(k);
        const auto lam = nodes->multiplier(this->state.points.slave[q], k);
        const Vec<D>& now = nodes->at(k).elastic_slip;
        Vec<D> change = now;
        if (nodes->springs().are_there())
          change -= nodes->springs().turned(p, k).value();
        Eigen::Map<Vec<D>>(r.elastic_slip.data() + q * D) += share * now;
        r.elastic_energy[q] += 0.5 * share * now.dot(lam);
        r.dissipated[q] -= share * change.dot(lam);
      }
  }
};

template <int D, class Law>
void NodalPoints<D, Law>::add_integrand(const Hit& p,
                                        const HitSlopes<D, Law>& slopes,
                                        AnyIntegrand<D>& out) const
{
  constexpr int M = Kernel::M;
  const auto& e = this->data;
  const PointShapes<D>& unknowns = this->shapes;
  const typename TaylorGradient<D, Law>::Place along(e, p, slopes.dual);
  const Mat<1, T> no_gamma = Mat<1, T>::Zero();
  const Mat<M, T> no_lam = Mat<M, T>::Zero();
  const double w = along.area.jacobian * unknowns.scale;
  for (int k = 0; k < nodes->size(); ++k)
  {
    const auto& c = nodes->at(k);
    const RowAtPoint<D, M> row = nodes->row(e, p, k);
    const PointSlopes<D, Law> by_point(c, row);
    const Mat<M, T> varied = at_node(
        p, *nodes, k,
        [&](const Hit& here)
        {
          return chain<M>(by_point.slopes(), here, slopes,
                          FacetColumns<D, Law>(e, this->at, here, slopes,
                                               along.bend, no_gamma, no_lam));
        });
    const Mat<M, T> along_facet =
        varied + row.along + row.test * p.gamma * c.by_gamma * along.log_gamma +
        row.value * along.area.log_jacobian;
    for (int i = 0; i < M; ++i)
    {
      const auto r = static_cast<std::size_t>(unknowns.side() + k * M + i);
      out.f[r] = w * row.value[i] + unknowns.scale * row.by_share[i];
      for (std::size_t j = 0; j < T; ++j)
        out.f_xi[j][r] = w * along_facet(i, static_cast<int>(j));
    }
  }
}

template <int D, class Law>
class NodalAssemblerOf final : public AssemblerOf<D, Law, NodalPoints<D, Law>>,
                               public NodalAssembler
{
  using Points = NodalPoints<D, Law>;
  using Base = AssemblerOf<D, Law, Points>;

public:
  using Base::Base;

  [[nodiscard]] NodeSums node_sums(const ContactState& s,
                                   FacetIntegrals* tested) const override
  {
    NodeSums sums(s.multipliers.row.size(), D);
    if (tested)
      tested->assign(s.multipliers.facet.size() * (1 + D), 0.0);
    const auto points = std::make_unique<Points>(
        s, Wanted{.old = is_frictional<Law>}, this->functions());
    NodeSprings<D> springs(s);
    for (std::size_t e = 0; e < s.elements.size(); ++e)
    {
      points->take(e);
      if (not points->has_target)
        continue;
      springs.take(s.elements.slave[e]);
      for_points(
          *points, e,
          [&](std::size_t)
          { add_point(*points, s.elements.slave[e], springs, sums, tested); });
    }
    return sums;
  }

private:
  /// Add what a point gives to the nodes of its facet
  static void add_point(const Points& at, Index facet,
                        const NodeSprings<D>& springs, NodeSums& sums,
                        FacetIntegrals* tested)
  {
    const auto& e = at.data;
    const HitPoint<D, Law, false> p(e, at.at);
    const Multipliers& m = at.state.multipliers;
    const int count = at.shapes.multipliers;
    ShapeRows<D - 1> tests;
    set_node_tests<D - 1>(at.shapes.multiplier, count, tests);
    for (int k = 0; k < count; ++k)
    {
      const auto place = static_cast<std::size_t>(facet * count + k);
      const Index node = m.facet[place];
      const double w = p.weight * tests[static_cast<std::size_t>(k)][0];
      sums.at(node, NodeSum::area) += w;
      sums.at(node, NodeSum::gamma) += w * p.gamma;
      sums.at(node, NodeSum::touch) += w * e.touch;
      sums.template at<D>(node, NodeVector::normal) += w * p.normal;
      if constexpr (is_frictional<Law>)
      {
        sums.at(node, NodeSum::coefficient) += w * e.history.coefficient[0];
        if (springs.are_there())
          sums.template at<D>(node, NodeVector::elastic) +=
              w * springs.turned(p, k).value();
      }
      double* const gap = tested ? tested->data() + place * (1 + D)
                                 : &sums.at(node, NodeSum::gap);
      *gap += w * p.gap;
      if constexpr (is_frictional<Law>)
        Eigen::Map<Vec<D>>(
            tested ? gap + 1
                   : sums.template at<D>(node, NodeVector::slip).data()) +=
            w * p.old.w;
    }
  }
};

template <int D>
std::unique_ptr<Assembler>
nodal_assembler_in(const ContactState& s,
                   const std::shared_ptr<const NodeFunctions>& functions)
{
  return with_nodal_law(
      s,
      [&functions]<class Law>() -> std::unique_ptr<Assembler>
      { return std::make_unique<NodalAssemblerOf<D, Law>>(functions); });
}
} // namespace raymortar
