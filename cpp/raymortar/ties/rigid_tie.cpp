#include "raymortar/ties/rigid_tie.h"
#include "raymortar/core/error.h"
#include "raymortar/element/free_tools.h"
#include "raymortar/ties/tie_point.h"

namespace raymortar
{
namespace
{
/// @brief What a point that follows a body keeps of the undeformed slave.
template <int D>
struct FollowingPoint
{
  double weight;        ///< area that it stands for
  double gamma;         ///< coefficient of a penalty, traction per length
  Eigen::VectorXd N;    ///< shape functions of the displacement
  Eigen::VectorXd test; ///< those of the multiplier
  Vec<D> X;             ///< undeformed position. Length

  FollowingPoint(const ContactState& s, std::size_t q)
  {
    constexpr int T = D - 1;
    const Surface& slave = s.slave;
    const Index facet = s.points.slave[q];
    const auto xi = Vec<T>(s.points.xi[q].template head<T>());
    N = shape_taylor<T>(slave.shape, slave.degree, xi).col(0);
    if (s.multipliers.components > 0)
      test = shape_taylor<T>(slave.shape, s.multipliers.degree, xi).col(0);
    const AnyFacet<D> undeformed(slave, slave.X, facet);
    X = undeformed.nodes *
        shape_taylor<T>(slave.shape, slave.node_degree, xi).col(0);
    weight = s.points.area[q];
    const Eigen::Map<const Eigen::VectorXd> nodal(
        s.gamma.nodal.data() + static_cast<Eigen::Index>(facet) * N.size(),
        N.size());
    gamma = nodal.dot(N);
  }
};

/// @brief Nodal values of an element, and its block [slave u | multiplier |
/// body].
template <int D>
class FollowingElement
{
public:
  using Block =
      Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  explicit FollowingElement(const ContactState& s)
      : _state(s), _dofs(s.slave.dofs_per_facet()), _scale(s.multipliers.scale),
        _u(D, _dofs)
  {
    const Multipliers& m = s.multipliers;
    if (m.components > 0 and s.slave.num_facets() > 0)
      _tests = static_cast<Eigen::Index>(m.facet.size()) / s.slave.num_facets();
    _lam.resize(D, _tests);
  }

  void take(std::size_t e)
  {
    const auto tool = static_cast<std::size_t>(_state.elements.master[e]);
    _body = &_state.tools[tool];
    _freedom = freedom_of(*_body);
    _own = D * (_dofs + _tests);
    _size = _own + (_freedom ? _freedom->size() : 0);
    const Index facet = _state.elements.slave[e];
    const Surface& slave = _state.slave;
    for (Eigen::Index a = 0; a < _dofs; ++a)
    {
      const auto at = static_cast<std::size_t>(
          D * slave.facet_nodes[static_cast<std::size_t>(
                  facet * slave.nodes_per_facet() + a)]);
      _u.col(a) = Eigen::Map<const Vec<D>>(slave.x.data() + at) -
                  Eigen::Map<const Vec<D>>(slave.X.data() + at);
    }
    const Multipliers& m = _state.multipliers;
    for (Eigen::Index k = 0; k < _tests; ++k)
      _lam.col(k) = Eigen::Map<const Vec<D>>(
          m.value.data() +
          D * m.facet[static_cast<std::size_t>(facet * _tests + k)]);
  }

  [[nodiscard]] int size() const { return static_cast<int>(_size); }
  const double* residual(std::span<const FollowingPoint<D>> points)
  {
    _b.setZero(_size);
    for (const auto& p : points)
    {
      const Vec<D> c = opening(p);
      _b += p.weight * variation(p).transpose() * traction(p, c);
      for (Eigen::Index k = 0; k < _tests; ++k)
        _b.template segment<D>(row_of(k)) += _scale * p.weight * p.test[k] * c;
    }
    return _b.data();
  }

  const double* tangent(std::span<const FollowingPoint<D>> points)
  {
    _A.setZero(_size, _size);
    for (const auto& p : points)
    {
      const Variation dc = variation(p);
      if (_tests == 0)
        _A += p.weight * p.gamma * dc.transpose() * dc;
      for (Eigen::Index k = 0; k < _tests; ++k)
      {
        const Variation row = _scale * p.weight * p.test[k] * dc;
        _A.middleRows(row_of(k), D) += row;
        _A.middleCols(row_of(k), D) += row.transpose();
      }
      add_bends(p);
    }
    return _A.data();
  }

  /// @brief Where the body takes a point. Length
  [[nodiscard]] Vec<D> place(const FollowingPoint<D>& p) const
  {
    return p.X + motion(p);
  }

  /// @brief Motion of the body's point less that of the slave's. Length
  [[nodiscard]] Vec<D> opening(const FollowingPoint<D>& p) const
  {
    return motion(p) - _u * p.N;
  }

  /// @brief What acts on the slave.
  [[nodiscard]] Vec<D> traction(const FollowingPoint<D>& p,
                                const Vec<D>& c) const
  {
    return _tests > 0 ? Vec<D>(_lam * p.test) : Vec<D>(p.gamma * c);
  }

private:
  using Variation = Eigen::Matrix<double, D, Eigen::Dynamic>;

