// Element loops for facets of any kind in one dimension; units
// assembler_*.cpp instantiate them.
#pragma once

#include "raymortar/element/any_points.h"
#include "raymortar/element/choose_law.h"
#include "raymortar/element/law_gaps.h"
#include "raymortar/element/parameter_element.h"
#include "raymortar/element/segment_motion.h"

namespace raymortar
{
template <int D, class Law>
class AssemblerOf final : public Assembler
{
  static constexpr bool nodal = holds_at_nodes<Law>;
  using Kernel =
      std::conditional_t<nodal, NodalElement<D, Law>, AnyElement<D, Law>>;
  using F = typename Kernel::F;
  static constexpr int L = Kernel::L;
  static constexpr int M = Kernel::M;
  using Data = typename Kernel::Data;
  using Slave = SlavePoint<F, L, Law>;
  template <bool Slopes>
  using Hit = HitPoint<F, L, Law, Slopes>;

  /// Nothing where points have conditions of their own
  struct NoNodes
  {
    NoNodes(const ContactState&, const DualField*) {}
  };
  using Nodes = std::conditional_t<nodal, FacetConditions<D, Law>, NoNodes>;

  /// Keeps data from point to point, and the conditions at nodes
  struct Points : AnyPoints<D, Law>
  {
    using Base = AnyPoints<D, Law>;
    std::optional<Nodes> nodes; ///< where conditions are asked for

    using Base::Base;

    void take(std::size_t element)
    {
      Base::take(element);
      if constexpr (nodal)
        if (nodes)
          nodes->take(this->state.elements.slave[element],
                      this->shapes.multipliers);
    }

    void place(std::size_t q)
    {
      Base::place(q);
      if constexpr (nodal)
        if (nodes)
          nodes->place(this->shapes);
    }
  };

public:
  explicit AssemblerOf(std::shared_ptr<const DualField> dual)
      : _dual(std::move(dual))
  {
  }

  void residual(const ContactState& s, const BlockSink& sink) const override
  {
    const auto kernel = std::make_unique<Kernel>();
    const auto points = std::make_unique<Points>(
        s, Wanted{.old = is_frictional<Law>}, tractions());
    for (std::size_t e = 0; e < s.elements.size(); ++e)
    {
      points->take(e);
      kernel->clear_residual(points->shapes.size());
      for_points(*points, e,
                 [&](std::size_t)
                 {
                   if (points->has_target)
                     kernel->add_hit(points->data,
                                     Hit<false>(points->data, points->at),
                                     points->shapes);
                   else
                     kernel->add_miss(Slave(points->data, points->at),
                                      points->shapes);
                 });
      sink(e, kernel->b.data(), points->shapes.size());
    }
  }

  void tangent(const ContactState& s, std::span<const std::size_t> elements,
               const BlockSink& sink,
               const CouplingSink& couplings) const override
  {
    const auto kernel = std::make_unique<Kernel>();
    const auto points =
        std::make_unique<Points>(s,
                                 Wanted{.old = is_frictional<Law>,
                                        .target = true,
                                        .bends = true,
                                        .along = s.moving_segments},
                                 tractions());
    std::unique_ptr<SegmentMotion<D>> motion;
    if (s.moving_segments)
      motion = std::make_unique<SegmentMotion<D>>(s);
    if constexpr (nodal)
      points->nodes.emplace(s, _dual.get());
    for (const std::size_t e : elements)
    {
      points->take(e);
      const int size = points->shapes.size();
      kernel->clear_tangent(size);
      const bool moves = motion and has_moving_vertices(s, e);
      add_points({e, points->shapes.alone(), size, kernel->A.data(), couplings},
                 *points, *kernel, moves ? motion.get() : nullptr);
      sink(e, kernel->A.data(), size);
    }
  }

