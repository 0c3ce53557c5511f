#include "raymortar/element/general_assembler.h"
#include "raymortar/core/error.h"
#include "raymortar/element/free_tools.h"
#include "raymortar/element/law_gaps.h"
#include "raymortar/element/point_kernel.h"
#include "raymortar/element/segment_motion.h"
#include "raymortar/element/slave_side.h"
#include "raymortar/element/target.h"

namespace raymortar
{
namespace
{
template <int D>
class GeneralAssembler final : public Assembler
{
public:
  explicit GeneralAssembler(const ContactState& s)
      : _kernel(make_point_kernel<D>(s))
  {
  }

  void residual(const ContactState& s, const BlockSink& sink) const override
  {
    Eigen::VectorXd sum, point;
    PointBlocks<D> blocks;
    for (std::size_t e = 0; e < s.elements.size(); ++e)
    {
      sum.setZero(size_of(s, e));
      for_points(
          s, e, SlaveSide<D>(s, e),
          [&](std::size_t, const GermPoint<D>& at, const ElementColumns& sides)
          {
            _kernel->residual(at, blocks);
            point.resize(sum.size());
            expand_rows(sides, blocks.b.data(), 1, point.data());
            sum += point;
          });
      sink(e, sum.data(), static_cast<int>(sum.size()));
    }
  }

  void tangent(const ContactState& s, std::span<const std::size_t> elements,
               const BlockSink& sink,
               const CouplingSink& couplings) const override
  {
    BlockExpansion::Block sum;
    BlockExpansion expansion;
    PointBlocks<D> blocks;
    SegmentMotion<D> motion;
    for (const std::size_t e : elements)
    {
      const Eigen::Index n = size_of(s, e);
      const bool cut = s.moving_segments and has_moving_vertices(s, e);
      sum.setZero(n, n);
      const SlaveSide<D> slave(s, e);
      const typename SegmentMotion<D>::Element element{
          s,   e,         alone_of(s),
          sum, couplings, plane_of(s.slave, slave.reference())};
      for_points(s, e, slave,
                 [&](std::size_t q, const GermPoint<D>& at,
                     const ElementColumns& sides)
                 {
                   _kernel->tangent(at, cut, blocks);
                   expansion.add(sides, blocks.A, sum);
                   if (const Index k = free_tool_of(s, e); k != no_index)
                     add_turning(freedom_of(s, k), at, sum);
                   if (cut)
                     motion.add(element, q, sides, blocks);
                 });
      if (cut)
        motion.finish(element);
      sink(e, sum.data(), static_cast<int>(n));
    }
  }

  [[nodiscard]] PointResults results(const ContactState& s) const override
  {
    PointResults r = results_without_hits(s);
    for (std::size_t e = 0; e < s.elements.size(); ++e)
    {
      const SlaveSide<D> slave(s, e);
      for (const Index q : s.elements.points_of(e))
        store(s, e, static_cast<std::size_t>(q), slave, r);
    }
    return r;
  }

private:
  using Plane = typename SegmentMotion<D>::Plane;

  /// The plane that sides of segments are straight in: of quadrilaterals their
  /// mean plane, of others the reference facet
  [[nodiscard]] static FlatMap<Plane> plane_of(const Surface& slave,
                                               const AnyFacet<D>& reference)
  {
    typename Plane::NodeMatrix corners = Plane::NodeMatrix::Zero();
    for (int c = 0; c < Plane::nodes; ++c)
      for (int i = 0; i < Plane::tdim; ++i)
        corners(i, c) = Plane::Node::points[static_cast<std::size_t>(c)]
                                           [static_cast<std::size_t>(i)];
    if (slave.shape == Shape::quadrilateral)
      corners = reference.nodes.template leftCols<Plane::nodes>();
    return FlatMap<Plane>(corners);
  }

  /// Unknowns of an element without master
  [[nodiscard]] static Eigen::Index alone_of(const ContactState& s)
  {
    const Multipliers& m = s.multipliers;
    Eigen::Index n = D * s.slave.dofs_per_facet();
    if (m.components > 0)
      n += m.components *
           (static_cast<Eigen::Index>(m.facet.size()) / s.slave.num_facets());
    return n;
  }

