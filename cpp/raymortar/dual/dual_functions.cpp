#include "raymortar/dual/dual_functions.h"
#include "raymortar/element/segment_motion.h"
#include "raymortar/element/slave_side.h"
#include "raymortar/geometry/dispatch.h"
#include "raymortar/geometry/facet_mass.h"
#include "raymortar/geometry/predicates.h"
#include "raymortar/nodes/node_tests.h"

namespace raymortar
{
namespace
{
std::size_t at(Index k) { return static_cast<std::size_t>(k); }

/// Products of the multiplier's shape functions over a facet of area 1
NodeMatrix unit_products(const ContactState& s)
{
  if (s.multipliers.degree == 2)
    return unit_mass<Shape::interval, 2>();
  return with_shape(s.slave.shape,
                    []<Shape S>() -> NodeMatrix { return unit_mass<S, 1>(); });
}

/// Inverse of a matrix whose diagonal is large: of products of functions
NodeMatrix inverse_of(NodeMatrix a)
{
  const Eigen::Index n = a.rows();
  for (Eigen::Index p = 0; p < n; ++p)
  {
    const double pivot = 1.0 / a(p, p);
    a(p, p) = 1.0;
    for (Eigen::Index j = 0; j < n; ++j)
      a(p, j) *= pivot;
    for (Eigen::Index i = 0; i < n; ++i)
    {
      const double factor = a(i, p);
      if (i == p or factor == 0.0)
        continue;
      a(i, p) = 0.0;
      for (Eigen::Index j = 0; j < n; ++j)
        a(i, j) -= factor * a(p, j);
    }
  }
  return a;
}

/// Area of the reference facet in its coordinates
double reference_measure(Shape shape)
{
  return with_shape(shape, []<Shape S>() { return Reference<S>::measure; });
}

/// Slave facets at their points, one element after the other
template <int D>
class DualPoints
{
public:
  static constexpr int T = D - 1;

  /// @param[in] tractions With them derivatives along the facet are known
  DualPoints(const ContactState& s, const FacetTractions* tractions)
      : _state(s), _slave(s, Wanted{.along = tractions != nullptr}, tractions)
  {
  }

  /// @return Whether the element's points hit
  bool take(std::size_t e)
  {
    const ContactState& s = _state;
    _slave.take(e, data, shapes);
    shapes.target_nodes = shapes.body_unknowns = 0;
    if (s.elements.master[e] == no_index)
      return false;
    if (not s.has_tools())
      shapes.target_nodes = s.master.dofs_per_facet();
    else if (const Index tool = free_tool_of(s, e); tool != no_index)
      shapes.body_unknowns = static_cast<int>(freedom_of(s, tool).size());
    return true;
  }

  /// Call visit(point) for all points of an element, with data in place
  template <class Visit>
  void visit(std::size_t e, Visit&& visit)
  {
    for (const Index i : _state.elements.points_of(e))
    {
      const std::size_t q = at(i);
      if (_state.points.seed[q] == no_index)
        continue;
      _slave.place(q, data, shapes);
      set_node_tests<T>(shapes.multiplier, shapes.multipliers, tests);
      area = area_of<D>(data.measure, _state.points.weight[q],
                        _state.points.area[q], data.slave_frames.now);
      visit(q);
    }
  }

  [[nodiscard]] double test(int k) const { return tests[at(k)][0]; }

  /// Area per reference coordinates, and how it changes along the facet
  [[nodiscard]] AreaAlong<D> area_here() const
  {
    using F = TaylorFacet<D>;
    const Frame<D>& now = data.slave_frames.now;
    const typename F::RefPoint here = F::RefPoint::Zero();
    const Curvature<D> bend =
        data.slave_bends
            ? curvature_at<F>(data.slave, here, now, dual_tangents<D>(now))
            : no_curvature<D>();
    if (data.slave_bends or moves(data.measure))
      return area_along<F>(data.measure, data.reference, here, now, bend);
    return area_along<D>(data.measure, frame_at<F>(data.reference, here), bend);
  }

