#include "raymortar/element/segment_target.h"
#include "raymortar/geometry/dispatch.h"
#include "raymortar/target/freedom.h"
#include "raymortar/target/in_space.h"

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

template <int D>
MotionColumns<D> master_columns(const Surface& master, const MasterPlace& place,
                                const Mat<D - 1, D>& by_master)
{
  using Shares = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 9, 1>;
  const auto shares = [&master](const Vec<2>& eta) -> Shares
  {
    return shape_taylor<D - 1>(master.shape, master.degree,
                               Vec<D - 1>(eta.template head<D - 1>()))
        .col(0);
  };
  Shares N = shares(place.begin);
  if (place.share != 0.0)
    N = (1.0 - place.share) * N + place.share * shares(place.end);
  MotionColumns<D> columns(D - 1, D * N.size());
  for (Eigen::Index a = 0; a < N.size(); ++a)
    for (int i = 0; i < D; ++i)
      for (int t = 0; t < D - 1; ++t)
        columns(t, a * D + i) = N[a] * by_master(t, i);
  return columns;
}

template <int D>
MotionColumns<D>
SegmentTarget<D>::columns(const AnyVertexMotion<D>& motion) const
{
  if (not _state.has_tools())
    return master_columns<D>(_state.master, motion.place, motion.by_master);
  const MasterPlace& at = motion.place;
  const Vec<D> x =
      (1.0 - at.share) * _facet.at(at.begin) + at.share * _facet.at(at.end);
  MotionColumns<D> moves(D - 1, unknowns());
  for (Index j = 0; j < moves.cols(); ++j)
  {
    const Vec<D - 1> moved = motion.by_master * velocity<D>(*_freedom, j, x);
    for (int t = 0; t < D - 1; ++t)
      moves(t, j) = moved[t];
  }
  return moves;
}

template MotionColumns<2> master_columns<2>(const Surface&, const MasterPlace&,
                                            const Mat<1, 2>&);
template MotionColumns<3> master_columns<3>(const Surface&, const MasterPlace&,
                                            const Mat<2, 3>&);
template class SegmentTarget<2>;
template class SegmentTarget<3>;
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
