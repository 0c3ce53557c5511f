#include "raymortar/element/excess.h"
#include "raymortar/element/facet_fit.h"
#include "raymortar/element/target.h"
#include "raymortar/element/turned_traction.h"
#include "raymortar/geometry/predicates.h"
#include "raymortar/law/elastic_disc.h"

namespace raymortar
{
namespace
{
/// Corrections of a field where points slip, at most, and the share of it below
/// which they end. After the first ones a field is corrected only as long as
/// that converges: where the bound cuts it off at all points, it grows, and the
/// traction stays
constexpr int corrections = 60, first_corrections = 20;
constexpr double settled = 1e-13, converges = 0.7;

template <int D>
class Excess : FacetFit<D>
{
  using Base = FacetFit<D>;
  using Base::_results;
  using Base::_shapes;
  using Base::_state;
  using Base::_width;
  using Base::facets;
  using Base::shapes_at;
  using Base::T;
  using typename Base::Nodal;
  using typename Base::Shapes;

public:
  Excess(const ContactState& state, const PointResults& results)
      : Base(state, results),
        _part(facets(), FacetMatrix::Zero(_shapes.nodes(), _shapes.nodes())),
        _load(facets(), Nodal::Zero(D, _shapes.nodes())), _known(facets()),
        _slips(facets(), false), _change(facets(), 0.0),
        _field(facets() * _width, 0.0)
  {
  }

  [[nodiscard]] std::vector<double> accepted()
  {
    turn_old_field();
    for_closed_points([this](std::size_t q, std::size_t) { add_change(q); });
    for (std::size_t f = 0; f < facets(); ++f)
      start(f);
    for (int k = 0; k < corrections and correct(k < first_corrections); ++k)
      ;
    return std::move(_field);
  }

private:
  template <class Call>
  void for_closed_points(Call&& call) const
  {
    Base::for_closed_points(
        [&](std::size_t q, std::size_t f)
        {
          if (_state.points.area[q] > 0.0)
            call(q, f);
        });
  }

  [[nodiscard]] Eigen::Map<Nodal> field(std::size_t f)
  {
    return Eigen::Map<Nodal>(_field.data() + f * _width, D, _shapes.nodes());
  }

  /// Value of a vector at a point, from its nodal values
  [[nodiscard]] Vec<D> field_at(std::size_t f, const Shapes& N)
  {
    return field(f).lazyProduct(N);
  }

  /// Value of a scalar field on a facet
  [[nodiscard]] double value(const FacetField& of, Index facet,
                             const Shapes& N) const
  {
    double sum = 0.0;
    const auto first = static_cast<Eigen::Index>(facet) * N.size();
    for (Eigen::Index a = 0; a < N.size() and not of.empty(); ++a)
      sum += N[a] * of.nodal[static_cast<std::size_t>(first + a)];
    return sum;
  }

  /// Frame of a slave facet at some positions
  [[nodiscard]] Frame<D> frame(const std::vector<double>& positions,
                               Index facet, const Vec<2>& xi) const
  {
    const auto taylor = AnyFacet<D>(_state.slave, positions, facet).taylor(xi);
    Frame<D> f;
    f.x = taylor.col(0);
    f.t = taylor.template middleCols<T>(1);
    set_normal(f);
    return f;
  }

  /// The rotation of the surface at each node, of all of the vector: what it
  /// has along the normal there is tangential elsewhere on a curved facet
  void turn_old_field()
  {
    if (_state.traction_old.empty())
      return;
    const Surface& slave = _state.slave;
    const std::vector<Vec<2>> places = node_places(slave.shape, slave.degree);
    for (std::size_t f = 0; f < facets(); ++f)
      for (std::size_t a = 0; a < places.size(); ++a)
      {
        const auto facet = static_cast<Index>(f);
        const Frame<D> before = frame(slave.x_old, facet, places[a]);
        const std::size_t at = f * _width + a * D;
        Eigen::Map<Vec<D>>(_field.data() + at) =
            carry_traction<D>(
                before, dual_tangents<D>(before),
                frame(slave.x, facet, places[a]),
                Eigen::Map<const Vec<D>>(_state.traction_old.nodal.data() + at),
                true)
                .value();
      }
  }

  [[nodiscard]] Vec<D> vector(const std::vector<double>& values,
                              std::size_t q) const
  {
    return Eigen::Map<const Vec<D>>(values.data() + q * D);
  }

  [[nodiscard]] Vec<D> tangential(const Vec<D>& v, std::size_t q) const
  {
    const Vec<D> n = vector(_results.contact_normal, q);
    return v - n.dot(v) * n;
  }

  /// Coefficient of the law at a point
  [[nodiscard]] double gamma_at(std::size_t q, const Shapes& N) const
  {
    const Index slave = _state.points.slave[q], master = _state.hits.master[q];
    if (_state.has_tools())
      return value(_state.gamma, slave, N);
    return _state.pair_factors.of(_state.slave.body_of(slave),
                                  _state.master.body_of(master)) *
           value(_state.gamma, slave, N);
  }

  /// Multiplier at a point
  [[nodiscard]] Vec<D> multiplier(std::size_t q) const
  {
    return vector(_results.traction, q);
  }

  /// Friction law at a point
  [[nodiscard]] FrictionLaw law_at(std::size_t q, const Shapes& N) const
  {
    if (not _state.friction_bounds.empty())
      return _state.friction_bounds[q];
    if (_state.friction_coefficient.empty())
      return *_state.friction;
    return with_coefficient(*_state.friction, value(_state.friction_coefficient,
                                                    _state.points.slave[q], N));
  }

