#include "bind.h"
#include "raymortar/dual/dual_term.h"
#include "raymortar/ties/tie_term.h"
#include "structs.h"
#include "zone_arguments.h"

namespace raymortar::bindings
{
namespace
{
FacetDistances make_distances(const Array<double>& reach,
                              const Array<double>& depth,
                              const Array<double>& skin, bool depth_is_default)
{
  std::vector<SearchDistances> each;
  for (py::ssize_t f = 0; f < reach.size(); ++f)
    each.push_back({reach.at(f), depth.at(f), skin.at(f)});
  return {std::move(each), depth_is_default};
}

/// What a free body's motion hangs on, from arrays over its unknowns: (n, 3),
/// (n, 3, 3), (n, n, 3, 3) and (n,)
Freedom make_freedom(const Array<double>& centre, const Array<double>& drift,
                     const Array<double>& spin, const Array<double>& bend,
                     const Array<GlobalIndex>& rows)
{
  using Rows = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  Freedom freedom;
  freedom.centre = Eigen::Map<const Vec<3>>(centre.data());
  const auto n = static_cast<std::size_t>(rows.size());
  for (std::size_t j = 0; j < n; ++j)
  {
    freedom.rates.push_back({Eigen::Map<const Vec<3>>(drift.data() + 3 * j),
                             Eigen::Map<const Rows>(spin.data() + 9 * j)});
    freedom.rows.push_back(rows.data()[j]);
  }
  for (std::size_t k = 0; k < n * n; ++k)
    freedom.bends.push_back(Eigen::Map<const Rows>(bend.data() + 9 * k));
  return freedom;
}
} // namespace

std::shared_ptr<const TermFactory> contact_terms(Condition condition, bool dual,
                                                 const Multipliers& multipliers)
{
  if (condition == Condition::points or multipliers.components == 0)
    return std::make_shared<PointTerms>();
  if (dual)
    return std::make_shared<DualTerms>();
  return std::make_shared<NodeTerms>();
}

ZoneInput with_terms(const ZoneArguments& given)
{
  ZoneInput input = given;
  input.find_pairs = function_of(given.strategy);
  if (given.tie)
    input.terms = std::make_shared<TieTerms>(*given.tie);
  else
    input.terms = contact_terms(given.condition, given.dual_multiplier,
                                given.multipliers);
  return input;
}

void bind_zone_input(py::module_& m)
{
  py::enum_<Measure>(m, "Measure")
      .value("reference", Measure::reference)
      .value("current", Measure::current)
      .value("reference_of_revolution", Measure::reference_of_revolution)
      .value("current_of_revolution", Measure::current_of_revolution);
  py::enum_<LawFrame>(m, "LawFrame")
      .value("automatic", LawFrame::automatic)
      .value("slave", LawFrame::slave)
      .value("master", LawFrame::master);
  py::enum_<Condition>(m, "Condition")
      .value("points", Condition::points)
      .value("nodes", Condition::nodes);
  py::enum_<Method>(m, "Method")
      .value("augmented_lagrangian", Method::augmented_lagrangian)
      .value("penalty", Method::penalty);
  py::enum_<TieGap>(m, "TieGap")
      .value("keep", TieGap::keep)
      .value("close", TieGap::close);
  py::class_<Coulomb>(m, "Coulomb")
      .def(py::init<double>(), py::arg("mu"))
      .def_readwrite("elastic_slip", &Coulomb::elastic_slip);
  py::class_<Tresca>(m, "Tresca").def(py::init<double>(), py::arg("bound"));
  py::class_<Stick>(m, "Stick").def(py::init<>());
  py::class_<PointBound>(m, "PointBound").def(py::init<>());
  py::enum_<Strategy>(m, "Strategy")
      .value("brute_force", Strategy::brute_force)
      .value("bvh", Strategy::bvh)
      .value("pang", Strategy::pang);
  bind_options<PairFactors>(m, "PairFactors",
                            Field{"slaves", &PairFactors::slaves},
                            Field{"masters", &PairFactors::masters},
                            Field{"factors", &PairFactors::factors})
      .def(py::init<>());
  py::class_<FacetDistances>(m, "SearchDistances")
      .def(py::init<double, double, double>(), py::arg("reach"),
           py::arg("depth"), py::arg("skin"))
      .def(py::init(&make_distances), py::kw_only(), py::arg("reach"),
           py::arg("depth"), py::arg("skin"), py::arg("depth_is_default"));
  bind_options<PairFilter>(m, "PairFilter",
                           Field{"offsets", &PairFilter::offsets},
                           Field{"neighbours", &PairFilter::neighbours});
  bind_options<ZoneArguments>(
      m, "ZoneInput", Field{"slave", &ZoneInput::slave},
      Field{"master", &ZoneInput::master}, Field{"tools", &ZoneInput::tools},
      Field{"master_node_ids", &ZoneInput::master_node_ids},
      Field{"master_dof_ids", &ZoneInput::master_dof_ids},
      Field{"multipliers", &ZoneInput::multipliers},
      Field{"dual_multiplier", &ZoneArguments::dual_multiplier},
      Field{"method", &ZoneInput::method},
      Field{"condition", &ZoneArguments::condition},
      Field{"friction", &ZoneInput::friction},
      Field{"measure", &ZoneInput::measure}, Field{"frame", &ZoneInput::frame},
      Field{"keeps_springs", &ZoneInput::keeps_springs},
      Field{"moving_segments", &ZoneInput::moving_segments},
      Field{"tie", &ZoneArguments::tie},
      Field{"distances", &ZoneInput::distances},
      Field{"strategy", &ZoneArguments::strategy},
      Field{"subdivide", &ZoneInput::subdivide},
      Field{"segment_rules", &ZoneInput::segment_rules},
      Field{"facet_rule", &ZoneInput::facet_rule},
      Field{"filter", &ZoneInput::filter});
  py::class_<Freedom>(m, "Freedom")
      .def(py::init<>())
      .def(py::init(&make_freedom), py::kw_only(), py::arg("centre"),
           py::arg("drift"), py::arg("spin"), py::arg("bend"), py::arg("rows"));
}
} // namespace raymortar::bindings
