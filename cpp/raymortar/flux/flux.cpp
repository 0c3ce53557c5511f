#include "raymortar/flux/flux.h"
#include "raymortar/element/free_tools.h"
#include "raymortar/flux/flux_element.h"
#include "raymortar/pairing/facet_dofs.h"

namespace raymortar
{
namespace
{
/// Columns of the slave's displacement and multiplier
void append_slave(const ContactState& s, Index facet,
                  std::vector<GlobalIndex>& columns)
{
  for_facet_dofs(s.slave, facet,
                 [&](std::size_t k) { columns.push_back(s.slave.rows[k]); });
  const Multipliers& m = s.multipliers;
  if (m.components == 0)
    return;
  for (const Index node : m.nodes_of(facet, m.per_facet(s.slave.num_facets())))
    for (int i = 0; i < m.components; ++i)
      columns.push_back(m.row[static_cast<std::size_t>(node)] + i);
}

/// Append the columns of a master's displacement or of a free tool; no_index
/// adds none
void append_target(const ContactState& s, Index target,
                   std::vector<GlobalIndex>& columns)
{
  if (target == no_index)
    return;
  if (s.has_tools())
    for (const GlobalIndex row : freedom_of(s, target).rows)
      columns.push_back(row);
  else
    for_facet_dofs(s.master, target,
                   [&](std::size_t k) { columns.push_back(s.master.rows[k]); });
}

void append(FluxEntries& out, GlobalIndex row,
            std::span<const GlobalIndex> columns, const double* values)
{
  for (std::size_t k = 0; k < columns.size(); ++k)
    if (values[k] != 0.0)
    {
      out.rows.push_back(row);
      out.columns.push_back(columns[k]);
      out.values.push_back(values[k]);
    }
}

/// The points of a zone in the order in which fluxes are given
template <int D, class Law>
class Fluxes
{
  using Element = FluxElement<D, Law>;
  static constexpr int T = D - 1;

public:
  Fluxes(const ContactState& s, const FluxFields& fields, Wanted wanted)
      : _state(s), _points(s, wanted), _field(s, fields)
  {
  }

  [[nodiscard]] FluxPoints points()
  {
    FluxPoints found;
    for_elements(
        [&](std::size_t e)
        {
          for_numbered_points(e, [&](std::size_t q, std::size_t)
                              { store(q, found); });
        });
    return found;
  }

  [[nodiscard]] FluxEntries residual(const FluxValues& flux)
  {
    FluxEntries out;
    for_elements(
        [&](std::size_t e)
        {
          _element.clear_residual(_field);
          for_numbered_points(e,
                              [&](std::size_t, std::size_t k)
                              {
                                _element.add_residual(
                                    {_points.data, _points.at}, _field, flux, k,
                                    _state.keeps_springs);
                              });
          for (int a = 0; a < _field.nodes(); ++a)
          {
            out.rows.push_back(_field.row(a));
            out.values.push_back(_element.r[static_cast<std::size_t>(a)]);
          }
        });
    return out;
  }

  [[nodiscard]] FluxEntries tangent(const FluxValues& flux)
  {
    FluxEntries out;
    std::optional<SegmentMotion<D>> motion;
    if (_state.moving_segments)
      motion.emplace(_state);
    const CouplingSink couplings = [&](std::size_t, Index target,
                                       const double* block, int size,
                                       const double* hit_rows)
    { append_coupling(target, block, size, hit_rows, out); };
    for_elements(
        [&](std::size_t e)
        {
          _element.clear_tangent(_field, _points.shapes);
          const typename SegmentMotion<D>::Element moving{
              e, _points.shapes.alone(), _points.shapes.size(),
              _element.A.data(), couplings};
          const bool moves = motion and has_moving_vertices(_state, e);
          for_numbered_points(e,
                              [&](std::size_t q, std::size_t k)
                              {
                                add_point(flux, k, moves);
                                if (moves)
                                  motion->add(moving, q, _integrand);
                              });
          if (moves)
            motion->finish(moving);
          append_element(e, out);
        });
    return out;
  }

private:
  /// Visit elements with a target
  template <class Visit>
  void for_elements(Visit&& visit)
  {
    _count = 0;
    for (std::size_t e = 0; e < _state.elements.size(); ++e)
    {
      if (_state.elements.master[e] == no_index)
        continue;
      _points.take(e);
      _field.take(e);
      visit(e);
    }
  }