  /// Bound of friction at the accepted step, with its gap along the old normal
  /// of the law's frame
  [[nodiscard]] double old_bound(std::size_t q, const Shapes& N,
                                 double gamma) const
  {
    const Surface& slave = _state.slave;
    const Index facet = _state.points.slave[q];
    const Frame<D> old = frame(slave.x_old, facet, _state.points.xi[q]);
    const OldTarget<D> target = old_target<D>(_state, q, vector(_results.x, q),
                                              vector(_results.normal, q));
    const Vec<D> n = _state.has_frame_of_target(q) ? Vec<D>(-target.n) : old.n;
    const double g = n.dot(target.x - old.x) + value(_state.offset, facet, N);
    const double p =
        vector(_results.contact_normal, q).dot(multiplier(q)) + gamma * g;
    return bound_at(law_at(q, N), p).s;
  }

  /// Add the change of the law at a closed point
  void add_change(std::size_t q)
  {
    const auto f = static_cast<std::size_t>(_state.points.slave[q]);
    const Shapes N = shapes_at(_state.points.xi[q]);
    const double gamma = gamma_at(q, N);
    const Vec<D> start = tangential(multiplier(q) + gamma * field_at(f, N), q);
    const Vec<D> end = vector(_results.friction, q);
    Vec<D> change = end - start;
    if (_results.status[q] == ContactStatus::slip)
    {
      change += excess(q, N, gamma, start, end);
      _slips[f] = true;
    }
    _part[f] += (_results.weight[q] * N).lazyProduct(N.transpose());
    add_to_load(f, _results.weight[q] / gamma * change, N);
  }

  void add_to_load(std::size_t f, const Vec<D>& change, const Shapes& N)
  {
    _load[f] += change.lazyProduct(N.transpose());
  }

  /// A polynomial may exceed the bound at single points by its own error. The
  /// law cuts that off wherever it is evaluated; the field has to keep it, or
  /// it would get smaller with every step at rest. Slip uses it up
  [[nodiscard]] Vec<D> excess(std::size_t q, const Shapes& N, double gamma,
                              const Vec<D>& start, const Vec<D>& end) const
  {
    const double length = start.norm() -
                          std::max(end.norm(), old_bound(q, N, gamma)) -
                          gamma * vector(_results.slip, q).norm();
    if (length <= 0.0)
      return Vec<D>::Zero();
    return length * start.normalized();
  }

  void start(std::size_t f)
  {
    if (_part[f].isZero(0.0))
    {
      field(f).setZero();
      return;
    }
    _known[f] =
        polynomials_on_part(_state.slave.shape, _state.slave.degree, _part[f]);
    add_load(f);
  }

  /// Add the polynomial of the load, and take the load away
  void add_load(std::size_t f)
  {
    const Nodal told = _load[f].lazyProduct(_known[f]);
    field(f) += told.lazyProduct(_known[f].transpose());
    _load[f].setZero();
  }

  /// Add to the field what keeps the mean traction of this step at rest. The
  /// law cuts off the errors of a polynomial that lie outside the bound, and
  /// leaves those inside: without this, the mean would be too small
  /// @param[in] all Whether fields that do not converge are corrected too
  /// @return Whether a facet is to be corrected further
  [[nodiscard]] bool correct(bool all)
  {
    for_closed_points(
        [this](std::size_t q, std::size_t f)
        {
          if (_slips[f])
            add_lack(q);
        });
    bool again = false;
    for (std::size_t f = 0; f < facets(); ++f)
      if (_slips[f])
      {
        const Nodal was = field(f);
        add_load(f);
        const double change = (field(f) - was).norm();
        _slips[f] = change > settled * field(f).norm() and
                    (all or change < converges * _change[f]);
        _change[f] = change;
        again = again or _slips[f];
      }
    return again;
  }

  void add_lack(std::size_t q)
  {
    const Index facet = _state.points.slave[q];
    const auto f = static_cast<std::size_t>(facet);
    const Shapes N = shapes_at(_state.points.xi[q]);
    const double gamma = gamma_at(q, N);
    const double touch =
        tolerance::touch *
        AnyFacet<D>(_state.slave, _state.slave.x, facet).diameter();
    Vec<D> held = field_at(f, N);
    if (not _results.elastic_slip.empty())
      held += vector(_results.elastic_slip, q);
    const ElasticDisc disc(bound_at(law_at(q, N), _results.pressure[q]), gamma,
                           true);
    const auto at_rest = project_tangential<D>(
        vector(_results.contact_normal, q), multiplier(q) + gamma * held,
        disc.radius, gamma * touch);
    add_to_load(f,
                _results.weight[q] / gamma *
                    (vector(_results.friction, q) - disc.share * at_rest.value),
                N);
  }

  std::vector<FacetMatrix> _part;  ///< mass of the closed points
  std::vector<Nodal> _load;        ///< integrals of the change
  std::vector<FacetMatrix> _known; ///< polynomials of the closed points
  std::vector<bool> _slips;    ///< facets with slip that are still corrected
  std::vector<double> _change; ///< of each facet's field by its last correction
  std::vector<double> _field;
};
} // namespace

std::vector<double> accepted_excess(const ContactState& state,
                                    const PointResults& results)
{
  return state.slave.gdim == 2 ? Excess<2>(state, results).accepted()
                               : Excess<3>(state, results).accepted();
}
} // namespace raymortar
