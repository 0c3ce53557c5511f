#include "raymortar/interface/interface.h"
#include "raymortar/core/error.h"
#include "raymortar/element/excess.h"
#include "raymortar/interface/mortar_term.h"
#include <algorithm>

namespace raymortar
{
namespace
{
/// Fields on the slave by name. Those that scale unknowns or change the search
/// have setters of their own
constexpr std::pair<std::string_view, FacetField ContactState::*> fields[] = {
    {"friction_coefficient", &ContactState::friction_coefficient},
    {"traction_old", &ContactState::traction_old},
};

/// Whether the positions were others before
bool replace(std::vector<double>& positions, std::vector<double> by)
{
  const bool differ = positions != by;
  positions = std::move(by);
  return differ;
}

std::vector<PlacedTool> placed(const InterfaceInput& input)
{
  std::vector<PlacedTool> tools;
  for (const auto& tool : input.tools)
    tools.push_back({tool, {}, {}});
  return tools;
}

const TermFactory& factory_of(const InterfaceInput& input)
{
  static const PointTerms at_points;
  return input.terms ? *input.terms : at_points;
}

/// Nothing moves vertices of whole facets, or of a tie's segments
bool has_moving_segments(const InterfaceInput& input)
{
  return input.moving_segments and factory_of(input).lets_segments_move() and
         (input.tools.empty() or cutter_of(placed(input)));
}

/// Whether the poses were others before
bool replace_poses(std::vector<PlacedTool>& tools, std::span<const Pose> by,
                   Pose PlacedTool::*which)
{
  bool differ = false;
  for (std::size_t k = 0; k < tools.size(); ++k)
  {
    differ = differ or tools[k].*which != by[k];
    tools[k].*which = by[k];
  }
  return differ;
}

ContactState first_state(const InterfaceInput& input)
{
  if (revolves(input.measure) and input.slave.gdim != 2)
    throw Error("a measure of revolution is for surfaces in 2D, not in " +
                std::to_string(input.slave.gdim) + "D");
  ContactState s;
  s.slave = input.slave;
  s.slave.neighbours = find_neighbours(s.slave);
  s.slave.x = s.slave.x_old = s.slave.X;
  const FacetKind master = input.master_kind.value_or(input.slave.kind());
  s.master.shape = master.shape;
  s.master.degree = master.degree;
  s.master.node_degree = master.node_degree;
  s.master.gdim = s.slave.gdim;
  s.tools = placed(input);
  s.multipliers = input.multipliers;
  if (s.multipliers.value.empty())
    s.multipliers.value.assign(
        s.multipliers.row.size() *
            static_cast<std::size_t>(s.multipliers.components),
        0.0);
  s.method = input.method;
  s.friction = input.friction;
  s.measure = input.measure;
  s.frame = input.frame;
  s.keeps_springs = input.keeps_springs;
  s.moving_segments = has_moving_segments(input);
  s.segment_rules = input.segment_rules;
  s.gamma.nodal.assign(input.slave.facet_dofs.size(), 1.0);
  factory_of(input).prepare(s);
  return s;
}
} // namespace

std::vector<std::unique_ptr<Term>> PointTerms::make(const ContactState& s,
                                                    bool moves) const
{
  std::vector<std::unique_ptr<Term>> terms;
  terms.push_back(std::make_unique<MortarTerm>(make_assembler(s), moves));
  terms.push_back(std::make_unique<DampingTerm>());
  terms.push_back(std::make_unique<CoverTerm>(s));
  return terms;
}

Interface::Interface(const InterfaceInput& input)
    : _has_moving_segments(has_moving_segments(input)),
      _state(first_state(input)), _pipeline(input, input.slave.num_facets()),
      _terms(factory_of(input).make(_state, _has_moving_segments))
{
}

void Interface::set_terms(const TermFactory& factory)
{
  _state.condition = Condition::points;
  _state.node_sums = nullptr;
  factory.prepare(_state);
  _terms = factory.make(_state, _has_moving_segments);
  _pipeline.forget_points();
}

/// The result of the first term that has one
template <class Get>
auto& Interface::first(Get&& get) const
{
  for (const auto& term : _terms)
    if (auto* const found = get(*term))
      return *found;
  throw Error("an interface has terms without a law, or without what smooths "
              "its multiplier");
}

const Assembler& Interface::assembler() const
{
  return first([](const Term& term) { return term.assembler(); });
}

DampingTerm& Interface::damping() const
{
  return first([](Term& term) { return term.damping(); });
}

CoverTerm& Interface::cover() const
{
  return first([](Term& term) { return term.cover(); });
}

bool Interface::has_tied() const
{
  return std::any_of(_terms.begin(), _terms.end(),
                     [](const auto& term) { return term->keeps_pairs(); });
}

std::size_t Interface::sums_per_node() const
{
  std::size_t width = 0;
  for (const auto& term : _terms)
    width = std::max(width, term->sums_per_node(_state));
  return width;
}

std::vector<double> Interface::own_node_sums() const
{
  for (const auto& term : _terms)
    if (auto sums = term->own_sums(_state); not sums.empty())
      return sums;
  return {};
}

void Interface::set_node_sums(std::span<const double> sums)
{
  for (const auto& term : _terms)
    term->put_sums(sums, _state);
  for (const auto& term : _terms)
    term->take_sums(_state);
}

Springs Interface::accepted_springs() const
{
  for (const auto& term : _terms)
    if (auto springs = term->accepted_springs(_state))
      return *std::move(springs);
  const PointResults results = assembler().results(_state);
  if (_state.multipliers.components > 0)
    return {accepted_excess(_state, results),
            accepted_elastic_slip(_state, results)};
  return raymortar::accepted_springs(_state, results);
}

void Interface::set_master(Surface master)
{
  _state.master = std::move(master);
  _pipeline.forget_candidates();
}

bool Interface::move_slave(std::span<const double> u)
{
  const bool moved = replace(_state.slave.x, displaced(_state.slave, u));
  if (moved)
    _pipeline.forget_points();
  return moved;
}

bool Interface::move_master(std::span<const double> u)
{
  const bool moved = replace(_state.master.x, displaced(_state.master, u));
  if (moved)
    _pipeline.forget_points();
  return moved;
}

void Interface::set_old_slave(std::span<const double> u)
{
  _state.slave.x_old = displaced(_state.slave, u);
  forget_what_hangs_on_past();
}

void Interface::set_old_master(std::span<const double> u)
{
  _state.master.x_old = displaced(_state.master, u);
  forget_what_hangs_on_past();
}

bool Interface::move_tools(std::span<const Pose> poses)
{
  const bool moved = replace_poses(_state.tools, poses, &PlacedTool::now);
  if (moved)
    _pipeline.forget_points();
  return moved;
}

void Interface::set_old_tools(std::span<const Pose> poses)
{
  replace_poses(_state.tools, poses, &PlacedTool::old);
}

void Interface::set_freedoms(std::vector<Freedom> freedoms)
{
  for (std::size_t k = 0; k < _state.tools.size(); ++k)
    _state.tools[k].tool =
        with_freedom(_state.tools[k].tool, std::move(freedoms[k]));
}

void Interface::forget_what_hangs_on_past()
{
  if (_state.segmentation.hang_on_past or _state.hits.hang_on_past)
    _pipeline.forget_points();
}

void Interface::set_rows(std::span<const GlobalIndex> slave,
                         std::span<const GlobalIndex> multiplier)
{
  _state.slave.rows.assign(slave.begin(), slave.end());
  _state.multipliers.row.assign(multiplier.begin(), multiplier.end());
}

void Interface::set_master_rows(std::vector<GlobalIndex> rows)
{
  _state.master.rows = std::move(rows);
}

void Interface::begin_step(std::span<const double> fixed_slave,
                           const MastersNear& masters_near, double extent)
{
  const StepStart start{_state, _pipeline.rules(), fixed_slave, masters_near,
                        extent};
  for (const auto& term : _terms)
    term->begin_step(start);
}

void Interface::set_multiplier(std::span<const double> values)
{
  _state.multipliers.value.assign(values.begin(), values.end());
}

void Interface::set_unfelt(std::span<const double> parts,
                           std::span<const double> accepted,
                           std::span<const std::int8_t> kept)
{
  damping().set_kept(_state.multipliers, kept);
  _state.multipliers.unfelt.assign(parts.begin(), parts.end());
  _state.multipliers.accepted.assign(accepted.begin(), accepted.end());
}

void Interface::set_gamma(std::span<const double> gamma, double scale,
                          PairFactors factors)
{
  _state.gamma.nodal.assign(gamma.begin(), gamma.end());
  _state.pair_factors = std::move(factors);
  _state.multipliers.scale = scale;
  for (const auto& term : _terms)
    term->take_gamma(_state);
}

bool Interface::set_offset(std::span<const double> offset)
{
  std::vector<double> nodal(offset.begin(), offset.end());
  if (nodal == _state.offset.nodal)
    return false;
  _state.offset.nodal = std::move(nodal);
  const auto per_facet =
      static_cast<std::size_t>(_state.slave.dofs_per_facet());
  const auto facets = static_cast<std::size_t>(_state.slave.num_facets());
  std::vector<double> reach(facets, 0.0), depth(facets, 0.0);
  for (std::size_t k = 0; k < offset.size(); ++k)
  {
    const std::size_t f = k / per_facet;
    reach[f] = std::max(reach[f], -offset[k]);
    depth[f] = std::max(depth[f], offset[k]);
  }
  _pipeline.widen(reach, depth);
  return true;
}

void Interface::set_field(std::string_view name, std::span<const double> values)
{
  const auto* const found =
      std::find_if(std::begin(fields), std::end(fields),
                   [&](const auto& field) { return field.first == name; });
  if (found == std::end(fields))
    throw Error("no field on the slave is named " + std::string(name));
  (_state.*(found->second)).nodal.assign(values.begin(), values.end());
}

void Interface::set_friction_bounds(std::vector<PointBound> bounds)
{
  _state.friction_bounds = std::move(bounds);
}

void Interface::set_crossing(std::span<const std::int8_t> dofs)
{
  damping().set_crossing(find_crossing_facets(_state, dofs, 1.0));
}

void Interface::pair()
{
  if (has_tied())
    return;
  const bool renewed = _pipeline.pair(_state);
  _state.moving_segments =
      _has_moving_segments and
      (not _state.has_tools() or _state.master.num_facets() > 0);
  if (not renewed)
    return;
  for (const auto& term : _terms)
    term->set_up(_state);
}

void Interface::cast()
{
  if (has_tied())
    return;
  // The rays alone move now: the tangent is without the motion of segments
  _state.moving_segments = false;
  _pipeline.cast(_state);
}

PatternNeeds Interface::needs() const
{
  PatternNeeds needs;
  for (const auto& term : _terms)
    term->add_needs(_state, needs);
  return needs;
}
} // namespace raymortar