  TaylorData<D> data;
  PointShapes<D> shapes;
  ShapeRows<T> tests;
  double area = 0.0;

private:
  const ContactState& _state;
  SlaveSide<D> _slave;
};

/// Adds products of points to facets, of which there are all
template <int D>
void add_products(const ContactState& s, std::vector<DualFacet>& facets)
{
  const double measure = reference_measure(s.slave.shape);
  DualPoints<D> points(s, nullptr);
  for (std::size_t e = 0; e < s.elements.size(); ++e)
  {
    if (not points.take(e))
      continue;
    DualFacet& f = facets[at(s.elements.slave[e])];
    f.varies = points.data.slave_bends or revolves(s.measure);
    const int n = points.shapes.multipliers;
    points.visit(e,
                 [&](std::size_t q)
                 {
                   f.area += points.area;
                   f.share += s.points.weight[q] / measure;
                   for (int a = 0; a < n; ++a)
                   {
                     const double w = points.area * points.test(a);
                     f.weight[a] += w;
                     for (int b = 0; b < n; ++b)
                       f.inverse(a, b) += w * points.test(b);
                   }
                 });
  }
}

/// Rates of one element after the other
template <int D>
class Rates
{
public:
  static constexpr int T = D - 1;

  Rates(const ContactState& s, const DualBasis& basis,
        const std::vector<DualFacet>& facets, const FacetTractions& tractions)
      : _state(s), _basis(basis), _facets(facets), _points(s, &tractions),
        _M(s.multipliers.components)
  {
    if (s.moving_segments)
      _motion = std::make_unique<SegmentMotion<D>>(s);
  }

  [[nodiscard]] std::vector<DualRate> all()
  {
    if (not _motion and not moves(_state.measure))
      return {};
    for (std::size_t e = 0; e < _state.elements.size(); ++e)
      if (_facets[at(_state.elements.slave[e])].varies and _points.take(e))
        add(e);
    return std::move(_found);
  }

private:
  /// Nodal tractions and the coefficients' spread, (nodes, components)
  void take(Index facet)
  {
    if (facet == _number)
      return;
    _number = facet;
    const DualFacet& f = _facets[at(facet)];
    const auto n = static_cast<std::size_t>(f.weight.size());
    const auto nodes = _state.multipliers.nodes_of(facet, n);
    _lam.resize(f.weight.size(), _M);
    for (std::size_t k = 0; k < n; ++k)
      for (int i = 0; i < _M; ++i)
        _lam(static_cast<Eigen::Index>(k), i) =
            _state.multipliers.value[at(nodes[k]) * at(_M) + at(i)];
    _spread = _basis.spread.lazyProduct(f.from_nodal().lazyProduct(_lam));
    _slack = f.slack();
    _by_share = slack_by_share(_state, f);
  }

  void add(std::size_t e)
  {
    take(_state.elements.slave[e]);
    const int size = _points.shapes.size();
    _block.assign(static_cast<std::size_t>(size * size), 0.0);
    const CouplingSink couplings =
        [this](std::size_t element, Index target, const double* block, int n,
               const double*) { keep(element, target, block, n); };
    const typename SegmentMotion<D>::Element element{
        e, _points.shapes.alone(), size, _block.data(), couplings};
    const bool moves_along = _motion and has_moving_vertices(_state, e);
    if (not moves_along and not moves(_state.measure))
      return;
    _points.visit(e,
                  [&](std::size_t q)
                  {
                    set_integrand();
                    if (moves(_state.measure))
                      add_area(size);
                    if (moves_along)
                      _motion->add(element, q, _integrand);
                  });
    if (moves_along)
      _motion->finish(element);
    if (moves_along)
      return keep(e, target_of(_state, e), _block.data(), size);
    keep(e, no_index, _block.data(), size);
    auto& rows = _found.back().rows;
    rows = rows.leftCols(_points.shapes.alone()).eval();
  }

  void keep(std::size_t e, Index target, const double* block, int size)
  {
    const Eigen::Index rows = rows_of(_points.shapes);
    DualRate& rate = _found.emplace_back();
    rate.slave = _state.elements.slave[e];
    rate.target = target;
    rate.rows =
        Eigen::Map<const decltype(rate.rows)>(block, size, size).topRows(rows);
  }

  [[nodiscard]] static int rows_of(const PointShapes<D>& shapes)
  {
    return shapes.multipliers * shapes.components + 1;
  }

