// Element loops for one facet type; units assembler_*.cpp instantiate them.
#pragma once

#include "raymortar/element/choose_law.h"
#include "raymortar/element/general_assembler.h"
#include "raymortar/element/moving_segments.h"
#include "raymortar/element/typed_assembler.h"
#include "raymortar/geometry/predicates.h"

namespace raymortar
{
template <class F, int L, class Law>
class AssemblerImpl final : public Assembler
{
  using Kernel = Element<F, L, Law>;
  using Layout = typename Kernel::Layout;
  using Data = typename Kernel::Data;
  static constexpr int D = F::gdim;
  static constexpr int M = Layout::components;
  using States = ElementStates<F, is_frictional<Law>>;
  using Motion = MovingSegments<F, Layout>;

public:
  void residual(const ContactState& s, const BlockSink& sink) const override
  {
    const auto kernel = std::make_unique<Kernel>();
    for (std::size_t e = 0; e < s.elements.size(); ++e)
    {
      add_residual(s, e, gather(s, e), *kernel);
      sink(e, kernel->b.data(), block_size(s, e));
    }
  }

  void tangent(const ContactState& s, std::span<const std::size_t> elements,
               const BlockSink& sink,
               const CouplingSink& couplings) const override
  {
    // Eigen aligns fixed-size blocks; the largest is too big for the stack
    const auto kernel = std::make_unique<Kernel>();
    std::unique_ptr<Motion> motion;
    if (s.moving_segments)
      motion = std::make_unique<Motion>();
    std::vector<double> alone(Layout::alone * Layout::alone);
    for (const std::size_t e : elements)
    {
      const Data data = gather(s, e);
      typename Motion::Element element{s,         e,         data.slave,
                                       kernel->A, couplings, {}};
      if (motion)
        element.map.emplace(data.reference);
      add_tangent(element, data, *kernel, motion.get());
      if (motion)
        motion->finish(element);
      const int n = block_size(s, e);
      if (n == Layout::size)
      {
        sink(e, kernel->A.data(), n);
        continue;
      }
      for (int i = 0; i < n; ++i)
        std::copy_n(kernel->A.data() + i * Layout::size, n,
                    alone.data() + i * n);
      sink(e, alone.data(), n);
    }
  }

  // Once an accepted step: not worth a kernel for each type
  [[nodiscard]] PointResults results(const ContactState& s) const override
  {
    return make_general_assembler(s)->results(s);
  }

private:
  [[nodiscard]] static int block_size(const ContactState& s, std::size_t e)
  {
    return s.elements.master[e] == no_index ? Layout::alone : Layout::size;
  }

  [[nodiscard]] static Data gather(const ContactState& s, std::size_t e)
  {
    Data data;
    const Index f = s.elements.slave[e];
    const auto facet = static_cast<std::size_t>(f);
    data.slave = s.slave.template nodes<F>(s.slave.x, f);
    if (s.moving_segments)
      data.reference = s.slave.template nodes<F>(s.slave.X, f);
    data.gamma = s.gamma.template nodes<F>(f).transpose();
    data.offset = s.offset.template nodes<F>(f).transpose();
    if (const Index m = s.elements.master[e]; m != no_index)
    {
      data.master = s.master.template nodes<F>(s.master.x, m);
      data.gamma *= s.pair_factors.of(s.slave.body_of(f), s.master.body_of(m));
    }
    data.measure = s.measure;
    data.touch = tolerance::touch * diameter<F>(data.slave);
    if constexpr (is_frictional<Law>)
      gather_history(s, e, data);
    if constexpr (M > 0)
    {
      data.lam_scale = s.multipliers.scale;
      for (int k = 0; k < Layout::multipliers; ++k)
      {
        const auto node = static_cast<std::size_t>(
            s.multipliers.facet[facet * Layout::multipliers +
                                static_cast<std::size_t>(k)]);
        // The shape functions carry the scale, so the nodal values must not
        data.lam.col(k) =
            Eigen::Map<const Vec<M>>(s.multipliers.value.data() + node * M) /
            s.multipliers.scale;
      }
    }
    return data;
  }

