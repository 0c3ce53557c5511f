// A contact zone: an interface whose facets are spread over ranks.
#pragma once

#include "raymortar/fem/halo.h"
#include "raymortar/interface/interface.h"
#include <optional>

namespace raymortar
{
/// @brief What a zone is made of. Facets are those owned by this rank.
struct ZoneInput : InterfaceInput
{
  Surface master;
  std::vector<std::int64_t> master_node_ids; ///< global, (master nodes,)
  std::vector<std::int64_t> master_dof_ids;  ///< global, (master dofs,)
};

/// @brief Counts and seconds of the last pairing on this rank.
struct ZoneStatistics : PipelineStatistics
{
  std::int64_t slave_facets = 0;
  std::int64_t master_facets = 0; ///< fetched: those within reach of the rank
  std::int64_t candidates = 0;    ///< pairs of the broad phase
  std::int64_t clipped = 0;       ///< patch pairs that were clipped
  std::int64_t pairs = 0;         ///< slave-master elements
  std::int64_t segments = 0;
  std::int64_t points = 0;
  std::int64_t hits = 0;
  std::int64_t degenerate = 0;  ///< slave facets without a usable normal
  std::int64_t halo_builds = 0; ///< since creation
  std::int64_t bytes_sent = 0;  ///< by this rank since creation
  double seconds_halo = 0.0;
};

/// @brief Calls visit(name, value) for every field.
template <class Visit>
constexpr void for_each_field(const ZoneStatistics& s, Visit&& visit)
{
  for_each_field(static_cast<const PipelineStatistics&>(s), visit);
  visit("slave_facets", s.slave_facets);
  visit("master_facets", s.master_facets);
  visit("candidates", s.candidates);
  visit("clipped", s.clipped);
  visit("pairs", s.pairs);
  visit("segments", s.segments);
  visit("points", s.points);
  visit("hits", s.hits);
  visit("degenerate", s.degenerate);
  visit("halo_builds", s.halo_builds);
  visit("bytes_sent", s.bytes_sent);
  visit("seconds_halo", s.seconds_halo);
}

/// @brief What this rank has sent for a zone since its creation.
struct ZoneTraffic
{
  Traffic pairing; ///< to find partners, and facets when the halo is renewed
  Traffic values;  ///< displacements and the like, between renewals
};

/// @brief Calls visit(name, value) for every field.
template <class Visit>
constexpr void for_each_field(const ZoneTraffic& t, Visit&& visit)
{
  visit("pairing_messages", t.pairing.messages);
  visit("pairing_bytes", t.pairing.bytes);
  visit("value_messages", t.values.messages);
  visit("value_bytes", t.values.bytes);
}

/// @brief An interface over the ranks: fetches the master facets that this
/// rank's slave facets may meet, and what is known at their dofs.
///
/// Members that move data between ranks are collective: the constructor,
/// set_displacement, set_old_displacement, set_fixed, set_rows and pair.
class Zone
{
public:
  Zone(MPI_Comm comm, ZoneInput input);

  /// @brief Current displacement of the owned dofs, (dofs, gdim) each.
  void set_displacement(std::span<const double> slave,
                        std::span<const double> master);

  /// @brief Displacement of the last accepted step: another one starts, and
  /// the terms decide for it.
  void set_old_displacement(std::span<const double> slave,
                            std::span<const double> master);

  /// @brief Where the tools are now; where they were at the accepted step, to
  /// be set before the old displacement. One each.
  void set_poses(std::span<const Pose> poses)
  {
    _has_node_sums = false;
    _interface.move_tools(poses);
  }
  void set_old_poses(std::span<const Pose> poses)
  {
    _has_node_sums = false;
    _interface.set_old_tools(poses);
  }

  /// @brief Set the motions of free tools at their present place, with the
  /// poses. One for each tool.
  void set_freedoms(std::vector<Freedom> freedoms)
  {
    _interface.set_freedoms(std::move(freedoms));
  }

  /// @brief Which displacement components are prescribed: nonzero entries.
  /// The terms decide anew for the step.
  void set_fixed(std::span<const double> slave, std::span<const double> master);

