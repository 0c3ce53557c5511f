// Two plates as an interface, and dense matrices of its terms.
#pragma once

#include "facet_types.h"
#include "raymortar/interface/interface.h"
#include "rules.h"
#include "surfaces.h"
#include <Eigen/Dense>

namespace raymortar::test
{
/// Plates: half width, height and cells of each
struct Plates
{
  double slave_width = 0.7;
  double gap = 0.01;
  double reach = 0.5;
  int slave_cells = 2;
  int master_cells = 3;
  Measure measure = Measure::reference;
};

/// Multiplier of the displacement's degree, in 3D of degree 1
template <class F>
Multipliers make_multipliers(const Surface& slave, int components)
{
  Multipliers m;
  m.degree = F::tdim == 1 ? F::degree : 1;
  m.components = components;
  const int nodes = F::tdim == 1 ? F::dofs : slave.corners();
  for (Index f = 0; f < slave.num_facets(); ++f)
    for (int a = 0; a < nodes; ++a)
      m.facet.push_back(
          slave.facet_dofs[static_cast<std::size_t>(f * F::dofs + a)]);
  // A node of its own for each dof: those amid edges in 3D have no facet
  for (Index a = 0; a < slave.num_dofs(); ++a)
    m.row.push_back(components * a);
  m.value.assign(m.row.size() * static_cast<std::size_t>(components), 0.0);
  return m;
}

/// Moves a surface so that the slave of a wide plate begins on the axis r = 0
template <class F>
void put_on_axis(const Plates& plates, Surface& s)
{
  if constexpr (F::gdim == 2)
    transform<2>(s, [&](const Vec<2>& x)
                 { return Vec<2>(x[0] + plates.slave_width, x[1]); });
}

template <class F>
InterfaceInput plates_input(const Plates& plates)
{
  InterfaceInput in;
  in.slave = make_surface(
      {F::shape, F::degree, F::node_degree, plates.slave_cells, false},
      plate(plates.slave_width, plates.gap));
  in.measure = plates.measure;
  if (revolves(plates.measure))
    put_on_axis<F>(plates, in.slave);
  in.multipliers = make_multipliers<F>(in.slave, F::gdim);
  in.distances = {plates.reach, 0.5, 0.1};
  in.segment_rules = segment_rules(F::shape, 4);
  in.facet_rule = rule_on(F::shape, 4);
  return in;
}

template <class F>
Surface master_plate(const Plates& plates)
{
  Surface master = make_surface(
      {F::shape, F::degree, F::node_degree, plates.master_cells, true},
      plate(1.0, 0.0));
  if (revolves(plates.measure))
    put_on_axis<F>(plates, master);
  return master;
}

/// Not paired yet
template <class F>
Interface make_plates(const Plates& plates)
{
  Interface interface(plates_input<F>(plates));
  interface.set_master(master_plate<F>(plates));
  return interface;
}

/// Let the terms decide, with components of the slave's and of the master's
/// dofs that are prescribed
inline void begin_step(Interface& interface,
                       const std::vector<double>& fixed_slave,
                       const std::vector<double>& fixed_master)
{
  const Masters masters{interface.state().master, fixed_master};
  interface.begin_step(
      fixed_slave,
      [&](const Surface&, const FacetDistances&) { return masters; }, 10.0);
}

/// Numbers of unknowns in the order slave u, master u, multipliers
class Numbers
{
public:
  explicit Numbers(const ContactState& s) : _state(s) {}

  [[nodiscard]] Eigen::Index size() const
  {
    return slave() + master() +
           static_cast<Eigen::Index>(_state.multipliers.value.size());
  }
  [[nodiscard]] Eigen::Index slave() const
  {
    return _state.slave.num_dofs() * _state.slave.gdim;
  }
  [[nodiscard]] Eigen::Index master() const
  {
    return _state.master.num_dofs() * _state.master.gdim;
  }

