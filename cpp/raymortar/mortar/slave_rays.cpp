#include "raymortar/mortar/slave_rays.h"
#include "raymortar/geometry/dispatch.h"
#include "raymortar/geometry/frame.h"

namespace raymortar
{
namespace
{
template <class F>
class RaysOf final : public SlaveRays<F::gdim>
{
public:
  using Rays = Ray<F::gdim>;

  explicit RaysOf(const Surface& slave) : _slave(slave) {}

  [[nodiscard]] Rays now(Index facet, const Vec<2>& xi) override
  {
    if (facet != _facet)
    {
      _facet = facet;
      _nodes = _slave.template nodes<F>(_slave.x, facet);
      if constexpr (F::affine)
        _n = ray(_nodes, xi).n;
    }
    if constexpr (F::affine)
      return {_nodes * F::Node::values(xi.template head<F::tdim>()), _n};
    else
      return ray(_nodes, xi);
  }

  [[nodiscard]] Rays before(Index facet, const Vec<2>& xi) const override
  {
    return ray(_slave.template nodes<F>(_slave.x_old, facet), xi);
  }

private:
  [[nodiscard]] static Rays ray(const typename F::NodeMatrix& nodes,
                                const Vec<2>& xi)
  {
    const auto frame = frame_at<F>(nodes, xi.template head<F::tdim>());
    return {frame.x, frame.n};
  }

  const Surface& _slave;
  Index _facet = no_index; ///< whose nodes are at hand
  typename F::NodeMatrix _nodes;
  typename F::Point _n; ///< of all its points, if the facet is flat
};
} // namespace

template <int D>
std::unique_ptr<SlaveRays<D>> make_slave_rays(const Surface& slave)
{
  return with_geometry_in<D>(slave,
                             [&]<class F>(F) -> std::unique_ptr<SlaveRays<D>>
                             { return std::make_unique<RaysOf<F>>(slave); });
}

template std::unique_ptr<SlaveRays<2>> make_slave_rays<2>(const Surface&);
template std::unique_ptr<SlaveRays<3>> make_slave_rays<3>(const Surface&);
} // namespace raymortar
