#include "raymortar/ties/tie.h"
#include "raymortar/core/error.h"
#include "raymortar/element/turning.h"
#include "raymortar/ties/tie_point.h"
#include <algorithm>
#include <numeric>

namespace raymortar
{
namespace
{
using Block =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// @brief What an element keeps. Every entry stands for all components alike.
template <int D>
struct TieElement
{
  Index slave = no_index;
  Index master = no_index;
  /// Of points that do not turn, over the displacements' dofs: with a
  /// multiplier of its test functions, (tests, dofs), with a penalty of the
  /// displacements', (dofs, dofs)
  Eigen::MatrixXd J;
  Eigen::MatrixXd closing; ///< the same with gaps that close, (rows, gdim)
  std::vector<TiePoint<D>> turning;
};

template <int D>
class Kernel final : public TieKernel
{
public:
  explicit Kernel(TieGap gap) : _gap(gap) {}

  void set_up(const ContactState& s) override
  {
    _elements.assign(s.elements.size(), {});
    for (std::size_t e = 0; e < s.elements.size(); ++e)
      if (s.elements.master[e] != no_index)
        set_up_element(s, e);
  }

  [[nodiscard]] std::size_t turning_elements() const override
  {
    return static_cast<std::size_t>(
        std::count_if(_elements.begin(), _elements.end(),
                      [](const auto& e) { return not e.turning.empty(); }));
  }

  void residual(const ContactState& s, const BlockSink& sink) const override
  {
    Nodal at(s);
    for (std::size_t e = 0; e < _elements.size(); ++e)
      if (_elements[e].master != no_index)
      {
        at.gather(_elements[e]);
        at.b.setZero(at.size);
        add_residual(s, _elements[e], at);
        sink(e, at.b.data(), static_cast<int>(at.size));
      }
  }

  void tangent(const ContactState& s, std::span<const std::size_t> elements,
               const BlockSink& sink, const CouplingSink&) const override
  {
    Nodal at(s);
    for (const std::size_t e : elements)
      if (_elements[e].master != no_index)
      {
        at.gather(_elements[e]);
        at.A.setZero(at.size, at.size);
        add_tangent(s, _elements[e], at);
        sink(e, at.A.data(), static_cast<int>(at.size));
      }
  }

  [[nodiscard]] PointResults results(const ContactState& s) const override;

private:
  /// Unknowns of an element, [slave u | multiplier | master u], and its nodal
  /// values; one for all elements, so that nothing is allocated for each
  struct Nodal
  {
    explicit Nodal(const ContactState& s)
        : slave(s.slave.dofs_per_facet()), master(s.master.dofs_per_facet()),
          u(D, slave + master), scale(s.multipliers.scale), _state(s),
          _slave_nodes(s.slave.nodes_per_facet()),
          _master_nodes(s.master.nodes_per_facet())
    {
      const Multipliers& m = s.multipliers;
      if (m.components > 0 and s.slave.num_facets() > 0)
        tests =
            static_cast<Eigen::Index>(m.facet.size()) / s.slave.num_facets();
      lam.resize(D, tests);
      size = D * (slave + tests + master);
    }

    void gather(const TieElement<D>& e)
    {
      displacements(_state.slave, e.slave, _slave_nodes, slave, 0);
      displacements(_state.master, e.master, _master_nodes, master, slave);
      const Multipliers& m = _state.multipliers;
      for (Eigen::Index k = 0; k < tests; ++k)
        lam.col(k) = Eigen::Map<const Vec<D>>(
            m.value.data() +
            D * m.facet[static_cast<std::size_t>(e.slave * tests + k)]);
    }

    /// First unknown of a dof, slave's before master's
    [[nodiscard]] Eigen::Index of_dof(Eigen::Index a) const
    {
      return D * (a < slave ? a : a + tests);
    }
    [[nodiscard]] Eigen::Index of_test(Eigen::Index k) const
    {
      return D * (slave + k);
    }

    Eigen::Index slave, master, tests = 0, size = 0;
    TieDisplacements<D> u;
    Eigen::Matrix<double, D, Eigen::Dynamic, 0, D, 9> lam; ///< tractions
    double scale; ///< traction per unit of the multiplier's unknown
    Eigen::VectorXd b;
    Block A;