  [[nodiscard]] std::vector<Eigen::Index> of(const Unknowns& unknowns) const
  {
    std::vector<Eigen::Index> numbers;
    if (unknowns.slave != no_index)
      append(_state.slave.facet_dofs, _state.slave, unknowns.slave,
             _state.slave.gdim, 0, numbers);
    if (unknowns.multiplier != no_index)
      append(_state.multipliers.facet, _state.slave, unknowns.multiplier,
             _state.multipliers.components, slave() + master(), numbers);
    if (unknowns.master != no_index)
      append(_state.master.facet_dofs, _state.master, unknowns.master,
             _state.master.gdim, slave(), numbers);
    return numbers;
  }

private:
  static void append(const std::vector<Index>& table, const Surface& s,
                     Index facet, int width, Eigen::Index first,
                     std::vector<Eigen::Index>& numbers)
  {
    const auto n = table.size() / static_cast<std::size_t>(s.num_facets());
    for (std::size_t a = 0; a < n; ++a)
      for (int i = 0; i < width; ++i)
        numbers.push_back(
            first + width * table[static_cast<std::size_t>(facet) * n + a] + i);
  }

  const ContactState& _state;
};

class DenseVector final : public VectorSink
{
public:
  explicit DenseVector(const ContactState& s)
      : value(Eigen::VectorXd::Zero(Numbers(s).size())), _numbers(s)
  {
  }

  void add(const Unknowns& rows, std::span<const double> values) override
  {
    const auto at = _numbers.of(rows);
    ASSERT_EQ(at.size(), values.size());
    for (std::size_t k = 0; k < at.size(); ++k)
      value[at[k]] += values[k];
  }

  Eigen::VectorXd value;

private:
  Numbers _numbers;
};

class DenseMatrix final : public MatrixSink
{
public:
  explicit DenseMatrix(const ContactState& s)
      : value(Eigen::MatrixXd::Zero(Numbers(s).size(), Numbers(s).size())),
        _numbers(s)
  {
  }

  [[nodiscard]] bool wants(const Unknowns&) const override { return true; }

  void add(const Unknowns& rows, const Unknowns& columns,
           const double* block) override
  {
    blocks.emplace_back(rows, columns);
    const auto r = _numbers.of(rows), c = _numbers.of(columns);
    for (const Eigen::Index i : r)
      for (const Eigen::Index j : c)
        value(i, j) += *block++;
  }

  Eigen::MatrixXd value;
  std::vector<std::pair<Unknowns, Unknowns>> blocks;

private:
  Numbers _numbers;
};

/// Residual of all terms where x = [slave u, master u, multipliers]
inline Eigen::VectorXd residual_at(Interface& interface,
                                   const Eigen::VectorXd& x)
{
  const Numbers numbers(interface.state());
  const auto part = [&](Eigen::Index begin, Eigen::Index size)
  { return std::span(x.data() + begin, static_cast<std::size_t>(size)); };
  interface.move_slave(part(0, numbers.slave()));
  interface.move_master(part(numbers.slave(), numbers.master()));
  const Eigen::Index first = numbers.slave() + numbers.master();
  interface.set_multiplier(part(first, x.size() - first));
  interface.pair();
  DenseVector b(interface.state());
  for (const auto& term : interface.terms())
    term->residual(interface.state(), b);
  return b.value;
}

/// Its tangent at the last state
inline DenseMatrix tangent_of(const Interface& interface)
{
  DenseMatrix A(interface.state());
  for (const auto& term : interface.terms())
    term->tangent(interface.state(), A);
  return A;
}

/// Unknowns with the slave pressed into the master, and all a little off
inline Eigen::VectorXd pressed(const ContactState& s, unsigned seed,
                               double depth, double rough = 1e-3)
{
  const Numbers numbers(s);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> number(-1.0, 1.0);
  Eigen::VectorXd x(numbers.size());
  for (Eigen::Index k = 0; k < x.size(); ++k)
    x[k] = rough * number(random);
  const int d = s.slave.gdim;
  for (Eigen::Index k = d - 1; k < numbers.slave(); k += d)
    x[k] -= depth;
  return x;
}
} // namespace raymortar::test
