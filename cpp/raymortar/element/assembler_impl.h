// Element loops for facets of any kind in one dimension; units
// assembler_*.cpp instantiate them.
#pragma once

#include "raymortar/element/any_points.h"
#include "raymortar/element/choose_law.h"
#include "raymortar/element/law_gaps.h"
#include "raymortar/element/segment_motion.h"

namespace raymortar
{
/// @brief Points of an element, for laws that hold there.
template <int D, class Law>
struct PointsOf : AnyPoints<D, Law>
{
  using Base = AnyPoints<D, Law>;
  using Kernel = AnyElement<D, Law>;
  using Hit = HitPoint<D, Law>;

  /// There are no functions of the multiplier but its shape functions
  struct Functions
  {
  };

  PointsOf(const ContactState& s, const Wanted& wanted, const Functions*)
      : Base(s, wanted)
  {
  }

  /// Called before tangents and results
  void prepare() {}

  /// Add to a point's tangent, and to its integrand along the facet, what is
  /// not the point's own
  void add_tangent(Kernel&, const Hit&, const HitSlopes<D, Law>&) const {}
  void add_integrand(const Hit&, const HitSlopes<D, Law>&,
                     AnyIntegrand<D>&) const
  {
  }

  template <class Response>
  [[nodiscard]] ContactStatus status(const Response& response) const
  {
    return response.status;
  }

  /// Add what a law with elastic slip has at a point
  void add_elastic_slip(const HitPoint<D, Law, false>& p, std::size_t q,
                        PointResults& r) const
  {
    if constexpr (has_cone_at_points<Law>)
    {
      const Vec<D> slip = p.elastic_slip();
      Eigen::Map<Vec<D>>(r.elastic_slip.data() + q * D) = slip;
      r.elastic_energy[q] = 0.5 * dot<D>(slip, p.response.t);
    }
  }
};

/// @tparam Points Has the members of PointsOf
template <int D, class Law, class Points = PointsOf<D, Law>>
class AssemblerOf : public Assembler
{
protected:
  using Functions = typename Points::Functions;
  using Kernel = typename Points::Kernel;
  static constexpr int M = Kernel::M;
  using Data = typename Kernel::Data;
  using Slave = SlavePoint<D, Law>;
  template <bool Slopes>
  using Hit = HitPoint<D, Law, Slopes>;

public:
  /// @param[in] functions Those whenever it assembles; null: shape functions
  explicit AssemblerOf(std::shared_ptr<const Functions> functions = nullptr)
      : _functions(std::move(functions))
  {
  }

  // Flat, as `add_point`: left to itself the compiler keeps calls within, and a
  // tangent takes 1.3 times as long, a residual twice
  [[gnu::flatten]] void residual(const ContactState& s,
                                 const BlockSink& sink) const override
  {
    const auto kernel = std::make_unique<Kernel>();
    const auto points = std::make_unique<Points>(
        s, Wanted{.old = is_frictional<Law>}, _functions.get());
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
                                 _functions.get());
    std::unique_ptr<SegmentMotion<D>> motion;
    if (s.moving_segments)
      motion = std::make_unique<SegmentMotion<D>>(s);
    points->prepare();
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

  [[nodiscard]] PointResults results(const ContactState& s) const override
  {
    PointResults r = results_without_hits(s);
    const auto points = std::make_unique<Points>(
        s, Wanted{.old = is_frictional<Law>, .target = true}, _functions.get());
    points->prepare();
    for (std::size_t e = 0; e < s.elements.size(); ++e)
    {
      points->take(e);
      for (const Index q : s.elements.points_of(e))
        store(*points, static_cast<std::size_t>(q), r);
    }
    return r;
  }

protected:
  [[nodiscard]] const Functions* functions() const { return _functions.get(); }

private:
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
  [[gnu::flatten]] static bool add_point(const Points& at, Kernel& kernel,
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
          Gradient::miss(e, p, at.shapes, *along);
      }
      return Kernel::has_condition and along;
    }
    const Hit<true> p(e, at.at);
    // All that an open point does is what its multiplier does
    if (M == 0 and p.response.status == ContactStatus::open)
      return false;
    const HitSlopes<D, Law> slopes(e, p);
    kernel.add_hit_tangent(e, p, slopes, at.shapes);
    at.add_tangent(kernel, p, slopes);
    if (const Freedom* freedom = at.target.freedom())
      add_turning(*freedom, p, at.shapes, kernel);
    if (not along)
      return false;
    Gradient::hit(e, at.at, p, slopes, at.shapes, *along);
    at.add_integrand(p, slopes, *along);
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
    r.status[q] = points.status(p.response);
    r.gap[q] = p.gap;
    r.pressure[q] = p.response.p;
    Eigen::Map<Vec<D>>(r.traction.data() + q * D) = p.response.t;
    if constexpr (is_frictional<Law>)
    {
      Eigen::Map<Vec<D>>(r.slip.data() + q * D) = p.slip();
      r.closing[q] = p.old.closing.length;
      Eigen::Map<Vec<D>>(r.friction.data() + q * D) = p.friction();
      r.dissipated[q] = p.dissipated(s.keeps_springs);
      if (not r.elastic_slip.empty())
        points.add_elastic_slip(p, q, r);
    }
  }

  std::shared_ptr<const Functions> _functions;
};

template <int D>
std::unique_ptr<Assembler> assembler_in(const ContactState& s)
{
  return with_law(s,
                  []<class Law>() -> std::unique_ptr<Assembler>
                  { return std::make_unique<AssemblerOf<D, Law>>(); });
}
} // namespace raymortar
