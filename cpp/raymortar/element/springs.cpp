#include "raymortar/element/springs.h"
#include "raymortar/element/extension.h"

namespace raymortar
{
namespace
{
template <int D>
class Fit
{
  static constexpr int T = D - 1;
  /// Nodal field of one facet
  using Nodal = Eigen::Matrix<double, D, Eigen::Dynamic, 0, D, 9>;
  /// Shape functions of the displacement
  using Shapes = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 9, 1>;

public:
  Fit(const ContactState& state, const PointResults& results)
      : _state(state), _results(results),
        _shapes(state.slave.shape, state.slave.degree),
        _width(static_cast<std::size_t>(_shapes.nodes()) * D)
  {
    _found.nodal.assign(facets() * _width, 0.0);
  }

  [[nodiscard]] Springs springs()
  {
    sort_points();
    for (std::size_t f = 0; f < facets(); ++f)
      fit(f);
    return std::move(_found);
  }

private:
  [[nodiscard]] std::size_t facets() const
  {
    return static_cast<std::size_t>(_state.slave.num_facets());
  }

  /// Collect the closed points facet by facet, with what springs hold there
  void sort_points()
  {
    SpringPoints& to = _found.points;
    to.first.assign(facets() + 1, 0);
    for_closed_points([&](std::size_t, std::size_t f) { ++to.first[f + 1]; });
    for (std::size_t f = 0; f < facets(); ++f)
      to.first[f + 1] += to.first[f];
    to.xi.resize(to.first.back());
    to.area.resize(to.first.back());
    to.rest.resize(to.first.back() * D);
    std::vector<std::size_t> next(to.first.begin(), to.first.end() - 1);
    for_closed_points(
        [&](std::size_t q, std::size_t f)
        {
          const std::size_t at = next[f]++;
          to.xi[at] = _state.points.xi[q];
          to.area[at] = std::abs(_results.weight[q]); // slivers may be turned
          held(at) = Eigen::Map<const Vec<D>>(_results.friction.data() + q * D);
        });
  }

  /// Call with the number of each closed point and of its facet
  template <class Call>
  void for_closed_points(Call&& call) const
  {
    for (std::size_t q = 0; q < _state.points.size(); ++q)
      if (_results.status[q] >= ContactStatus::stick and
          _state.points.area[q] != 0.0)
        call(q, static_cast<std::size_t>(_state.points.slave[q]));
  }

  /// Take the polynomial of a facet from what its points hold
  void fit(std::size_t f)
  {
    const SpringPoints& points = _found.points;
    const std::size_t begin = points.first[f], end = points.first[f + 1];
    if (begin == end)
      return;
    FacetMatrix part = FacetMatrix::Zero(_shapes.nodes(), _shapes.nodes());
    Nodal load = Nodal::Zero(D, _shapes.nodes());
    for (std::size_t q = begin; q < end; ++q)
    {
      const Shapes N = shapes_at(points.xi[q]);
      part += (points.area[q] * N).lazyProduct(N.transpose());
      load += (points.area[q] * held(q)).lazyProduct(N.transpose());
    }
    const FacetMatrix known =
        polynomials_on_part(_state.slave.shape, _state.slave.degree, part);
    const Nodal told = load.lazyProduct(known);
    Eigen::Map<Nodal> field(_found.nodal.data() + f * _width, D,
                            _shapes.nodes());
    field = told.lazyProduct(known.transpose());
    for (std::size_t q = begin; q < end; ++q)
      held(q) -= field.lazyProduct(shapes_at(points.xi[q]));
  }

  [[nodiscard]] Eigen::Map<Vec<D>> held(std::size_t q)
  {
    return Eigen::Map<Vec<D>>(_found.points.rest.data() + q * D);
  }

  [[nodiscard]] Shapes shapes_at(const Vec<2>& xi) const
  {
    ShapeRows<T> rows;
    _shapes.first(xi.template head<T>(), rows);
    Shapes N(_shapes.nodes());
    for (int a = 0; a < _shapes.nodes(); ++a)
      N[a] = rows[static_cast<std::size_t>(a)][0];
    return N;
  }

  const ContactState& _state;
  const PointResults& _results;
  ShapeFunctions<T> _shapes; ///< of the displacement
  std::size_t _width;        ///< numbers of a nodal field, per facet
  Springs _found;
};
} // namespace

Springs accepted_springs(const ContactState& state, const PointResults& results)
{
  return state.slave.gdim == 2 ? Fit<2>(state, results).springs()
                               : Fit<3>(state, results).springs();
}
} // namespace raymortar
