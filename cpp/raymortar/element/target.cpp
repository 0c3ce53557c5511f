#include "raymortar/element/target.h"
#include "raymortar/geometry/dispatch.h"

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

template AnyVertexMotion<2> any_vertex_motion<2>(const ContactState&,
                                                 const Segment&,
                                                 const AnyFacet<2>&,
                                                 std::size_t);
template AnyVertexMotion<3> any_vertex_motion<3>(const ContactState&,
                                                 const Segment&,
                                                 const AnyFacet<3>&,
                                                 std::size_t);
} // namespace raymortar
