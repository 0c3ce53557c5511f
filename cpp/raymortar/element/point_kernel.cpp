#include "raymortar/element/point_kernel.h"
#include "raymortar/element/choose_law.h"
#include "raymortar/element/surface_gradient.h"

namespace raymortar
{
namespace
{
template <int D, class Law>
class LawAtPoint final : public PointKernel<D>
{
  using F = Germ<D>;
  static constexpr int M = Law::template multiplier_size<D>;
  static constexpr int L = M > 0 ? 1 : 0;
  using Kernel = Element<F, L, Law>;
  using Data = ElementData<F, L, Law>;
  using Gradient = SurfaceGradient<F, L, Law>;
  using Layout = typename Kernel::Layout;

public:
  [[nodiscard]] bool is_frictional() const override
  {
    return raymortar::is_frictional<Law>;
  }

  void residual(const GermPoint<D>& at, PointBlocks<D>& out) const override
  {
    const Data data = gather(at);
    const ElementPoint<F> q = place(at);
    Kernel kernel;
    kernel.b.setZero();
    if (at.is_hit)
      kernel.add_hit(HitPoint<F, L, Law, false>(data, q));
    else
      kernel.add_miss(SlavePoint<F, L, Law>(data, q));
    out.b = kernel.b.head(size(at));
  }

  void tangent(const GermPoint<D>& at, bool along,
               PointBlocks<D>& out) const override
  {
    const Data data = gather(at);
    const ElementPoint<F> q = place(at);
    Kernel kernel;
    kernel.A.setZero();
    if (at.is_hit)
    {
      const HitPoint<F, L, Law> p(data, q);
      const HitSlopes<F, L, Law> slopes(data, q, p);
      kernel.add_hit_tangent(data, p, slopes);
      if (along)
        keep(Gradient::hit(data, q, p, slopes), size(at), out);
    }
    else
    {
      const SlavePoint<F, L, Law> p(data, q);
      kernel.add_miss_tangent(data, q, p);
      if (along)
        keep(Gradient::miss(data, q, p), size(at), out);
    }
    out.A = kernel.A.topLeftCorner(size(at), size(at));
  }

  [[nodiscard]] PointResult<D> result(const GermPoint<D>& at) const override
  {
    const Data data = gather(at);
    const ElementPoint<F> q = place(at);
    PointResult<D> r;
    const SlavePoint<F, L, Law> slave(data, q);
    r.weight = slave.weight;
    r.gamma = slave.gamma;
    if (not at.is_hit)
      return r;
    const HitPoint<F, L, Law, false> p(data, q);
    r.status = p.response.status;
    r.pressure = p.response.p;
    r.normal = p.normal;
    r.traction = p.response.t;
    if constexpr (raymortar::is_frictional<Law>)
    {
      r.slip = p.slip();
      r.closing = p.old.closing.length;
      r.friction = p.friction();
    }
    return r;
  }

private:
  [[nodiscard]] static int size(const GermPoint<D>& at)
  {
    return at.is_hit ? Layout::size : Layout::alone;
  }

  static void keep(const Integrand<F, L, Law>& integrand, int size,
                   PointBlocks<D>& out)
  {
    out.f = integrand.f.head(size);
    out.f_xi = integrand.f_xi.topRows(size);
  }

  [[nodiscard]] static ElementPoint<F> place(const GermPoint<D>& at)
  {
    return {F::RefPoint::Zero(),
            F::RefPoint::Zero(),
            at.weight,
            at.area,
            at.gap,
            at.bound};
  }

  [[nodiscard]] static Data gather(const GermPoint<D>& at)
  {
    Data data;
    data.slave = at.slave;
    data.master = at.master;
    data.reference = at.reference;
    if constexpr (M > 0)
      data.lam = at.lam.template topRows<M>() / at.lam_scale;
    data.gamma = at.gamma;
    data.offset = at.offset;
    data.lam_scale = at.lam_scale;
    data.touch = at.touch;
    data.measure = at.measure;
    data.frame_of_target = at.frame_of_target;
    if constexpr (raymortar::is_frictional<Law>)
    {
      data.history.slave_old = at.slave_old;
      data.history.master_old = at.master_old;
      data.history.traction_old = at.traction_old;
      data.history.has_springs = not at.traction_old.isZero(0.0);
      data.history.friction = at.friction;
      data.history.has_coefficient = at.has_coefficient;
      data.history.coefficient = at.coefficient;
    }
    return data;
  }
};
} // namespace

template <int D>
std::unique_ptr<PointKernel<D>> make_point_kernel(const ContactState& s)
{
  return with_law(s,
                  []<class Law>() -> std::unique_ptr<PointKernel<D>>
                  { return std::make_unique<LawAtPoint<D, Law>>(); });
}

template std::unique_ptr<PointKernel<2>>
make_point_kernel<2>(const ContactState&);
template std::unique_ptr<PointKernel<3>>
make_point_kernel<3>(const ContactState&);
} // namespace raymortar