  private:
    /// A facet's dofs are its first nodes
    void displacements(const Surface& surface, Index facet, int nodes,
                       Eigen::Index dofs, Eigen::Index first)
    {
      for (Eigen::Index a = 0; a < dofs; ++a)
      {
        const auto at = static_cast<std::size_t>(
            D *
            surface.facet_nodes[static_cast<std::size_t>(facet * nodes + a)]);
        u.col(first + a) = Eigen::Map<const Vec<D>>(surface.x.data() + at) -
                           Eigen::Map<const Vec<D>>(surface.X.data() + at);
      }
    }

    const ContactState& _state;
    int _slave_nodes, _master_nodes;
  };

  [[nodiscard]] bool turns(const TiePoint<D>& p) const
  {
    return _gap == TieGap::keep and p.gap != 0.0;
  }

  void set_up_element(const ContactState& s, std::size_t number)
  {
    TieElement<D>& e = _elements[number];
    e.slave = s.elements.slave[number];
    e.master = s.elements.master[number];
    const Nodal sizes(s);
    const Eigen::Index dofs = sizes.slave + sizes.master;
    const Eigen::Index rows = sizes.tests > 0 ? sizes.tests : dofs;
    e.J.setZero(rows, dofs);
    e.closing.setZero(rows, D);
    for (const Index q : s.elements.points_of(number))
    {
      TiePoint<D> p(s, static_cast<std::size_t>(q), e.master);
      if (turns(p))
      {
        e.turning.push_back(std::move(p));
        continue;
      }
      const Eigen::VectorXd row =
          sizes.tests > 0 ? Eigen::VectorXd(p.weight * p.test)
                          : Eigen::VectorXd(p.weight * p.gamma * p.across);
      e.J += row * p.across.transpose();
      e.closing += row * (p.gap * p.n0).transpose();
    }
  }

  /// Traction on the slave
  [[nodiscard]] Vec<D> traction(const TiePoint<D>& p, const Nodal& at,
                                const Vec<D>& c) const
  {
    return at.tests > 0 ? Vec<D>(at.lam * p.test) : Vec<D>(p.gamma * c);
  }

  void add_residual(const ContactState& s, const TieElement<D>& e,
                    Nodal& at) const
  {
    Forces open = e.closing.transpose();
    open.noalias() += at.u.lazyProduct(e.J.transpose());
    if (at.tests == 0)
      add_to_dofs(open, at);
    else
    {
      add_to_dofs(at.lam.lazyProduct(e.J), at);
      for (Eigen::Index k = 0; k < at.tests; ++k)
        at.b.template segment<D>(at.of_test(k)) += at.scale * open.col(k);
    }
    if (e.turning.empty())
      return;
    const AnyFacet<D> slave(s.slave, s.slave.x, e.slave);
    for (const TiePoint<D>& p : e.turning)
      add_turning_residual(p, TieOpening<D>(p, slave, at.u, true), at);
  }

  /// A column for each dof, or for each test function
  using Forces = Eigen::Matrix<double, D, Eigen::Dynamic, 0, D, 18>;

  static void add_to_dofs(const Forces& forces, Nodal& at)
  {
    for (Eigen::Index a = 0; a < forces.cols(); ++a)
      at.b.template segment<D>(at.of_dof(a)) += forces.col(a);
  }

  void add_turning_residual(const TiePoint<D>& p, const TieOpening<D>& open,
                            Nodal& at) const
  {
    const Vec<D> t = p.weight * traction(p, at, open.c);
    for (Eigen::Index a = 0; a < p.across.size(); ++a)
      at.b.template segment<D>(at.of_dof(a)) += p.across[a] * t;
    add_turning<D>(open.G, open.n, p.gap * t, at.b);
    for (Eigen::Index k = 0; k < at.tests; ++k)
      at.b.template segment<D>(at.of_test(k)) +=
          (at.scale * p.weight * p.test[k]) * open.c;
  }

  void add_tangent(const ContactState& s, const TieElement<D>& e,
                   Nodal& at) const
  {
    for (Eigen::Index k = 0; k < e.J.rows(); ++k)
      for (Eigen::Index a = 0; a < e.J.cols(); ++a)
        if (at.tests == 0)
          diagonal(at.A, at.of_dof(k), at.of_dof(a)) += e.J(k, a);
        else
        {
          diagonal(at.A, at.of_test(k), at.of_dof(a)) += at.scale * e.J(k, a);
          diagonal(at.A, at.of_dof(a), at.of_test(k)) += at.scale * e.J(k, a);
        }
    if (e.turning.empty())
      return;
    const AnyFacet<D> slave(s.slave, s.slave.x, e.slave);
    for (const TiePoint<D>& p : e.turning)
      add_turning_tangent(p, TieOpening<D>(p, slave, at.u, true), at);
  }