  [[nodiscard]] static Eigen::Index size_of(const ContactState& s,
                                            std::size_t e)
  {
    const bool moves = s.master_of(e) != no_index;
    const Index tool = free_tool_of(s, e);
    return alone_of(s) + (moves ? D * s.master.dofs_per_facet() : 0) +
           (tool == no_index ? 0 : freedom_of(s, tool).size());
  }

  /// Add that points of a body that turns move in circles: the force at the
  /// point times the second derivatives of its place
  void add_turning(const Freedom& freedom, const GermPoint<D>& at,
                   BlockExpansion::Block& block) const
  {
    PointBlocks<D> blocks;
    _kernel->residual(at, blocks);
    const Vec<D> force =
        blocks.b.template segment<D>(blocks.b.size() - PointBlocks<D>::side);
    const Vec<D> arm = at.master.col(0) - freedom.centre.template head<D>();
    const Index n = freedom.size();
    for (Index j = 0; j < n; ++j)
      for (Index k = 0; k < n; ++k)
        block(block.rows() - n + j, block.cols() - n + k) +=
            force.dot(freedom.bend(j, k).template topLeftCorner<D, D>() * arm);
  }

  /// Set what is known at a point
  void place(const ContactState& s, std::size_t e, std::size_t q,
             const SlaveSide<D>& slave, GermPoint<D>& at,
             ElementColumns& sides) const
  {
    const Index m = s.elements.master[e];
    slave.place(q, at, sides);
    at.is_hit = m != no_index;
    at.gap = s.hits.gap[q];
    if (not at.is_hit)
      return;
    TargetPoint<D> target = target_point<D>(s, q, at.slave);
    at.master = target.now;
    at.master_old = target.old;
    at.frame_of_target = s.has_frame_of_target(q);
    sides[2] = std::move(target.motion);
  }

  /// Call visit(point, GermPoint, columns) where there is something to
  /// integrate
  template <class Visit>
  void for_points(const ContactState& s, std::size_t e,
                  const SlaveSide<D>& slave, Visit&& visit) const
  {
    GermPoint<D> at;
    ElementColumns sides;
    for (const Index i : s.elements.points_of(e))
    {
      const auto q = static_cast<std::size_t>(i);
      if (s.points.seed[q] == no_index)
        continue;
      place(s, e, q, slave, at, sides);
      visit(q, at, sides);
    }
  }

  void store(const ContactState& s, std::size_t e, std::size_t q,
             const SlaveSide<D>& slave, PointResults& r) const
  {
    GermPoint<D> at;
    ElementColumns sides;
    place(s, e, q, slave, at, sides);
    const PointResult<D> found = _kernel->result(at);
    const Frame<D> frame = frame_at<Germ<D>>(at.slave, Vec<D - 1>::Zero());
    r.weight[q] = found.weight;
    r.gamma[q] = found.gamma;
    Eigen::Map<Vec<D>>(r.x.data() + q * D) = frame.x;
    Eigen::Map<Vec<D>>(r.normal.data() + q * D) = frame.n;
    Eigen::Map<Vec<D>>(r.contact_normal.data() + q * D) = frame.n;
    if (s.hits.status[q] != RayStatus::hit)
      return;
    Eigen::Map<Vec<D>>(r.contact_normal.data() + q * D) = found.normal;
    Eigen::Map<Vec<D>>(r.master_normal.data() + q * D) =
        frame_at<Germ<D>>(at.master, Vec<D - 1>::Zero()).n;
    r.status[q] = found.status;
    r.pressure[q] = found.pressure;
    Eigen::Map<Vec<D>>(r.traction.data() + q * D) = found.traction;
    if (r.slip.empty())
      return;
    Eigen::Map<Vec<D>>(r.slip.data() + q * D) = found.slip;
    r.closing[q] = found.closing;
    Eigen::Map<Vec<D>>(r.friction.data() + q * D) = found.friction;
  }

  std::unique_ptr<PointKernel<D>> _kernel;
};
} // namespace

std::vector<double> slips_without_friction(ContactState s)
{
  s.friction = Coulomb{};
  s.method = Method::penalty;
  s.multipliers = {};
  return make_general_assembler(s)->results(s).slip;
}

std::unique_ptr<Assembler> make_general_assembler(const ContactState& s)
{
  if (s.slave.gdim == 2)
    return std::make_unique<GeneralAssembler<2>>(s);
  return std::make_unique<GeneralAssembler<3>>(s);
}
} // namespace raymortar
