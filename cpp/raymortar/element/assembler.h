// From the state of a contact zone to dense element blocks.
#pragma once

#include "raymortar/element/facet_field.h"
#include "raymortar/element/measure.h"
#include "raymortar/element/pair_factors.h"
#include "raymortar/element/spring_points.h"
#include "raymortar/law/friction.h"
#include "raymortar/law/point_law.h"
#include "raymortar/mortar/elements.h"
#include "raymortar/target/tool.h"
#include <functional>
#include <memory>
#include <optional>
#include <span>

namespace raymortar
{
/// @brief How contact is enforced. Whether there is friction, and by which law,
/// is another choice.
enum class Method
{
  augmented_lagrangian,
  penalty
};

/// @brief Where a law with a multiplier holds: at integration points in the
/// weak mean (4), or at the multiplier's nodes for the means around them
/// (4.23).
enum class Condition : std::int8_t
{
  points,
  nodes
};

/// @brief Multiplier unknowns of a zone's slave facets.
struct Multipliers
{
  int degree = 0;               ///< 0: no multiplier
  int components = 0;           ///< 0, 1 or gdim
  std::vector<Index> facet;     ///< (facets, multipliers per facet)
  std::vector<GlobalIndex> row; ///< first row of each multiplier node
  std::vector<double> value;    ///< nodal traction, (nodes, components)
  double scale = 1.0;           ///< traction per unit of the solver's unknown
  /// Parts that no equilibrium determines, by which friction carries on from
  /// the accepted step: matrices, (nodes, gdim, gdim); empty: none
  /// [theory (5.22)]
  std::vector<double> unfelt;
  std::vector<double> accepted; ///< nodal traction, (nodes, gdim), with these

  /// Nodes of each facet, where there are facets
  [[nodiscard]] std::size_t per_facet(Index facets) const
  {
    return facets > 0 ? facet.size() / static_cast<std::size_t>(facets) : 0;
  }
  [[nodiscard]] std::span<const Index> nodes_of(Index of,
                                                std::size_t per_facet) const
  {
    return std::span(facet).subspan(static_cast<std::size_t>(of) * per_facet,
                                    per_facet);
  }
};

/// @brief Normal by which the law splits tractions  [theory (2.14)]:
/// automatically the master's on flat tools without edges, else the slave's.
enum class LawFrame : std::int8_t
{
  automatic,
  slave,
  master
};

class NodeSums;

/// @brief Where a law at nodes is linearised, other than at the present state.
struct NodeChanges
{
  /// Changes from the present state, node by node: of the multiplier, and of
  /// the mean gap along the normal less the mean slip along the surface,
  /// (nodes, components + gdim). Empty: none
  std::vector<double> values;
  /// Whether rows are integrals of gap and slip times gamma, in place of a law
  bool measures = false;
};

/// @brief Everything the element stage reads.
struct ContactState
{
  Surface slave;
  /// With tools: the tool facets that have cut slave facets. They have no
  /// unknowns; `body` is the tool
  Surface master;
  std::vector<PlacedTool> tools;
  Multipliers multipliers;
  Method method = Method::augmented_lagrangian;
  Condition condition = Condition::points; ///< with a multiplier only
  std::optional<FrictionLaw> friction;     ///< none: frictionless
  Measure measure = Measure::reference;
  LawFrame frame = LawFrame::automatic;
  /// Whether slip within the cone is kept from step to step, as springs keep
  /// it; false: friction takes its work, too
  bool keeps_springs = true;
  /// Whether friction makes a couple over the gaps that a multiplier leaves
  /// open at single points; false: over those of an offset only
  bool couples_over_gaps = false;
  bool moving_segments = false; ///< differentiate through the vertices, too
  FacetField gamma;             ///< traction per length
  PairFactors pair_factors;     ///< of gamma, where a master is hit
  FacetField offset;            ///< added to gaps, > 0: a clearance. Length
  /// In place of the number of Coulomb's or Tresca's law; empty: that number
  FacetField friction_coefficient;
  /// Bound of a friction law that is known at points only, (points,); empty:
  /// none
  std::vector<PointBound> friction_bounds;
  std::vector<PointBound> node_bounds; ///< the same at nodes; empty: none
  NodeChanges node_changes;
  /// Laws at points are linearised at the present state plus these changes: of
  /// the multiplier, and of the gap along the normal less the slip across it,
  /// (points, 2 gdim). Empty: at the present state
  std::vector<double> point_changes;
  /// Accepted tangential traction of the friction springs: of the elastic
  /// penalty as it is; with a multiplier what the law has more than it, over
  /// gamma; of a law at nodes the length that ties took, at the first dofs. Of
  /// width gdim; empty: none
  FacetField traction_old;
  /// The rest of traction_old at points. With a multiplier: elastic slip at
  /// points, or at the nodes of each facet. Empty: nothing
  SpringPoints spring_points;
  Segmentation segmentation;
  SegmentRules segment_rules;
  IntegrationPoints points;
  Hits hits;
  ContactElements elements;
  /// Of all zones and ranks that share nodes; null: not known, or not needed
  std::shared_ptr<const NodeSums> node_sums;

