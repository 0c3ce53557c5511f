#include "raymortar/element/general_assembler.h"
#include "raymortar/core/error.h"
#include "raymortar/element/free_tools.h"
#include "raymortar/element/law_gaps.h"
#include "raymortar/element/point_kernel.h"
#include "raymortar/element/segment_points.h"
#include "raymortar/element/target.h"
#include "raymortar/geometry/predicates.h"

namespace raymortar
{
namespace
{
using Block = BlockExpansion::Block;

/// @brief Slave facet, fields and multiplier of one element.
template <int D>
class SlaveSide
{
public:
  static constexpr int T = D - 1;

  SlaveSide(const ContactState& s, std::size_t element)
      : _state(s), _facet(s.elements.slave[element]),
        _nodes(s.slave, s.slave.x, _facet),
        _old(s.slave, s.slave.x_old, _facet),
        _reference(s.slave, s.slave.X, _facet), _gamma(field(s.gamma, 1)),
        _offset(field(s.offset, 1)),
        _coefficient(field(s.friction_coefficient, 1)),
        _springs(field(s.traction_old, D))
  {
    if (const Index m = s.master_of(element); m != no_index)
      _gamma *= s.pair_factors.of(s.slave.body_of(_facet), s.master.body_of(m));
    _touch = tolerance::touch * _nodes.diameter();
    gather_multiplier();
  }

  [[nodiscard]] const AnyFacet<D>& reference() const { return _reference; }

  /// @brief Set what is known of a point without its target.
  void place(std::size_t q, GermPoint<D>& at, ElementColumns& columns) const
  {
    const ContactState& s = _state;
    const Vec<2>& xi = s.points.xi[q];
    const Vec<T> here = xi.template head<T>();
    const Basis basis = shape_taylor<T>(s.slave.shape, s.slave.degree, here)
                            .template leftCols<D>();
    const auto shapes =
        shape_taylor<T>(s.slave.shape, s.slave.node_degree, here);
    at.slave = _nodes.nodes * shapes;
    at.gamma = (_gamma * basis).transpose();
    at.offset = (_offset * basis).transpose();
    if (s.moving_segments)
      at.reference = _reference.nodes * shapes;
    if (s.friction)
    {
      at.slave_old = _old.nodes * shapes;
      at.coefficient = (_coefficient * basis).transpose();
      at.traction_old = _springs * basis;
    }
    at.friction = s.friction.value_or(FrictionLaw{});
    at.has_coefficient = not s.friction_coefficient.empty();
    if (not s.friction_bounds.empty())
      at.bound = s.friction_bounds[q];
    at.touch = _touch;
    at.measure = s.measure;
    at.weight = s.points.weight[q];
    at.area = s.points.area[q];
    columns[0].B = basis.transpose();
    columns[0].components = D;
    if (s.multipliers.components > 0)
      place_multiplier(here, at, columns[1]);
  }

private:
  using Basis = Eigen::Matrix<double, Eigen::Dynamic, D, 0, Columns::most, D>;
  using Nodal = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, D,
                              Columns::most>;

  /// Nodal values on the facet, a column per node
  [[nodiscard]] Nodal field(const FacetField& f, int width) const
  {
    const Eigen::Index n = _state.slave.dofs_per_facet();
    if (f.empty())
      return Nodal::Zero(width, n);
    return Eigen::Map<const Nodal>(f.nodal.data() + _facet * n * width, width,
                                   n);
  }

  void gather_multiplier()
  {
    const Multipliers& m = _state.multipliers;
    if (m.components == 0)
      return;
    const Eigen::Index n =
        static_cast<Eigen::Index>(m.facet.size()) / _state.slave.num_facets();
    _lam.resize(m.components, n);
    for (Eigen::Index k = 0; k < n; ++k)
    {
      const Index node = m.facet[static_cast<std::size_t>(_facet * n + k)];
      _lam.col(k) = Eigen::Map<const Eigen::VectorXd>(
          m.value.data() + node * m.components, m.components);
    }
  }

  void place_multiplier(const Vec<T>& xi, GermPoint<D>& at,
                        Columns& columns) const
  {
    const Multipliers& m = _state.multipliers;
    columns.B = shape_taylor<T>(_state.slave.shape, m.degree, xi)
                    .template leftCols<D>()
                    .transpose();
    columns.components = m.components;
    at.lam.topRows(m.components) = _lam * columns.B.transpose();
    at.lam_scale = m.scale;
  }

  const ContactState& _state;
  Index _facet;
  AnyFacet<D> _nodes, _old, _reference;
  Nodal _gamma, _offset, _coefficient, _springs;
  Nodal _lam; ///< nodal tractions, (components, nodes)
  double _touch = 0.0;
};

/// @brief What the motion of segments adds, see MovingSegments.
template <int D>
class SegmentMotion
{
public:
  static constexpr int T = D - 1;
  /// Its sides are straight where those of a facet's plane are
  using Plane = std::conditional_t<D == 2, FacetType<Shape::interval, 1, 1>,
                                   FacetType<Shape::quadrilateral, 1, 1>>;

  /// @brief An element whose points are being added.
  struct Element
  {
    const ContactState& state;
    std::size_t number;
    Eigen::Index alone; ///< unknowns without the master's
    Block& A;
    const CouplingSink& couplings;
    FlatMap<Plane> map;
  };

