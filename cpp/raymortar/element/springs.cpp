#include "raymortar/element/springs.h"
#include "raymortar/element/facet_fit.h"
#include <numeric>

namespace raymortar
{
namespace
{
template <int D>
class Fit : FacetFit<D>
{
  using Base = FacetFit<D>;
  using Base::_results;
  using Base::_shapes;
  using Base::_state;
  using Base::_width;
  using Base::facets;
  using Base::for_closed_points;
  using Base::shapes_at;
  using typename Base::Nodal;
  using typename Base::Shapes;

public:
  Fit(const ContactState& state, const PointResults& results)
      : Base(state, results)
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

  /// @brief What springs hold at the points, no polynomial taken off.
  [[nodiscard]] SpringPoints points()
  {
    sort_points();
    return std::move(_found.points);
  }

  /// See spring_numbers; sets the first point of each facet
  [[nodiscard]] std::vector<Index> numbers()
  {
    std::vector<std::size_t>& first = _found.points.first;
    first.assign(facets() + 1, 0);
    for_closed_points([&](std::size_t, std::size_t f) { ++first[f + 1]; });
    std::partial_sum(first.begin(), first.end(), first.begin());
    std::vector<std::size_t> next(first.begin(), first.end() - 1);
    std::vector<Index> place(_state.points.size(), no_index);
    for_closed_points([&](std::size_t q, std::size_t f)
                      { place[q] = static_cast<Index>(next[f]++); });
    return place;
  }

private:
  /// Elastic slips of a law that has them, else tangential tractions
  [[nodiscard]] const std::vector<double>& held_at_points() const
  {
    return _results.elastic_slip.empty() ? _results.friction
                                         : _results.elastic_slip;
  }

  /// Collect the closed points facet by facet, with what springs hold there
  void sort_points()
  {
    SpringPoints& to = _found.points;
    const std::vector<Index> place = numbers();
    to.xi.resize(to.first.back());
    to.area.resize(to.first.back());
    to.rest.resize(to.first.back() * D);
    for_closed_points(
        [&](std::size_t q, std::size_t)
        {
          const auto at = static_cast<std::size_t>(place[q]);
          to.xi[at] = _state.points.xi[q];
          to.area[at] = std::abs(_results.weight[q]); // slivers may be turned
          held(at) = Eigen::Map<const Vec<D>>(held_at_points().data() + q * D);
        });
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

  Springs _found;
};
} // namespace

Springs accepted_springs(const ContactState& state, const PointResults& results)
{
  return state.slave.gdim == 2 ? Fit<2>(state, results).springs()
                               : Fit<3>(state, results).springs();
}

SpringPoints accepted_elastic_slip(const ContactState& state,
                                   const PointResults& results)
{
  if (results.elastic_slip.empty())
    return {};
  return state.slave.gdim == 2 ? Fit<2>(state, results).points()
                               : Fit<3>(state, results).points();
}

std::vector<Index> spring_numbers(const ContactState& state,
                                  const PointResults& results)
{
  return state.slave.gdim == 2 ? Fit<2>(state, results).numbers()
                               : Fit<3>(state, results).numbers();
}
} // namespace raymortar