  /// Whether the law holds at nodes
  [[nodiscard]] bool has_law_at_nodes() const
  {
    return condition == Condition::nodes and multipliers.components > 0;
  }

  /// Whether friction gives a part of the slip back
  [[nodiscard]] bool has_elastic_slip() const
  {
    return friction and elastic_slip_of(*friction) > 0.0;
  }

  /// Whether slaves meet tools, which are no facets and have no unknowns
  [[nodiscard]] bool has_tools() const { return not tools.empty(); }

  /// Whether the law takes the normal of what a point has hit
  [[nodiscard]] bool has_frame_of_target(std::size_t q) const
  {
    return frame == LawFrame::master or
           (frame == LawFrame::automatic and has_tools() and hits.flat[q] != 0);
  }

  /// Master facet whose unknowns an element has, no_index: none
  [[nodiscard]] Index master_of(std::size_t element) const
  {
    return has_tools() ? no_index : elements.master[element];
  }
};

/// @brief Pointwise results of the law, for output and statistics.
struct PointResults
{
  std::vector<ContactStatus> status;
  std::vector<double> gap;      ///< of the law: with the offset. Length
  std::vector<double> pressure; ///< normal traction p of the law, <= 0
  std::vector<double> traction; ///< t of (3), (points, gdim)
  std::vector<double> weight;   ///< area each point stands for
  std::vector<double> x;        ///< deformed slave positions, (points, gdim)
  std::vector<double> normal;   ///< of the slave, (points, gdim)
  /// Normal of the law's frame (2.14), (points, gdim)
  std::vector<double> contact_normal;
  /// Normal of the target, zero at points without a hit, (points, gdim)
  std::vector<double> master_normal;
  std::vector<double> gamma; ///< of the law. Traction per length
  std::vector<double> slip;  ///< T_n w of (2), (points, gdim); friction only
  /// Closed part c of an open gap (2), (points,); friction only
  std::vector<double> closing;
  /// Tangential traction of the law at its points, of which a multiplier is
  /// the mean, (points, gdim); friction only
  std::vector<double> friction;
  /// Energy per area that friction takes in the step, (points,); friction only
  std::vector<double> dissipated;
  /// Elastic slip of a law that has it, along the traction, (points, gdim);
  /// empty: none. Length
  std::vector<double> elastic_slip{};
  /// Energy per area that it stores, (points,); empty: none
  std::vector<double> elastic_energy{};
};

/// Takes an element's block: residual (size,) or tangent (size, size) row-major
using BlockSink =
    std::function<void(std::size_t element, const double* block, int size)>;

/// Takes the coupling of an element with a master (or free tool) that the
/// element does not hit, but that moves vertices of its segments: a block of
/// the slave facet with this master, (size, size) row-major, and the rows of
/// the master that the element hits in the columns of this one, row-major, or
/// nullptr without a hit. Moving segments only
using CouplingSink =
    std::function<void(std::size_t element, Index master, const double* block,
                       int size, const double* hit_rows)>;

/// @brief Element kernels of one law.
///
/// One virtual call per zone. Kernels work on Taylor polynomials at each point;
/// what they give is multiplied with the shape functions of both sides.
class Assembler
{
public:
  virtual ~Assembler() = default;

  /// @brief Residual blocks of all elements.
  virtual void residual(const ContactState& s, const BlockSink& sink) const = 0;

  /// @brief Tangent blocks of the chosen elements. Couplings come before the
  /// block of their element, with moving segments only.
  virtual void tangent(const ContactState& s,
                       std::span<const std::size_t> elements,
                       const BlockSink& sink,
                       const CouplingSink& couplings) const = 0;

  /// @brief The law's results at every point.
  [[nodiscard]] virtual PointResults results(const ContactState& s) const = 0;
};

/// @brief Tractions at the nodes of each facet, (facets, multipliers per facet,
/// components), for multipliers that are not shared between facets.
using FacetTractions = std::vector<double>;

/// @brief Assembler for the multipliers, method and friction of `s`, whose law
/// holds at points. Facets and target may be of any kinds.
/// @throws Error for a combination that does not exist
[[nodiscard]] std::unique_ptr<Assembler> make_assembler(const ContactState& s);

/// @throws Error for a multiplier that is not stable
void require_degree(const ContactState& s);

/// @brief Assembler in dimension D; each has its own unit.
template <int D>
[[nodiscard]] std::unique_ptr<Assembler> assembler_in(const ContactState& s);

/// @brief Slip T_n w of (2) at the points of a contact without friction, which
/// otherwise does not need it, (points, gdim). Length.
[[nodiscard]] std::vector<double> slips_without_friction(ContactState s);
} // namespace raymortar