  /// @brief Other rows of the coupled system: the user solves for more than
  /// was known. Collective.
  /// @param[in] slave, master Of each owned displacement component,
  /// (dofs, gdim)
  /// @param[in] multiplier First row of each node, (multiplier nodes,)
  void set_rows(std::span<const GlobalIndex> slave,
                std::span<const GlobalIndex> master,
                std::span<const GlobalIndex> multiplier);

  /// @brief Modulus of the softer body, which scales what smooths the
  /// multiplier next to held nodes. Stress.
  void set_modulus(double modulus);

  /// @brief Shear modulus of the softer body, which scales what ties the
  /// multiplier of partly covered facets; 0: not known. Stress.
  void set_shear_modulus(double modulus);

  /// @brief Which multiplier nodes are covered on any rank, (nodes,). Where it
  /// is not set after `pair`, those are taken that facets of this rank cover.
  void set_covered_nodes(std::span<const std::int8_t> covered);

  /// @brief Which multiplier nodes other zones have as well, with other
  /// normals: corners between surfaces.
  void set_corner_nodes(std::span<const std::int8_t> corners);

  /// @brief Slave dofs of a tie that take part in other ties or contacts too,
  /// nonzero, (dofs,). Paired before. The terms decide anew for the step.
  void set_crossing(std::span<const std::int8_t> dofs);

  /// @brief Nodal tractions, (multiplier nodes, components).
  void set_multiplier(std::span<const double> values);

  /// @brief Set the parts of nodal tractions that no equilibrium determines in
  /// this step, and the accepted tractions  [theory (5.22)].
  /// @param[in] parts Matrices, (multiplier nodes, gdim, gdim); empty: none
  /// @param[in] accepted (multiplier nodes, gdim)
  /// @param[in] kept Nonzero for components in which nothing is free there,
  /// (multiplier nodes, gdim)
  void set_unfelt(std::span<const double> parts,
                  std::span<const double> accepted,
                  std::span<const std::int8_t> kept)
  {
    _interface.set_unfelt(parts, accepted, kept);
  }

  /// @brief See Interface::set_terms.
  void set_terms(const TermFactory& factory)
  {
    _interface.set_terms(factory);
    _has_node_sums = false;
  }

  /// @brief Augmentation coefficient at the slave facets' dofs,
  /// (facets, dofs per facet), and the traction per unit of the unknown.
  /// @param[in] factors Of gamma by the bodies of a slave and a master facet
  void set_gamma(std::span<const double> gamma, double scale,
                 PairFactors factors = {});

  /// @brief What is added to gaps at the slave facets' dofs, (facets, dofs per
  /// facet); empty: nothing. Length.
  ///
  /// A clearance, > 0, lets surfaces overlap by as much: rays look so much
  /// deeper. An overlap, < 0, is seen from so much farther.
  void set_offset(std::span<const double> offset);

  /// @brief Other fields on the slave, see Interface.
  void set_field(std::string_view name, std::span<const double> values);

  /// @brief A friction law that is known at the present points: one each.
  void set_friction_bounds(std::vector<PointBound> bounds);

  /// @brief The same at nodes at which the law holds.
  void set_node_bounds(std::vector<PointBound> bounds);

  /// @brief Where a law at nodes is linearised from now on.
  void set_node_changes(NodeChanges changes);
  /// @brief The same of laws at points.
  void set_point_changes(std::vector<double> changes);

  /// @brief Whether the law holds at nodes, and what it is made of is to be
  /// summed anew: something has changed since `set_node_sums`.
  [[nodiscard]] bool lacks_node_sums() const
  {
    return state().has_law_at_nodes() and not _has_node_sums;
  }
  /// @brief Set the sums of all zones and ranks that share nodes.
  void set_node_sums(std::span<const double> sums);

  /// @brief What the friction springs carry on from the present state, as the
  /// field "traction_old" of the next step, (slave facets, dofs per facet,
  /// gdim).
  [[nodiscard]] Springs accepted_springs() const;