  void by_parameter(const ContactState& s, const Parameter& by,
                    const BlockSink& sink) const override
  {
    const auto kernel = std::make_unique<ParameterElement<D, Law, Kernel>>(by);
    const auto points = std::make_unique<Points>(
        s, Wanted{.old = true, .target = true, .bends = true, .along = true},
        tractions());
    const Nodes* nodes = nullptr;
    if constexpr (nodal)
      nodes = &points->nodes.emplace(s, _dual.get());
    for (std::size_t e = 0; e < s.elements.size(); ++e)
    {
      points->take(e);
      kernel->clear_tangent(points->shapes.size());
      for_points(*points, e,
                 [&](std::size_t)
                 {
                   if (points->has_target)
                     kernel->add_by_parameter(points->data, points->at,
                                              s.elements.master[e],
                                              points->shapes, nodes);
                   else
                     kernel->add_by_parameter(points->data,
                                              Slave(points->data, points->at),
                                              points->shapes);
                 });
      sink(e, kernel->A.data(), points->shapes.size());
    }
  }

  [[nodiscard]] PointResults results(const ContactState& s) const override
  {
    PointResults r = results_without_hits(s);
    const auto points = std::make_unique<Points>(
        s, Wanted{.old = is_frictional<Law>, .target = true}, tractions());
    if constexpr (nodal)
      points->nodes.emplace(s, _dual.get());
    for (std::size_t e = 0; e < s.elements.size(); ++e)
    {
      points->take(e);
      for (const Index q : s.elements.points_of(e))
        store(*points, static_cast<std::size_t>(q), r);
    }
    return r;
  }

