#include "raymortar/element/target.h"
#include "raymortar/geometry/dispatch.h"
#include "raymortar/rigid/freedom.h"
#include "raymortar/rigid/in_space.h"

namespace raymortar
{
namespace
{
/// On the true facets, of any kind: what the vertex sees of the slave is its
/// Taylor polynomial there
template <int D>
AnyVertexMotion<D> motion_on_facets(const ContactState& s, Index facet,
                                    const AnyFacet<D>& master, const Vec<2>& xi,
                                    const Break& hangs_on)
{
  constexpr int T = D - 1;
  using G = Germ<D>;
  const VertexMotion<G> by =
      vertex_motion<G>(AnyFacet<D>(s.slave, s.slave.x, facet).taylor(xi),
                       master, Vec<T>::Zero(), hangs_on);
  const ShapeTaylor<T> N = shape_taylor<T>(s.slave.shape, s.slave.degree,
                                           Vec<T>(xi.template head<T>()));
  AnyVertexMotion<D> motion{MotionColumns<D>(T, D * N.rows()), by.by_master,
                            by.place};
  for (Eigen::Index a = 0; a < N.rows(); ++a)
  {
    Mat<T, D> sum = Mat<T, D>::Zero();
    for (int k = 0; k < D; ++k)
      sum += N(a, k) * by.by_slave.template middleCols<D>(D * k);
    motion.by_slave.template middleCols<D>(D * a) = sum;
  }
  return motion;
}

/// On the flat patches through corners
template <int D>
AnyVertexMotion<D> motion_on_patches(const ContactState& s, const Segment& of,
                                     const AnyFacet<D>& master,
                                     const Vec<2>& xi, const Break& hangs_on)
{
  return with_facet_type(
      s.slave,
      [&]<class F>(F) -> AnyVertexMotion<D>
      {
        if constexpr (F::gdim == D)
        {
          const Patch& patch = patches<F>(
              s.segmentation
                  .subdivided)[static_cast<std::size_t>(of.slave_patch)];
          const FlatPatch<F> flat(
              s.slave.template nodes<F>(s.slave.x, of.slave), patch);
          const VertexMotion<F> motion = flat_motion<F>(
              flat, master, xi.template head<F::tdim>(), hangs_on);
          return {motion.by_slave, motion.by_master, motion.place};
        }
        else
          throw Error("facets of another dimension");
      });
}
} // namespace

template <int D>
AnyVertexMotion<D> any_vertex_motion(const ContactState& s, const Segment& of,
                                     const AnyFacet<D>& master,
                                     std::size_t vertex)
{
  const Break& hangs_on = s.segmentation.breaks[vertex];
  const Vec<2>& xi = s.segmentation.vertices[vertex];
  if (hangs_on.is_flat())
    return motion_on_patches<D>(s, of, master, xi, hangs_on);
  return motion_on_facets<D>(s, of.slave, master, xi, hangs_on);
}

namespace
{
/// @param[in] x, n Position and normal of the slave
template <int D>
Vec<D> place_of_hit(const ContactState& s, std::size_t q, const Vec<D>& x,
                    const Vec<D>& n)
{
  return x + s.hits.gap[q] * n;
}

const PlacedTool& tool_of(const ContactState& s, std::size_t q)
{
  return s.tools[static_cast<std::size_t>(s.hits.master[q])];
}
} // namespace

template <int D>
OldTarget<D> old_target(const ContactState& s, std::size_t q, const Vec<D>& x,
                        const Vec<D>& n)
{
  if (s.has_tools())
  {
    const PlacedTool& tool = tool_of(s, q);
    const Vec<3> place = in_space<D>(place_of_hit<D>(s, q, x, n));
    return {tool.old_place(place).template head<D>(),
            (tool.turn_back() * s.hits.normal[q]).template head<D>()};
  }
  const auto taylor = AnyFacet<D>(s.master, s.master.x_old, s.hits.master[q])
                          .taylor(s.hits.eta[q]);
  const Frame<D> frame = frame_at<Germ<D>>(taylor, Vec<D - 1>::Zero());
  return {frame.x, frame.n};
}

template OldTarget<2> old_target<2>(const ContactState&, std::size_t,
                                    const Vec<2>&, const Vec<2>&);
template OldTarget<3> old_target<3>(const ContactState&, std::size_t,
                                    const Vec<3>&, const Vec<3>&);
template AnyVertexMotion<2> any_vertex_motion<2>(const ContactState&,
                                                 const Segment&,
                                                 const AnyFacet<2>&,
                                                 std::size_t);
template AnyVertexMotion<3> any_vertex_motion<3>(const ContactState&,
                                                 const Segment&,
                                                 const AnyFacet<3>&,
                                                 std::size_t);
} // namespace raymortar