  /// @brief Whether friction makes couples over gaps, see ContactState.
  void set_couples_over_gaps(bool set)
  {
    _interface.set_couples_over_gaps(set);
  }

  /// @brief What springs hold at points, as `accepted_springs` gives it.
  void set_spring_points(SpringPoints points)
  {
    _interface.set_spring_points(std::move(points));
  }

  /// @brief All stages at the current displacement; none if nothing has moved
  /// since the last time, or if a tie has its pairs.
  void pair();

  /// @brief Rays only: points and weights stay where they are on the slave, for
  /// the tangent also, until pair() is called.
  void cast();

  [[nodiscard]] const Interface& interface() const { return _interface; }
  [[nodiscard]] const ContactState& state() const { return _interface.state(); }
  [[nodiscard]] const Assembler& assembler() const
  {
    return _interface.assembler();
  }
  [[nodiscard]] const Segmentation& segmentation() const
  {
    return state().segmentation;
  }
  [[nodiscard]] const Candidates& candidates() const
  {
    return _interface.pipeline().candidates();
  }
  /// @brief Facets of other ranks; none where there are tools
  [[nodiscard]] const Halo& halo() const { return *_halo; }
  [[nodiscard]] const ZoneInput& input() const { return _input; }
  /// @brief Distances of the input, with what the offset adds.
  [[nodiscard]] const FacetDistances& distances() const
  {
    return _interface.pipeline().rules().distances;
  }
  [[nodiscard]] ZoneStatistics statistics() const;
  [[nodiscard]] ZoneTraffic traffic() const;

  /// @brief Values of the owned master dofs at the dofs of state().master.
  [[nodiscard]] std::vector<double> to_master(std::span<const double> owned,
                                              int width) const
  {
    return _halo ? _halo->fetch(owned, width) : std::vector<double>();
  }

  /// @brief Values of the owned master facets, (facets, width), at the facets
  /// of state().master. Collective.
  template <class T>
  [[nodiscard]] std::vector<T> to_master_facets(std::span<const T> owned,
                                                int width) const
  {
    return _halo ? _halo->fetch_facets(owned, width) : std::vector<T>();
  }

  /// Nonzero where a displacement component is prescribed, (dofs, gdim)
  [[nodiscard]] const std::vector<double>& fixed_slave() const
  {
    return _fixed_slave;
  }
  [[nodiscard]] const std::vector<double>& fixed_master() const
  {
    return _fixed_master;
  }

  /// @brief Facets whose multiplier is smoothed in this step.
  [[nodiscard]] const std::vector<FacetBlock>& held_facets() const
  {
    return _interface.damping().facets();
  }

  /// @brief Components of the traction that no free displacement feels in this
  /// step: nonzero, (slave facets, gdim). Without a multiplier empty.
  [[nodiscard]] const std::vector<std::int8_t>& unfelt() const
  {
    return _interface.damping().unfelt();
  }

private:
  void find_margin();
  void find_extent();
  void begin_step();
  template <int D>
  [[nodiscard]] Masters masters_near(const Surface& slave,
                                     const FacetDistances& distances);
  template <int D>
  void update_halo();
  void renew_master();

  MPI_Comm _comm;
  ZoneInput _input;
  Interface _interface;
  double _halo_margin = 0.0; ///< of the shortest distances on all ranks
  double _extent = 0.0;      ///< of the surfaces on all ranks
  std::optional<Halo> _halo;
  std::int64_t _halo_builds = 0;
  double _seconds_halo = 0.0;
  bool _halo_is_checked = false; ///< at the present positions
  bool _has_node_sums = false;   ///< of the present state
  std::vector<double> _master_u, _master_old, _master_fixed; ///< owned
  std::vector<double> _fixed_slave, _fixed_master;
  ZoneTraffic _past;              ///< of halos that have been replaced
  std::vector<Index> _part;       ///< of each slave facet
  KeptBoxes _wanted;              ///< parts' boxes the halo was fetched for
  std::vector<double> _master_at; ///< owned master positions at that time
};
} // namespace raymortar
