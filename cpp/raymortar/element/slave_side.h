// What an integration point has of its slave side, of facets of any kind.
#pragma once

#include "raymortar/element/point_kernel.h"
#include "raymortar/geometry/predicates.h"

namespace raymortar
{
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
} // namespace raymortar