  /// @param[in] sides Of the point
  void add(const Element& e, std::size_t q, const ElementColumns& sides,
           const PointBlocks<D>& at)
  {
    const Index segment = e.state.points.segment[q];
    if (segment != _segment)
    {
      finish(e);
      take(e, segment);
    }
    Eigen::Matrix<double, Eigen::Dynamic, 1 + T, Eigen::RowMajor> in(
        at.f.rows(), 1 + T),
        out(unknowns_of(sides), 1 + T);
    in << at.f, at.f_xi;
    expand_rows(sides, in.data(), 1 + T, out.data());
    const auto change = change_in_plane<Plane, Eigen::Dynamic>(
        e.map, e.state.points.xi[q].template head<T>(),
        e.state.points.weight[q], out.col(0), out.template rightCols<T>());
    _points.visit(e.state.segment_rules,
                  static_cast<std::size_t>(e.state.points.place[q]),
                  [&](std::size_t v, double N, const Mat<1, T>& dJ) {
                    _by_vertex[v] += N * change.by_y + change.by_measure * dJ;
                  });
  }

  /// @brief Vertices' share, after the last point of an element.
  void finish(const Element& e)
  {
    if (_segment != no_index)
      flush(e,
            e.state.segmentation.segments[static_cast<std::size_t>(_segment)]);
    _segment = no_index;
  }

private:
  using Points = SegmentPoints<Plane>;
  using Sum = Mat<Eigen::Dynamic, T>;

  void take(const Element& e, Index number)
  {
    _segment = number;
    const Segment& segment =
        e.state.segmentation.segments[static_cast<std::size_t>(number)];
    _points.take(e.state.segmentation, segment, e.map);
    for (std::size_t v = 0; v < static_cast<std::size_t>(segment.size); ++v)
      _by_vertex[v].setZero(e.A.rows(), T);
    if (_points.has_centre())
      _by_vertex[Points::centre].setZero(e.A.rows(), T);
  }

  void flush(const Element& e, const Segment& of)
  {
    const ContactState& s = e.state;
    const Index hit = s.elements.master[e.number];
    const bool own = of.master == hit;
    const AnyFacet<D> facet(s.master, s.master.x, of.master);
    const Eigen::Index masters = D * s.master.dofs_per_facet();
    const Eigen::Index size = e.alone + masters;
    if (not own)
    {
      _coupling.setZero(size, size);
      _hit_rows.setZero(masters, masters);
    }
    _points.share_centre(_by_vertex);
    for (std::size_t v = 0; v < static_cast<std::size_t>(of.size); ++v)
    {
      const std::size_t at = static_cast<std::size_t>(of.begin) + v;
      if (s.segmentation.breaks[at].motion == Break::Motion::fixed)
        continue;
      const auto motion = any_vertex_motion<D>(s, of, facet, at);
      const Sum by_xi =
          _by_vertex[v] *
          e.map.gradient(s.segmentation.vertices[at].template head<T>());
      e.A.leftCols(motion.by_slave.cols()) += by_xi * motion.by_slave;
      const Eigen::MatrixXd by_master =
          by_xi * master_columns<D>(s.master, motion.place, motion.by_master);
      if (own)
        e.A.rightCols(masters) += by_master;
      else
      {
        _coupling.topRightCorner(e.alone, masters) +=
            by_master.topRows(e.alone);
        if (hit != no_index)
          _hit_rows += by_master.bottomRows(masters);
      }
    }
    if (not own)
      e.couplings(e.number, of.master, _coupling.data(), static_cast<int>(size),
                  hit == no_index ? nullptr : _hit_rows.data());
  }

  Index _segment = no_index;
  Points _points;
  std::array<Sum, Points::capacity + 1> _by_vertex;
  Block _coupling, _hit_rows;
};

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
    Block sum;
    BlockExpansion expansion;
    PointBlocks<D> blocks;
    SegmentMotion<D> motion;
    for (const std::size_t e : elements)
    {
      const Eigen::Index n = size_of(s, e);
      sum.setZero(n, n);
      const SlaveSide<D> slave(s, e);
      const typename SegmentMotion<D>::Element element{
          s,   e,         alone_of(s),
          sum, couplings, plane_of(s.slave, slave.reference())};
      for_points(s, e, slave,
                 [&](std::size_t q, const GermPoint<D>& at,
                     const ElementColumns& sides)
                 {
                   _kernel->tangent(at, s.moving_segments, blocks);
                   expansion.add(sides, blocks.A, sum);
                   if (const Index k = free_tool_of(s, e); k != no_index)
                     add_turning(freedom_of(s, k), at, sum);
                   if (s.moving_segments)
                     motion.add(element, q, sides, blocks);
                 });
      if (s.moving_segments)
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
                   Block& block) const
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
    Eigen::Map<Vec<D>>(r.x.data() + q * D) = frame.x;
    Eigen::Map<Vec<D>>(r.normal.data() + q * D) = frame.n;
    if (s.hits.status[q] != RayStatus::hit)
      return;
    r.status[q] = found.status;
    r.pressure[q] = found.pressure;
    Eigen::Map<Vec<D>>(r.traction.data() + q * D) = found.traction;
    if (r.slip.empty())
      return;
    Eigen::Map<Vec<D>>(r.slip.data() + q * D) = found.slip;
    Eigen::Map<Vec<D>>(r.friction.data() + q * D) = found.friction;
  }

  std::unique_ptr<PointKernel<D>> _kernel;
};
} // namespace

std::unique_ptr<Assembler> make_general_assembler(const ContactState& s)
{
  if (s.slave.gdim == 2)
    return std::make_unique<GeneralAssembler<2>>(s);
  return std::make_unique<GeneralAssembler<3>>(s);
}
} // namespace raymortar