  /// Visit the points of an element with a hit, with their numbers
  template <class Visit>
  void for_numbered_points(std::size_t e, Visit&& visit)
  {
    for_points(_points, e,
               [&](std::size_t q)
               {
                 _field.place(q);
                 visit(q, _count++);
               });
  }

  void store(std::size_t q, FluxPoints& out) const
  {
    const typename Element::template Hit<false> p(_points.data, _points.at);
    const Vec<D> slip = p.slip();
    out.point.push_back(static_cast<Index>(q));
    out.slave.push_back(_field.slave);
    out.target.push_back(_field.target);
    out.pressure.push_back(std::max(0.0, -p.pressure()));
    out.gap.push_back(p.gap);
    out.slip.push_back(slip.norm());
    out.work.push_back(p.dissipated(_state.keeps_springs));
    out.weight.push_back(p.weight);
  }

  void add_point(const FluxValues& flux, std::size_t k, bool moves)
  {
    const auto& e = _points.data;
    const typename Element::template Hit<true> p(e, _points.at);
    const typename Element::HitTangent by(e, p);
    const FluxSlopes<D, Element::M> slopes(p, flux, k, _state.keeps_springs);
    const Vec<2> h = leaving(p, flux, k, _state.keeps_springs);
    _element.add_tangent(e, p, by, slopes, h, _field, _points.shapes);
    if (not moves)
      return;
    Vec<T> along = Vec<T>::Zero();
    if (not flux.along.empty())
      along = Eigen::Map<const Vec<T>>(flux.along.data() + T * k);
    Element::set_integrand(e, _points.at, p, by, slopes, h, along, _field,
                           _points.shapes, _integrand);
  }

  void append_element(std::size_t e, FluxEntries& out)
  {
    _columns.clear();
    for (int a = 0; a < _field.nodes(); ++a)
      _columns.push_back(_field.row(a));
    _others.clear();
    append_slave(_state, _state.elements.slave[e], _others);
    append_target(_state, target_of(_state, e), _others);
    const int n = _field.nodes(), size = _points.shapes.size();
    for (int a = 0; a < n; ++a)
    {
      append(out, _field.row(a), _columns, _element.by_field.data() + a * n);
      append(out, _field.row(a), _others,
             _element.A.data() +
                 Element::row_of(a, _field, _points.shapes) * size);
    }
  }

  /// The columns of a target that the element does not hit, see CouplingSink
  void append_coupling(Index target, const double* block, int size,
                       const double* hit_rows, FluxEntries& out)
  {
    _others.clear();
    append_target(_state, target, _others);
    const int alone = _points.shapes.alone();
    for (int a = 0; a < _field.slave_nodes(); ++a)
      append(out, _field.row(a), _others, block + a * size + alone);
    for (int b = 0; hit_rows and b < _field.target_nodes(); ++b)
      append(out, _field.row(_field.slave_nodes() + b), _others,
             hit_rows + static_cast<std::size_t>(b) * _others.size());
  }

  const ContactState& _state;
  AnyPoints<D, Law> _points;
  FluxAt<D> _field;
  Element _element;
  AnyIntegrand<D> _integrand;
  std::vector<GlobalIndex> _columns, _others;
  std::size_t _count = 0;
};

/// Call `fn` with the fluxes of a zone, which are large
template <class Fn>
auto with_fluxes(const ContactState& s, const FluxFields& fields, Wanted wanted,
                 Fn&& fn)
{
  return with_traction(
      s,
      [&]<class Law>()
      {
        return s.slave.gdim == 2
                   ? fn(*std::make_unique<Fluxes<2, Law>>(s, fields, wanted))
                   : fn(*std::make_unique<Fluxes<3, Law>>(s, fields, wanted));
      });
}
} // namespace

FluxPoints flux_points(const ContactState& s, const FluxFields& fields)
{
  return with_fluxes(s, fields, {.old = true},
                     [](auto& fluxes) { return fluxes.points(); });
}

FluxEntries flux_residual(const ContactState& s, const FluxFields& fields,
                          const FluxValues& flux)
{
  return with_fluxes(s, fields, {.old = true},
                     [&](auto& fluxes) { return fluxes.residual(flux); });
}

FluxEntries flux_tangent(const ContactState& s, const FluxFields& fields,
                         const FluxValues& flux)
{
  const Wanted wanted{
      .old = true, .target = true, .bends = true, .along = s.moving_segments};
  return with_fluxes(s, fields, wanted,
                     [&](auto& fluxes) { return fluxes.tangent(flux); });
}
} // namespace raymortar