  [[nodiscard]] NodeSums node_sums(const ContactState& s,
                                   FacetIntegrals* tested) const override
  {
    NodeSums sums;
    if constexpr (nodal)
    {
      sums = NodeSums(s.multipliers.row.size(), D);
      if (tested)
        tested->assign(s.multipliers.facet.size() * (1 + D), 0.0);
      const auto points = std::make_unique<Points>(
          s, Wanted{.old = is_frictional<Law>}, tractions());
      for (std::size_t e = 0; e < s.elements.size(); ++e)
      {
        points->take(e);
        if (points->has_target)
          for_points(*points, e,
                     [&](std::size_t) {
                       add_to_nodes(*points, s.elements.slave[e], sums, tested);
                     });
      }
    }
    return sums;
  }

private:
  /// Add what a point gives to the nodes of its facet
  static void add_to_nodes(const Points& at, Index facet, NodeSums& sums,
                           FacetIntegrals* tested)
  {
    const Data& e = at.data;
    const Hit<false> p(e, at.at);
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
        sums.at(node, NodeSum::coefficient) +=
            w * p.value(e.history.coefficient);
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

  /// Tangent at fixed points, and what their motion along the facet adds
  /// @param[in,out] motion Null: points stay
  static void add_points(const typename SegmentMotion<D>::Element& element,
                         Points& points, Kernel& kernel,
                         SegmentMotion<D>* motion)
  {
    AnyIntegrand<D> integrand;
    for_points(points, element.number,
               [&](std::size_t q)
               {
                 if (add_point(points, kernel, motion ? &integrand : nullptr))
                   motion->add(element, q, integrand);
               });
    if (motion)
      motion->finish(element);
  }

  /// Add one point
  /// @param[out] along Integrand there, if it is asked for
  /// @return Whether it is set
  static bool add_point(const Points& at, Kernel& kernel,
                        AnyIntegrand<D>* along)
  {
    using Gradient = TaylorGradient<D, Law>;
    const Data& e = at.data;
    if (not at.has_target)
    {
      if constexpr (Kernel::has_condition)
      {
        const Slave p(e, at.at);
        kernel.add_miss_tangent(e, p, at.shapes);
        if (along)
          Gradient::miss(e, at.at, p, at.shapes, *along);
      }
      return Kernel::has_condition and along;
    }
    const Hit<true> p(e, at.at);
    // All that an open point does is what its multiplier does
    if (M == 0 and p.response.status == ContactStatus::open)
      return false;
    const HitSlopes<F, L, Law> slopes(e, at.at, p);
    kernel.add_hit_tangent(e, p, slopes, at.shapes);
    if constexpr (nodal)
      kernel.add_node_tangents(e, p, slopes, at.shapes, *at.nodes);
    if (const Freedom* freedom = at.target.freedom())
      add_turning(*freedom, p, at.shapes, kernel);
    if (not along)
      return false;
    Gradient::hit(e, at.at, p, slopes, at.shapes, *along);
    if constexpr (nodal)
      Gradient::nodes(e, at.at, p, slopes, at.shapes, *at.nodes, *along);
    return true;
  }

  /// Add that points of a body that turns move in circles: the force at the
  /// point, and the pressure's arm there, times the second derivatives of the
  /// place
  static void add_turning(const Freedom& freedom, const Hit<true>& p,
                          const PointShapes<D>& shapes, Kernel& kernel)
  {
    const Vec<D> force = p.weight * p.response.t;
    const Vec<D> arm =
        p.slave.x + p.g * p.slave.n - freedom.centre.template head<D>();
    const Vec<D> to_foot =
        p.has_foot() ? Vec<D>(p.weight * p.pressure() * p.g *
                              (p.normal.dot(p.slave.n) * p.normal - p.slave.n))
                     : Vec<D>(Vec<D>::Zero());
    const Index n = freedom.size();
    const int size = shapes.size(), alone = shapes.alone();
    for (Index j = 0; j < n; ++j)
      for (Index k = 0; k < n; ++k)
      {
        const auto bend = freedom.bend(j, k).template topLeftCorner<D, D>();
        kernel.A[static_cast<std::size_t>((alone + j) * size + alone + k)] +=
            force.dot(bend * arm) + p.normal.dot(bend * to_foot);
      }
  }

  /// Call visit(point) where there is something to integrate, with the point's
  /// data in place
  template <class Visit>
  static void for_points(Points& points, std::size_t e, Visit&& visit)
  {
    const ContactState& s = points.state;
    for (const Index i : s.elements.points_of(e))
    {
      const auto q = static_cast<std::size_t>(i);
      if (s.points.seed[q] == no_index)
        continue;
      points.place(q);
      visit(q);
    }
  }

  static void store(Points& points, std::size_t q, PointResults& r)
  {
    const ContactState& s = points.state;
    points.place(q);
    const Slave slave(points.data, points.at);
    r.weight[q] = slave.weight;
    r.gamma[q] = slave.gamma;
    Eigen::Map<Vec<D>>(r.x.data() + q * D) = slave.slave.x;
    Eigen::Map<Vec<D>>(r.normal.data() + q * D) = slave.slave.n;
    Eigen::Map<Vec<D>>(r.contact_normal.data() + q * D) = slave.slave.n;
    if (s.hits.status[q] != RayStatus::hit)
      return;
    const Hit<false> p(points.data, points.at);
    Eigen::Map<Vec<D>>(r.contact_normal.data() + q * D) = p.normal;
    Eigen::Map<Vec<D>>(r.master_normal.data() + q * D) =
        points.data.master_frames.now.n;
    r.status[q] = p.response.status;
    if constexpr (nodal)
      r.status[q] = points.nodes->nearest_status();
    r.gap[q] = p.gap;
    r.pressure[q] = p.response.p;
    Eigen::Map<Vec<D>>(r.traction.data() + q * D) = p.response.t;
    if constexpr (is_frictional<Law>)
    {
      Eigen::Map<Vec<D>>(r.slip.data() + q * D) = p.slip();
      r.closing[q] = p.old.closing.length;
      Eigen::Map<Vec<D>>(r.friction.data() + q * D) = p.friction();
      r.dissipated[q] = p.dissipated(s.keeps_springs);
    }
  }

  [[nodiscard]] const FacetTractions* tractions() const
  {
    return _dual ? &_dual->tractions : nullptr;
  }

  std::shared_ptr<const DualField> _dual; ///< null: shape functions
};

template <int D>
std::unique_ptr<Assembler>
assembler_in(const ContactState& s,
             const std::shared_ptr<const DualField>& dual)
{
  const auto make = [&dual]<class Law>() -> std::unique_ptr<Assembler>
  { return std::make_unique<AssemblerOf<D, Law>>(dual); };
  return s.has_law_at_nodes() ? with_nodal_law(s, make) : with_law(s, make);
}
} // namespace raymortar
