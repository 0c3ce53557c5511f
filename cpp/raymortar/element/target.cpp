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
/// Tangents of unit length whose normal, as of a facet's, is a given one
template <int D>
Mat<D, D - 1> tangents_across(const Vec<D>& n)
{
  if constexpr (D == 2)
    return Vec<2>(-n[1], n[0]);
  else
  {
    Mat<3, 2> t;
    Eigen::Index least = 0;
    n.cwiseAbs().minCoeff(&least);
    t.col(0) = n.cross(Vec<3>::Unit(least)).normalized();
    t.col(1) = n.cross(t.col(0));
    return t;
  }
}

/// Taylor coefficients of a tool's surface in unit tangents: it bends away from
/// the normal where it is convex
template <int D>
typename Germ<D>::NodeMatrix tool_taylor(const Vec<D>& x, const Vec<D>& n,
                                         const Mat<D, D>& bend)
{
  const Mat<D, D - 1> t = tangents_across<D>(n);
  typename Germ<D>::NodeMatrix c;
  c.col(0) = x;
  c.template middleCols<D - 1>(1) = t;
  const Mat<D - 1, D - 1> k = t.transpose() * bend * t;
  if constexpr (D == 2)
    c.col(2) = -k(0, 0) * n;
  else
  {
    c.col(3) = -k(0, 0) * n;
    c.col(4) = -k(0, 1) * n;
    c.col(5) = -k(1, 1) * n;
  }
  return c;
}

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

/// Motion of position and tangents by the unknowns of a rigid body
/// @param[in] freedom Null: there are none
template <int D>
Columns rigid_columns(const Freedom* freedom,
                      const typename Germ<D>::NodeMatrix& now)
{
  Columns motion;
  motion.B.resize(D * D, freedom ? freedom->size() : 0);
  for (Index j = 0; j < motion.B.cols(); ++j)
  {
    const Mat<D, D> spin =
        freedom->rates[static_cast<std::size_t>(j)].spin.topLeftCorner<D, D>();
    motion.B.col(j).template head<D>() =
        velocity<D>(*freedom, j, Vec<D>(now.col(0)));
    for (int i = 1; i < D; ++i)
      motion.B.col(j).template segment<D>(D * i) = spin * now.col(i);
  }
  return motion;
}

template <int D>
TargetPoint<D> tool_point(const ContactState& s, std::size_t q,
                          const typename Germ<D>::NodeMatrix& slave)
{
  const Frame<D> frame = frame_at<Germ<D>>(slave, Vec<D - 1>::Zero());
  TargetPoint<D> p;
  p.now = tool_taylor<D>(place_of_hit<D>(s, q, frame.x, frame.n),
                         s.hits.normal[q].template head<D>(),
                         s.hits.bend[q].template topLeftCorner<D, D>());
  p.old = tool_of(s, q).turn_back().template topLeftCorner<D, D>() * p.now;
  p.old.col(0) = old_target<D>(s, q, frame.x, frame.n).x;
  p.motion = rigid_columns<D>(freedom_of(tool_of(s, q)), p.now);
  return p;
}
} // namespace

template <int D>
TargetPoint<D> target_point(const ContactState& s, std::size_t q,
                            const typename Germ<D>::NodeMatrix& slave)
{
  return s.has_tools()
             ? tool_point<D>(s, q, slave)
             : facet_point<D>(s.master, s.hits.master[q], s.hits.eta[q]);
}

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

template TargetPoint<2> target_point<2>(const ContactState&, std::size_t,
                                        const Germ<2>::NodeMatrix&);
template TargetPoint<3> target_point<3>(const ContactState&, std::size_t,
                                        const Germ<3>::NodeMatrix&);
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