  /// B_k (lam_k - lam) per area, with the spread of what is not covered; then
  /// that alone  [theory (4.29)]
  void set_integrand()
  {
    const AreaAlong<D> area = _points.area_here();
    const auto& lam = _points.data.lam;
    const double J = area.jacobian;
    AnyIntegrand<D>& f = _integrand;
    std::fill_n(f.f.begin(), _points.shapes.size(), 0.0);
    for (auto& rate : f.f_xi)
      std::fill_n(rate.begin(), _points.shapes.size(), 0.0);
    const auto last = at(rows_of(_points.shapes) - 1);
    f.f[last] = _by_share - _slack * J;
    for (std::size_t j = 0; j < T; ++j)
      f.f_xi[j][last] = -_slack * J * area.log_jacobian[static_cast<int>(j)];
    std::size_t row = 0;
    for (int k = 0; k < _points.shapes.multipliers; ++k)
      for (int i = 0; i < _M; ++i, ++row)
      {
        const auto& B = _points.tests[at(k)];
        const double rest = _lam(k, i) - lam(i, 0), h = _spread(k, i);
        f.f[row] = J * B[0] * rest + h * f.f[last];
        for (std::size_t j = 0; j < T; ++j)
        {
          const auto c = static_cast<int>(j);
          f.f_xi[j][row] = J * (B[1 + j] * rest - B[0] * lam(i, 1 + c) +
                                B[0] * rest * area.log_jacobian[c]) +
                           h * f.f_xi[j][last];
        }
      }
  }

  /// Add the integrals over an area that changes with the slave
  void add_area(int size)
  {
    const Frame<D>& slave = _points.data.slave_frames.now;
    const Mat<D, T> dual = dual_tangents<D>(slave);
    const int rows = rows_of(_points.shapes);
    for (int b = 0; b < _points.shapes.slave_nodes; ++b)
    {
      Vec<D> by_u = dual * _points.shapes.slave_gradient(b);
      if (revolves(_state.measure))
        by_u[0] += _points.shapes.slave_value(b) / slave.x[0];
      for (int r = 0; r < rows; ++r)
        for (int i = 0; i < D; ++i)
          _block[static_cast<std::size_t>(r * size + D * b + i)] +=
              _points.area * per_area(r) * by_u[i];
    }
  }

  [[nodiscard]] double per_area(int row) const
  {
    const int count = rows_of(_points.shapes) - 1;
    if (row == count)
      return -_slack;
    const int k = row / _M, i = row % _M;
    return _points.test(k) * (_lam(k, i) - _points.data.lam(i, 0)) -
           _slack * _spread(k, i);
  }

  const ContactState& _state;
  const DualBasis& _basis;
  const std::vector<DualFacet>& _facets;
  DualPoints<D> _points;
  int _M;
  std::unique_ptr<SegmentMotion<D>> _motion;
  AnyIntegrand<D> _integrand;
  std::vector<double> _block;
  std::vector<DualRate> _found;
  Index _number = no_index;
  Eigen::MatrixXd _lam, _spread;
  double _slack = 0.0, _by_share = 0.0;
};
} // namespace

DualBasis::DualBasis(const ContactState& s)
{
  const NodeMatrix mass = unit_products(s);
  const Eigen::Index n = mass.rows();
  to_nodes = NodeMatrix::Identity(n, n);
  if (s.multipliers.degree == 2) // Bernstein polynomials at the nodes
    to_nodes.row(2) << 0.25, 0.25, 0.5;
  const NodeMatrix products =
      to_nodes.transpose().lazyProduct(mass.lazyProduct(to_nodes));
  spread = -products;
  spread.diagonal() += products.rowwise().sum();
  rows = Eigen::MatrixXd::Zero(s.slave.dofs_per_facet(), n);
  rows.topRows(n) = inverse_of(to_nodes).transpose();
}

std::vector<DualFacet> dual_facets(const ContactState& s,
                                   const DualBasis& basis)
{
  const Eigen::Index n = basis.spread.rows();
  std::vector<DualFacet> facets(at(s.slave.num_facets()));
  for (DualFacet& f : facets)
  {
    f.inverse = NodeMatrix::Zero(n, n);
    f.weight = Eigen::VectorXd::Zero(n);
  }
  s.slave.gdim == 2 ? add_products<2>(s, facets) : add_products<3>(s, facets);
  for (DualFacet& f : facets)
  {
    f.is_covered = f.area > 0.0;
    if (not f.is_covered)
      continue;
    if (std::abs(1.0 - f.share) > tolerance::coverage)
      f.varies = true;
    const NodeMatrix m = f.inverse + f.slack() * f.area * basis.spread;
    f.inverse = inverse_of(m);
  }
  return facets;
}

double slack_by_share(const ContactState& s, const DualFacet& f)
{
  return 2.0 * (1.0 - f.share) * f.area / reference_measure(s.slave.shape);
}

std::vector<DualRate> dual_rates(const ContactState& s, const DualBasis& basis,
                                 const std::vector<DualFacet>& facets,
                                 const FacetTractions& tractions)
{
  return s.slave.gdim == 2 ? Rates<2>(s, basis, facets, tractions).all()
                           : Rates<3>(s, basis, facets, tractions).all();
}
} // namespace raymortar
