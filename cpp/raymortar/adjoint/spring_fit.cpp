#include "raymortar/adjoint/spring_fit.h"
#include "raymortar/element/extension.h"

namespace raymortar
{
namespace
{
/// Goes back facet by facet.
template <int D>
class BackThroughFit
{
  static constexpr int T = D - 1;
  static constexpr auto width =
      static_cast<std::size_t>(SpringWeights<D>::width);
  /// Columns by node
  template <int Rows>
  using Nodal = Eigen::Matrix<double, Rows, Eigen::Dynamic,
                              Rows == 1 ? Eigen::RowMajor : 0, Rows, 9>;

public:
  BackThroughFit(const ContactState& s, std::span<const double> at_points)
      : _state(s), _points(s.spring_points), _at_points(at_points),
        _shapes(s.slave.shape, s.slave.degree),
        _found(s.spring_points.xi.size() * width, 0.0)
  {
  }

  [[nodiscard]] std::vector<double> found()
  {
    const auto facets = static_cast<std::size_t>(_state.slave.num_facets());
    std::vector<std::vector<std::size_t>> of(facets);
    for (std::size_t q = 0; q < _state.points.size(); ++q)
      of[static_cast<std::size_t>(_state.points.slave[q])].push_back(q);
    for (std::size_t f = 0; f < facets and not _points.empty(); ++f)
      if (_points.first[f] < _points.first[f + 1])
        go_back(f, of[f]);
    return std::move(_found);
  }

private:
  struct Functions
  {
    Nodal<1> N;
    Nodal<T> N_xi;
  };

  [[nodiscard]] Functions functions(const Vec<2>& xi) const
  {
    ShapeRows<T> rows;
    _shapes.first(xi.template head<T>(), rows);
    Functions at{Nodal<1>(1, _shapes.nodes()), Nodal<T>(T, _shapes.nodes())};
    for (int a = 0; a < _shapes.nodes(); ++a)
    {
      const auto& row = rows[static_cast<std::size_t>(a)];
      at.N(0, a) = row[0];
      for (int j = 0; j < T; ++j)
        at.N_xi(j, a) = row[static_cast<std::size_t>(1 + j)];
    }
    return at;
  }

  [[nodiscard]] Eigen::Map<Vec<D>> held(std::size_t q)
  {
    return Eigen::Map<Vec<D>>(_found.data() + q * width);
  }
  [[nodiscard]] Eigen::Map<Vec<T>> along(std::size_t q)
  {
    return Eigen::Map<Vec<T>>(_found.data() + q * width + D);
  }
  [[nodiscard]] double& area(std::size_t q)
  {
    return _found[q * width + width - 1];
  }
  [[nodiscard]] Vec<D> rest(std::size_t q) const
  {
    return Eigen::Map<const Vec<D>>(_points.rest.data() + q * D);
  }

  /// @param[in] loaded Integration points of the facet
  void go_back(std::size_t f, const std::vector<std::size_t>& loaded)
  {
    const auto n = static_cast<Eigen::Index>(_shapes.nodes());
    const std::size_t begin = _points.first[f], end = _points.first[f + 1];
    const Eigen::Map<const Nodal<D>> field(
        _state.traction_old.nodal.data() + f * D * static_cast<std::size_t>(n),
        D, n);
    Nodal<D> by_field = Nodal<D>::Zero(D, n), load = by_field;
    for (const std::size_t i : loaded)
    {
      const Vec<D> v = Eigen::Map<const Vec<D>>(_at_points.data() + i * D);
      if (v.isZero(0.0))
        continue;
      by_field += v * functions(_state.points.xi[i]).N;
      add_mean(begin, end, _state.points.xi[i].template head<T>(), v);
    }
    // The rest is what is held, less the polynomial
    FacetMatrix part = FacetMatrix::Zero(n, n);
    for (std::size_t q = begin; q < end; ++q)
    {
      const Functions at = functions(_points.xi[q]);
      along(q) -= at.N_xi * (field.transpose() * held(q));
      by_field -= held(q) * at.N;
      const double a = _points.area[q];
      load += a * (rest(q) + field * at.N.transpose()) * at.N;
      part += (a * at.N.transpose()) * at.N;
    }
    // The polynomial is load K K^T
    const FacetMatrix K =
        polynomials_on_part(_state.slave.shape, _state.slave.degree, part);
    const Nodal<D> by_load = (by_field * K) * K.transpose();
    const FacetMatrix by_part =
        projection_by_part(_state.slave.shape, _state.slave.degree, part,
                           load.transpose() * by_field);
    const FacetMatrix both = by_part + by_part.transpose();
    for (std::size_t q = begin; q < end; ++q)
    {
      const Functions at = functions(_points.xi[q]);
      const Vec<D> told = by_load * at.N.transpose();
      const Vec<D> all = rest(q) + field * at.N.transpose();
      const double a = _points.area[q];
      held(q) += a * told;
      area(q) += all.dot(told) + 0.5 * (at.N * both * at.N.transpose())(0, 0);
      along(q) +=
          a * (at.N_xi * (by_load.transpose() * all + both * at.N.transpose()));
    }
  }

  /// Go back through the mean of the points at a place, see rest_at
  void add_mean(std::size_t begin, std::size_t end, const Vec<T>& xi,
                const Vec<D>& v)
  {
    const auto distance = [&](std::size_t q)
    {
      return SquaredDistance<T>(_state.slave.shape,
                                xi - _points.xi[q].template head<T>());
    };
    const std::size_t nearest =
        nearest_of<T>(_points, _state.slave.shape, begin, end, xi);
    const double least = distance(nearest).value;
    // Shares are over that of the nearest point, times its area
    double sum = _points.area[nearest];
    Vec<D> more = Vec<D>::Zero(); // over the least distance
    for (std::size_t q = begin; q < end; ++q)
      if (q != nearest)
      {
        const double share = _points.area[q] / distance(q).value;
        sum += share * least;
        more += share * (rest(q) - rest(nearest));
      }
    const Vec<D> mean = rest(nearest) + least / sum * more;
    for (std::size_t q = begin; q < end; ++q)
    {
      const SquaredDistance<T> there = distance(q);
      const bool here = q == nearest;
      const double a = _points.area[q];
      const double share = here ? a : a * least / there.value;
      held(q) += share / sum * v;
      // By the weight's logarithm, over the least distance
      const double by_log =
          here ? -a / (sum * sum) * more.dot(v)
               : a / (there.value * sum) * (rest(q) - mean).dot(v);
      area(q) += least * by_log / a;
      along(q) += (here ? by_log : least / there.value * by_log) * there.slope;
    }
  }

  const ContactState& _state;
  const SpringPoints& _points;
  std::span<const double> _at_points;
  ShapeFunctions<T> _shapes; ///< of the displacement
  std::vector<double> _found;
};
} // namespace

std::vector<double> spring_weights(const ContactState& s,
                                   std::span<const double> at_points)
{
  return s.slave.gdim == 2 ? BackThroughFit<2>(s, at_points).found()
                           : BackThroughFit<3>(s, at_points).found();
}
} // namespace raymortar
