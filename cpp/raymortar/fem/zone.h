// A contact zone: the surfaces of one pair and the stages run over them.
#pragma once

#include "raymortar/element/cover.h"
#include "raymortar/fem/halo.h"
#include "raymortar/fem/held_facets.h"
#include <optional>

namespace raymortar
{
/// @brief What a zone is made of. Facets are those owned by this rank.
struct ZoneInput
{
  Surface slave;
  Surface master;
  std::vector<std::int64_t> master_node_ids; ///< global, (master nodes,)
  std::vector<std::int64_t> master_dof_ids;  ///< global, (master dofs,)
  Multipliers multipliers;
  LawKind law = LawKind::augmented_normal;
  FrictionLaw friction;
  bool current_measure = false;
  bool moving_segments = true;
  FacetDistances distances;
  Strategy strategy = Strategy::bvh;
  bool subdivide = false;
  SegmentRules segment_rules;
  QuadratureRule facet_rule;
};

/// @brief Counts and seconds of the last pairing on this rank.
struct ZoneStatistics
{
  std::int64_t slave_facets = 0;
  std::int64_t master_facets = 0; ///< fetched: those within reach of the rank
  std::int64_t candidates = 0;    ///< pairs of the broad phase
  std::int64_t clipped = 0;       ///< patch pairs that were clipped
  std::int64_t pairs = 0;         ///< slave-master elements
  std::int64_t segments = 0;
  std::int64_t points = 0;
  std::int64_t hits = 0;
  std::int64_t degenerate = 0;       ///< slave facets without a usable normal
  std::int64_t candidate_builds = 0; ///< since creation
  std::int64_t pairings = 0;         ///< since creation
  std::int64_t pairings_skipped = 0; ///< nothing had moved; since creation
  std::int64_t halo_builds = 0;      ///< since creation
  std::int64_t bytes_sent = 0;       ///< by this rank since creation
  double seconds_halo = 0.0;
  double seconds_candidates = 0.0;
  double seconds_segments = 0.0;
  double seconds_rays = 0.0;
};

/// @brief What this rank has sent for a zone since its creation.
struct ZoneTraffic
{
  Traffic pairing; ///< to find partners, and facets when the halo is renewed
  Traffic values;  ///< displacements and the like, between renewals
};

/// @brief Blocks of the assemblies since creation, seconds of the last ones.
struct AssemblyStatistics
{
  std::int64_t residual_blocks = 0;
  std::int64_t tangent_blocks = 0;
  std::int64_t lifted_blocks = 0;  ///< tangent blocks for Dirichlet increments
  std::int64_t skipped_blocks = 0; ///< left out of tangents: they are zero
  std::int64_t lookups = 0;        ///< blocks whose places had to be found
  double seconds_residual = 0.0;
  double seconds_tangent = 0.0;
};

/// @brief Runs pairing, segmentation, integration and rays of one pair.
///
/// Members that move data between ranks are collective: set_displacement,
/// set_old_displacement, set_fixed, set_rows and pair.
class Zone
{
public:
  Zone(MPI_Comm comm, ZoneInput input);

  /// @brief Current displacement of the owned dofs, (dofs, gdim) each.
  void set_displacement(std::span<const double> slave,
                        std::span<const double> master);

  /// @brief Displacement of the last accepted step.
  void set_old_displacement(std::span<const double> slave,
                            std::span<const double> master);

  /// @brief Which displacement components are prescribed: nonzero entries.
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

  /// @brief Nodal tractions, (multiplier nodes, components).
  void set_multiplier(std::span<const double> values);

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

  /// @brief Coefficient of Coulomb's or Tresca's law at the slave facets' dofs,
  /// (facets, dofs per facet), in place of its number.
  void set_friction_coefficient(std::span<const double> coefficient);

  /// @brief A friction law that is known at the present points: one each.
  void set_friction_bounds(std::vector<PointBound> bounds);

  /// @brief What friction springs start from, see ContactState;
  /// (slave facets, dofs per facet, gdim); empty: none.
  void set_old_traction(std::span<const double> traction);

  /// @brief What the springs carry on from the present state, as such a field.
  [[nodiscard]] std::vector<double> accepted_springs() const;

  /// @brief All stages at the current displacement; none if nothing has moved
  /// since the last time.
  void pair();

  /// @brief Rays only: points and weights stay where they are on the slave, for
  /// the tangent also, until pair() is called.
  void cast();

  [[nodiscard]] const ContactState& state() const { return _state; }
  [[nodiscard]] const Assembler& assembler() const { return *_assembler; }
  [[nodiscard]] const Segmentation& segmentation() const
  {
    return _state.segmentation;
  }
  [[nodiscard]] const Candidates& candidates() const { return _candidates; }
  [[nodiscard]] const Halo& halo() const { return *_halo; }
  [[nodiscard]] const ZoneInput& input() const { return _input; }
  /// @brief Distances of the input, with what the offset adds.
  [[nodiscard]] const FacetDistances& distances() const { return _distances; }
  [[nodiscard]] ZoneStatistics statistics() const;
  [[nodiscard]] ZoneTraffic traffic() const;

  /// @brief Counts that the assembly functions keep.
  [[nodiscard]] AssemblyStatistics& assembly() { return _assembly; }

  /// @brief Values of the owned master dofs at the dofs of state().master.
  [[nodiscard]] std::vector<double> to_master(std::span<const double> owned,
                                              int width) const
  {
    return _halo->fetch(owned, width);
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

  /// @brief Facets whose multiplier is smoothed. Each is looked at when it has
  /// first met a master in a step and stays for the step, so that residual and
  /// tangent agree.
  [[nodiscard]] const std::vector<FacetBlock>& held_facets();

  [[nodiscard]] const CoverData& cover() const { return _cover; }

private:
  template <int D>
  void update_halo();
  void find_margins();
  template <int D>
  void update_candidates();
  void renew_master();
  void make_points_anew();
  void renew_rays();

  MPI_Comm _comm;
  ZoneInput _input;
  FacetDistances _distances;   ///< with what the offset adds
  FacetDistances _bare;        ///< the same without skin
  double _smallest_skin = 0.0; ///< of this rank's slave facets
  double _halo_margin = 0.0;   ///< of the shortest distances on all ranks
  ContactState _state;
  std::unique_ptr<Assembler> _assembler;
  std::optional<Halo> _halo;
  Candidates _candidates;
  ZoneStatistics _statistics;
  AssemblyStatistics _assembly;
  bool _halo_is_checked = false;    ///< at the present positions
  bool _points_are_present = false; ///< made at the present positions
  bool _rays_are_present = false;
  std::vector<double> _master_u, _master_old, _master_fixed; ///< owned
  std::vector<double> _fixed_slave, _fixed_master;
  double _modulus = 1.0;
  HeldFacets _held;
  CoverData _cover;
  ZoneTraffic _past;              ///< of halos that have been replaced
  std::vector<Index> _part;       ///< of each slave facet
  std::vector<double> _wanted;    ///< parts' boxes the halo was fetched for
  std::vector<double> _master_at; ///< owned master positions at that time
  std::vector<double> _slave_boxes, _master_boxes; ///< candidates hold within
};
} // namespace raymortar