  static void gather_history(const ContactState& s, std::size_t e, Data& data)
  {
    const Index f = s.elements.slave[e];
    auto& history = data.history;
    history.friction = *s.friction;
    history.slave_old = s.slave.template nodes<F>(s.slave.x_old, f);
    if (s.elements.master[e] != no_index)
      history.master_old =
          s.master.template nodes<F>(s.master.x_old, s.elements.master[e]);
    history.has_coefficient = not s.friction_coefficient.empty();
    history.coefficient =
        s.friction_coefficient.template nodes<F>(f).transpose();
    history.traction_old = s.traction_old.template nodes<F, D>(f);
    history.has_springs = not history.traction_old.isZero(0.0);
  }

  /// Call with the number of each point of an element. Of points without a
  /// seed nothing is integrated
  template <class Call>
  static void for_points(const ContactState& s, std::size_t e, Call&& call)
  {
    for (const Index i : s.elements.points_of(e))
      if (const auto q = static_cast<std::size_t>(i);
          s.points.seed[q] != no_index)
        call(q);
  }

  static void add_residual(const ContactState& s, std::size_t e,
                           const Data& data, Kernel& kernel)
  {
    kernel.b.setZero();
    if (s.elements.master[e] == no_index)
    {
      for_points(s, e,
                 [&](std::size_t q) {
                   kernel.add_miss(
                       SlavePoint<F, L, Law>(data, element_point<F>(s, q)));
                 });
      return;
    }
    const States states(data);
    for_points(s, e,
               [&](std::size_t q)
               {
                 kernel.add_hit(HitPoint<F, L, Law, false>(
                     data, states, element_point<F>(s, q)));
               });
  }

  /// Tangent at fixed points, and what their motion along the facet adds
  /// @param[in,out] motion Null: points stay
  static void add_tangent(const typename Motion::Element& element,
                          const Data& data, Kernel& kernel, Motion* motion)
  {
    using Gradient = SurfaceGradient<F, L, Law>;
    const ContactState& s = element.state;
    kernel.A.setZero();
    if (s.elements.master[element.number] == no_index)
    {
      for_points(s, element.number,
                 [&](std::size_t number)
                 {
                   const auto q = element_point<F>(s, number);
                   const SlavePoint<F, L, Law> p(data, q);
                   kernel.add_miss_tangent(data, q, p);
                   if (motion)
                     motion->add(element, number, Gradient::miss(data, q, p));
                 });
      return;
    }
    const States states(data);
    for_points(s, element.number,
               [&](std::size_t number)
               {
                 const auto q = element_point<F>(s, number);
                 const HitPoint<F, L, Law> p(data, states, q);
                 // All that an open point does is what its multiplier does
                 if (M == 0 and p.response.status == ContactStatus::open)
                   return;
                 const HitSlopes<F, L, Law> slopes(data, q, p);
                 kernel.add_hit_tangent(data, p, slopes);
                 if (motion)
                   motion->add(element, number,
                               Gradient::hit(data, q, p, slopes));
               });
  }
};

/// @brief Tells whether a law has its own kernel on facets of type F. Friction
/// on quadrilaterals of degree 2 is rare, and there the kernel of any facets
/// takes 1.0 to 1.6 of the typed one's time.
template <class F, class Law>
inline constexpr bool has_own_kernel = F::shape != Shape::quadrilateral or
                                       F::degree == 1 or not is_frictional<Law>;

template <class F>
std::unique_ptr<Assembler> assembler_for(const ContactState& s)
{
  constexpr int highest = F::shape == Shape::interval ? F::degree : 1;
  const int degree = s.multipliers.degree;
  return with_law(
      s,
      [&]<class Law>() -> std::unique_ptr<Assembler>
      {
        constexpr int components = Law::template multiplier_size<F::gdim>;
        if (components > 0 and (degree < 1 or degree > highest))
          throw Error("multiplier of degree " + std::to_string(degree) +
                      " on facets with displacement of degree " +
                      std::to_string(F::degree) +
                      ": 2D takes up to the displacement's degree, 3D takes 1");
        if constexpr (has_own_kernel<F, Law>)
          if (components == 0 or degree == highest)
            return std::make_unique<
                AssemblerImpl<F, components == 0 ? 0 : highest, Law>>();
        return make_general_assembler(s);
      });
}
} // namespace raymortar
