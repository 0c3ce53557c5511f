#include "raymortar/interface/damping_term.h"
#include "raymortar/interface/facet_blocks.h"
#include "raymortar/mortar/tool_rays.h"
#include "raymortar/mortar/whole_facets.h"
#include <algorithm>

namespace raymortar
{
namespace
{
template <class T>
std::vector<T> rows_of(const std::vector<T>& table, std::size_t width,
                       const std::vector<Index>& facets)
{
  std::vector<T> part;
  part.reserve(facets.size() * width);
  if (table.empty())
    return part;
  for (const Index f : facets)
  {
    const auto from = table.begin() + static_cast<std::ptrdiff_t>(
                                          static_cast<std::size_t>(f) * width);
    part.insert(part.end(), from, from + static_cast<std::ptrdiff_t>(width));
  }
  return part;
}

/// Put rows of some facets into a table of all
void put_rows(const std::vector<std::int8_t>& rows, std::size_t width,
              const std::vector<Index>& facets, std::vector<std::int8_t>& table)
{
  for (std::size_t k = 0; k < rows.size(); ++k)
    table[static_cast<std::size_t>(facets[k / width]) * width + k % width] =
        rows[k];
}

/// Some facets of a surface, with all its nodes and dofs, where it was
Surface part_where_it_was(const Surface& s, const std::vector<Index>& facets)
{
  const auto nodes = static_cast<std::size_t>(s.nodes_per_facet());
  const auto dofs = static_cast<std::size_t>(s.dofs_per_facet());
  Surface part;
  part.shape = s.shape;
  part.degree = s.degree;
  part.node_degree = s.node_degree;
  part.gdim = s.gdim;
  part.X = s.X;
  part.x = part.x_old = s.x_old;
  part.rows = s.rows;
  part.facet_nodes = rows_of(s.facet_nodes, nodes, facets);
  part.facet_dofs = rows_of(s.facet_dofs, dofs, facets);
  part.facet_id = rows_of(s.facet_id, 1, facets);
  part.thickness = rows_of(s.thickness, 1, facets);
  part.body = rows_of(s.body, 1, facets);
  part.neighbours = find_neighbours(part);
  return part;
}

/// Distances of some facets; `reach`: in place of their own
FacetDistances distances_of(const FacetDistances& all,
                            const std::vector<Index>& facets,
                            std::optional<double> reach)
{
  std::vector<SearchDistances> each;
  for (const Index f : facets)
    each.push_back({reach.value_or(all[f].reach), all[f].depth, 0.0});
  return {std::move(each), all.depth_is_default()};
}

/// Facets that are not known yet
std::vector<Index> unknown(const std::vector<Index>& facets,
                           const std::vector<std::int8_t>& known)
{
  std::vector<Index> rest;
  for (std::size_t k = 0; k < facets.size(); ++k)
    if (k >= known.size() or known[k] == 0)
      rest.push_back(facets[k]);
  return rest;
}

/// Number held facets as the zone does
HeldFacets with_numbers(HeldFacets held, const std::vector<Index>& facets)
{
  for (auto* const blocks : {&held.facets, &held.rest})
    for (FacetBlock& one : *blocks)
      one.slave = facets[static_cast<std::size_t>(one.slave)];
  return held;
}

/// Damping of some facets by what they face at the start of a step; `known`
/// tells which of them face anything
HeldFacets look(const StepStart& start, const std::vector<Index>& facets,
                std::optional<double> reach)
{
  const FacetDistances distances =
      distances_of(start.rules.distances, facets, reach);
  ContactState past;
  past.slave = part_where_it_was(start.state.slave, facets);
  past.multipliers.degree = start.state.multipliers.degree;
  past.multipliers.components = start.state.multipliers.components;
  past.friction = start.state.friction;
  past.tools = where_they_were(start.state.tools);
  HeldFacets held;
  if (past.has_tools())
  {
    past.segmentation = whole_facets(past.slave);
    past.points = make_points(past.slave, past.segmentation,
                              start.rules.segment_rules, start.rules.facet_rule,
                              false, revolves(start.rules.measure));
    past.hits = cast_on_tools(past.slave, past.tools, past.points, distances);
    find_held_facets(past, start.fixed_slave, {}, 1.0, held);
    return with_numbers(std::move(held), facets);
  }
  Masters masters = start.masters_near(past.slave, distances);
  past.master = std::move(masters.surface);
  past.master.x = past.master.x_old;
  if (facets.empty())
    return held;
  const auto candidates = find_candidates(past.slave, past.master, distances);
  past.segmentation = make_segments(past.slave, past.master, candidates,
                                    {distances, start.rules.subdivide});
  past.points =
      make_points(past.slave, past.segmentation, start.rules.segment_rules,
                  start.rules.facet_rule, true, revolves(start.rules.measure));
  past.hits = cast_rays(past.slave, past.master, past.points, distances);
  find_held_facets(past, start.fixed_slave, masters.fixed, 1.0, held);
  return with_numbers(std::move(held), facets);
}
} // namespace

void DampingTerm::begin_step(const StepStart& start)
{
  const auto facets = facets_with_held_nodes(start.state, start.fixed_slave);
  const HeldFacets near = look(start, facets, {});
  const auto others = unknown(facets, near.known);
  const HeldFacets far = look(start, others, start.extent);
  _facets = _rest = _crossing;
  for (const HeldFacets* held : {&near, &far})
  {
    _facets.insert(_facets.end(), held->facets.begin(), held->facets.end());
    _rest.insert(_rest.end(), held->rest.begin(), held->rest.end());
  }
  _acting = _facets;
  _gdim = start.state.slave.gdim;
  const auto d = static_cast<std::size_t>(_gdim);
  _unfelt.assign(static_cast<std::size_t>(start.state.slave.num_facets()) * d,
                 0);
  put_rows(near.unfelt, d, facets, _unfelt);
  put_rows(far.unfelt, d, others, _unfelt);
  const auto nodes =
      static_cast<std::size_t>(start.state.slave.dofs_per_facet());
  _held_nodes.assign(start.state.slave.facet_dofs.size(), 0);
  put_rows(near.nodes, nodes, facets, _held_nodes);
  put_rows(far.nodes, nodes, others, _held_nodes);
}

void DampingTerm::set_kept(const Multipliers& m,
                           std::span<const std::int8_t> kept)
{
  _acting = _facets;
  if (kept.empty())
    return;
  const auto d = static_cast<std::size_t>(_gdim);
  const std::size_t n = m.per_facet(static_cast<Index>(_unfelt.size() / d));
  for (std::size_t k = 0; k < _facets.size(); ++k)
  {
    const auto f = static_cast<std::size_t>(_facets[k].slave);
    bool all = true;
    for (std::size_t i = 0; i < d; ++i)
      for (std::size_t a = 0; a < n and _unfelt[f * d + i] != 0; ++a)
        all = all and
              kept[static_cast<std::size_t>(m.facet[f * n + a]) * d + i] != 0;
    if (all)
      _acting[k] = _rest[k];
  }
}

Work DampingTerm::residual(const ContactState& s, VectorSink& sink) const
{
  add_facet_residuals(s, _acting, compliance(), sink);
  return {};
}

Work DampingTerm::tangent(const ContactState& s, MatrixSink& sink) const
{
  add_facet_tangents(s, _acting, compliance(), sink);
  return {};
}
} // namespace raymortar