  /// Diagonal of the block of two nodes
  static auto diagonal(Block& A, Eigen::Index row, Eigen::Index column)
  {
    return A.template block<D, D>(row, column).diagonal().array();
  }

  void add_turning_tangent(const TiePoint<D>& p, const TieOpening<D>& open,
                           Nodal& at) const
  {
    const Eigen::Index dofs = p.across.size();
    // dc over the dofs
    Eigen::Matrix<double, D, Eigen::Dynamic> dc(D, D * dofs);
    for (Eigen::Index a = 0; a < dofs; ++a)
      dc.template middleCols<D>(D * a) = p.across[a] * Mat<D, D>::Identity();
    for (Eigen::Index a = 0; a < at.slave; ++a)
      dc.template middleCols<D>(D * a) +=
          p.gap * open.G.col(a) * open.n.transpose();
    for (Eigen::Index a = 0; a < dofs; ++a)
    {
      const Mat<D, D> B = dc.template middleCols<D>(D * a);
      for (Eigen::Index k = 0; k < at.tests; ++k)
      {
        const Mat<D, D> row = (at.scale * p.weight * p.test[k]) * B;
        at.A.template block<D, D>(at.of_test(k), at.of_dof(a)) += row;
        at.A.template block<D, D>(at.of_dof(a), at.of_test(k)) +=
            row.transpose();
      }
      for (Eigen::Index b = 0; at.tests == 0 and b < dofs; ++b)
        at.A.template block<D, D>(at.of_dof(a), at.of_dof(b)) +=
            (p.weight * p.gamma) * B.transpose() *
            dc.template middleCols<D>(D * b);
    }
    // Second variation of - g_0 t . n
    const Vec<D> t = traction(p, at, open.c);
    raymortar::add_turning_tangent<D>(open.G, open.n, p.weight * p.gap * t,
                                      at.A);
  }

  TieGap _gap;
  std::vector<TieElement<D>> _elements;
};

template <int D>
PointResults Kernel<D>::results(const ContactState& s) const
{
  PointResults r = tied_nowhere<D>(s);
  Nodal at(s);
  for (std::size_t e = 0; e < _elements.size(); ++e)
  {
    if (_elements[e].master == no_index)
      continue;
    at.gather(_elements[e]);
    const AnyFacet<D> slave(s.slave, s.slave.x, _elements[e].slave);
    for (const Index number : s.elements.points_of(e))
    {
      const auto q = static_cast<std::size_t>(number);
      const TiePoint<D> p(s, q, _elements[e].master);
      const TieOpening<D> open(p, slave, at.u, turns(p));
      const Vec<D> t = traction(p, at, open.c);
      r.status[q] = ContactStatus::stick;
      r.gap[q] = open.c.dot(open.n);
      r.pressure[q] = t.dot(open.n);
      r.gamma[q] = p.gamma;
      // A kept gap carries tractions over to where they act
      if (turns(p))
        Eigen::Map<Vec<D>>(r.x.data() + D * q) += p.gap * open.n;
      put_at<D>(r.traction, q, t);
      put_at<D>(r.slip, q, open.c - r.gap[q] * open.n);
      put_at<D>(r.friction, q, t - r.pressure[q] * open.n);
    }
  }
  return r;
}
} // namespace

std::unique_ptr<TieKernel> make_tie_kernel(TieGap gap, int gdim)
{
  if (gdim == 2)
    return std::make_unique<Kernel<2>>(gap);
  if (gdim == 3)
    return std::make_unique<Kernel<3>>(gap);
  throw Error("ties are in 2D or 3D, not in " + std::to_string(gdim) + "D");
}

void count_hits_as_cover(ContactState& s)
{
  const auto facets = static_cast<std::size_t>(s.slave.num_facets());
  std::vector<double> all(facets, 0.0), hit(facets, 0.0);
  for (std::size_t q = 0; q < s.points.size(); ++q)
    if (s.points.seed[q] != no_index)
    {
      const auto f = static_cast<std::size_t>(s.points.slave[q]);
      all[f] += s.points.weight[q];
      if (s.hits.status[q] == RayStatus::hit)
        hit[f] += s.points.weight[q];
    }
  for (std::size_t f = 0; f < facets; ++f)
    if (hit[f] != all[f])
      s.segmentation.covered[f] *= hit[f] / all[f];
}
} // namespace raymortar