  [[nodiscard]] Eigen::Index row_of(Eigen::Index test) const
  {
    return D * (_dofs + test);
  }

  /// In displacements: of bodies that rest it is zero, not a rounding error
  [[nodiscard]] Vec<D> motion(const FollowingPoint<D>& p) const
  {
    const Mat<D, D> R = _body->now.rotation.template topLeftCorner<D, D>();
    return (R - Mat<D, D>::Identity()) * p.X +
           _body->now.shift.template head<D>();
  }

  /// Derivative of the opening by all unknowns; of multipliers zero
  [[nodiscard]] Variation variation(const FollowingPoint<D>& p) const
  {
    Variation dc = Variation::Zero(D, _size);
    for (Eigen::Index a = 0; a < _dofs; ++a)
      dc.template middleCols<D>(D * a) = -p.N[a] * Mat<D, D>::Identity();
    const Vec<D> x = place(p);
    for (Eigen::Index j = _own; j < _size; ++j)
      dc.col(j) = velocity<D>(*_freedom, static_cast<Index>(j - _own), x);
    return dc;
  }

  /// Traction times the second derivative of the body's points
  void add_bends(const FollowingPoint<D>& p)
  {
    if (not _freedom)
      return;
    const Vec<D> t = p.weight * traction(p, opening(p));
    const Vec<D> arm = place(p) - _freedom->centre.template head<D>();
    for (Index j = 0; j < _freedom->size(); ++j)
      for (Index k = 0; k < _freedom->size(); ++k)
        _A(_own + j, _own + k) +=
            t.dot(_freedom->bend(j, k).template topLeftCorner<D, D>() * arm);
  }

  const ContactState& _state;
  Eigen::Index _dofs, _tests = 0, _own = 0, _size = 0;
  double _scale; ///< traction per unit of the multiplier's unknown
  Eigen::Matrix<double, D, Eigen::Dynamic> _u, _lam;
  const PlacedTool* _body = nullptr;
  const Freedom* _freedom = nullptr; ///< null: the body is led
  Eigen::VectorXd _b;
  Block _A;
};

template <int D>
class RigidKernel final : public TieKernel
{
public:
  void set_up(const ContactState& s) override
  {
    _points.assign(s.elements.size(), {});
    for (std::size_t e = 0; e < s.elements.size(); ++e)
      if (s.elements.master[e] != no_index)
        for (const Index q : s.elements.points_of(e))
          _points[e].emplace_back(s, static_cast<std::size_t>(q));
  }

  [[nodiscard]] std::size_t turning_elements() const override { return 0; }

  void residual(const ContactState& s, const BlockSink& sink) const override
  {
    FollowingElement<D> at(s);
    for (std::size_t e = 0; e < _points.size(); ++e)
      if (not _points[e].empty())
      {
        at.take(e);
        sink(e, at.residual(_points[e]), at.size());
      }
  }

  void tangent(const ContactState& s, std::span<const std::size_t> elements,
               const BlockSink& sink, const CouplingSink&) const override
  {
    FollowingElement<D> at(s);
    for (const std::size_t e : elements)
      if (not _points[e].empty())
      {
        at.take(e);
        sink(e, at.tangent(_points[e]), at.size());
      }
  }

  [[nodiscard]] PointResults results(const ContactState& s) const override;

private:
  std::vector<std::vector<FollowingPoint<D>>> _points; ///< of each element
};

/// Tractions act where the body takes the points
template <int D>
PointResults RigidKernel<D>::results(const ContactState& s) const
{
  PointResults r = tied_nowhere<D>(s);
  FollowingElement<D> at(s);
  for (std::size_t e = 0; e < _points.size(); ++e)
  {
    if (_points[e].empty())
      continue;
    at.take(e);
    std::size_t number = 0;
    for (const Index of : s.elements.points_of(e))
    {
      const auto q = static_cast<std::size_t>(of);
      const FollowingPoint<D>& p = _points[e][number++];
      const Vec<D> n = Eigen::Map<const Vec<D>>(r.normal.data() + D * q);
      const Vec<D> c = at.opening(p), t = at.traction(p, c);
      r.status[q] = ContactStatus::stick;
      r.gap[q] = c.dot(n);
      r.pressure[q] = t.dot(n);
      r.gamma[q] = p.gamma;
      put_at<D>(r.x, q, at.place(p));
      put_at<D>(r.traction, q, t);
      put_at<D>(r.slip, q, c - r.gap[q] * n);
      put_at<D>(r.friction, q, t - r.pressure[q] * n);
    }
  }
  return r;
}
} // namespace

std::unique_ptr<TieKernel> make_rigid_tie_kernel(int gdim)
{
  if (gdim == 2)
    return std::make_unique<RigidKernel<2>>();
  if (gdim == 3)
    return std::make_unique<RigidKernel<3>>();
  throw Error("ties are in 2D or 3D, not in " + std::to_string(gdim) + "D");
}
} // namespace raymortar
