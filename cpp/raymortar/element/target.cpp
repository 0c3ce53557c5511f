#include "raymortar/element/target.h"
#include "raymortar/geometry/dispatch.h"
#include "raymortar/rigid/freedom.h"
#include "raymortar/rigid/in_space.h"

namespace raymortar
{
template <int D>
AnyVertexMotion<D> any_vertex_motion(const ContactState& s, const Segment& of,
                                     const AnyFacet<D>& master,
                                     std::size_t vertex)
{
  return with_facet_type(
      s.slave,
      [&]<class F>(F) -> AnyVertexMotion<D>
      {
        if constexpr (F::gdim == D)
        {
          const auto slave = s.slave.template nodes<F>(s.slave.x, of.slave);
          const VertexMotion<F> motion = segment_vertex_motion<F>(
              s.segmentation, of, slave, master, vertex);
          return {motion.by_slave, motion.by_master, motion.place};
        }
        else
          throw Error("facets of another dimension");
      });
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
  const Frame<D> frame = frame_at<TaylorFacet<D>>(taylor, Vec<D - 1>::Zero());
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
