// All contacts, ties and free bodies of a problem: what an iterate asks for.
#pragma once

#include "raymortar/fem/assembly.h"
#include "raymortar/fem/node_exchange.h"
#include "raymortar/system/coupled_values.h"
#include <memory>

namespace raymortar
{
/// @brief A zone of the system. Its objects outlive the system.
struct SystemZone
{
  Zone* zone = nullptr;
  BlockPositions* positions = nullptr;
  AssemblyStatistics* statistics = nullptr;
  std::size_t contact = 0;          ///< number of its contact
  std::vector<Index> slave, master; ///< dofs of the displacement, block-wise
  std::vector<Index> nodes;         ///< of its contact's multiplier
  std::vector<MovedBody*> bodies;   ///< that it meets, in their order
};

/// @brief Rows of the coupled system that are judged together.
struct RowGroups
{
  std::vector<Index> of_row; ///< group of each row of this rank
  std::size_t count = 0;
  std::vector<double> mass; ///< area of each multiplier row
  /// Fields of the user's unknowns: indices among their local values. Empty:
  /// there is one field
  std::vector<std::vector<Index>> fields;
};

/// @brief Prescribed minus present values of the user's unknowns, 0 where
/// nothing is prescribed.
struct Lacking
{
  std::span<const std::int8_t> fixed; ///< nonzero: a condition prescribes it
  std::span<const double> owned;      ///< of this rank's rows
  std::span<const double> increment;  ///< of local values, without rounding
  std::span<const double> of_u;       ///< of the displacement's local dofs
  std::span<const double> values;     ///< present local values
};

/// @brief Sums and largest values that tell how far an iterate is from a
/// solution.
struct Norms
{
  std::vector<double> residual; ///< norm of the free rows, by group
  std::vector<double> forces;   ///< norm of the forces in balance, by group
  std::vector<double> lacking;  ///< largest prescribed increment, by field
  std::vector<double> sizes;    ///< largest value, by field
};

/// @brief The contact of a problem as its solver's iterations see it.
///
/// Zones are fed with what stays during a step through their own members.
/// Every member is collective.
class ContactSystem
{
public:
  /// @param[in] u Displacement of this rank's dofs; if it is a Function by
  /// itself, `values` fills it
  ContactSystem(std::vector<SystemZone> zones, std::span<const double> u,
                CoupledValues& values);

  /// @brief Take over an iterate: values of all Functions, of multipliers and
  /// of free bodies.
  /// @param[in] scales By what multipliers are divided among the unknowns
  /// @param[in] anew Also where x is the last iterate
  /// @return Whether anything has changed
  bool set_unknowns(PetscVector x, std::span<const double> scales, bool anew);

  /// @brief Whether displacement and multipliers are finite on all ranks.
  [[nodiscard]] bool is_finite() const;

  /// @brief Whether displacement or multipliers differ, on any rank, from those
  /// of the last `pair`.
  [[nodiscard]] bool has_moved() const;

  /// @brief Whether the displacement is another one's on all ranks.
  [[nodiscard]] bool is_at(std::span<const double> u) const;

  /// @brief Whether loads or prescribed positions of rigid bodies differ, on
  /// any rank, from those that the last call has seen.
  [[nodiscard]] bool loads_changed();

  /// @brief Hand displacements, multipliers and bodies to the zones, and pair
  /// those that are no ties.
  /// @param[in] rays_only Keep integration points, cast their rays anew
  void pair(bool rays_only);

  /// @brief Add the residual of contact and the forces on free bodies.
  void add_residual(PetscVector b) const;

  /// @brief Set b to the volume's rows and what `add_residual` adds, lift the
  /// prescribed increments, and assemble.
  /// @param[in] volume Of this rank's rows of the user's unknowns
  /// @param[in] contact Whether contact's forces are added
  /// @return Norms by group of rows
  Norms residual(PetscVector b, std::span<const double> volume,
                 const Lacking& lacking, bool contact) const;

  /// @brief b <- b - alpha * (constrained columns) * increment.
  void lift(PetscVector b, std::span<const double> increment,
            double alpha) const;

  /// @brief Add the tangent of contact. The caller assembles A.
  void add_tangent(PetscMatrix A) const;

  /// @brief What facets of all zones and ranks give to the multiplier's nodes
  /// of a contact at the last `pair`, (local nodes, width); empty: nothing.
  [[nodiscard]] std::span<const double> node_sums(std::size_t contact) const;

  /// @brief Number of local nodes of a contact's multiplier.
  [[nodiscard]] std::size_t nodes(std::size_t contact) const
  {
    return _values.multipliers()[contact].rows.size();
  }

  void set_groups(RowGroups groups) { _groups = std::move(groups); }

  /// @brief Norms of a residual by group of rows.
  /// @param[in] b Values of this rank's rows
  /// @param[in] volume Residual of the user's form, with constrained rows
  [[nodiscard]] Norms norms(std::span<const double> b,
                            std::span<const double> volume,
                            const Lacking& lacking) const;

private:
  [[nodiscard]] std::vector<double> present() const;
  void refresh_nodes() const;
  void sum_nodes(std::size_t contact) const;
  void send(const SystemZone& zone) const;
  void send_bodies(const SystemZone& zone) const;

  MPI_Comm _comm;
  std::vector<SystemZone> _zones;
  std::span<const double> _u;
  CoupledValues& _values;
  std::vector<double> _last;      ///< iterate
  std::vector<double> _paired_at; ///< displacement and multipliers
  std::vector<double> _loads; ///< of all bodies, as `loads_changed` saw them
  RowGroups _groups;
  /// Exchanges of contacts whose law holds at nodes, made at the first use
  mutable std::vector<std::unique_ptr<NodeExchange>> _exchanges;
  mutable std::vector<std::vector<double>> _sums; ///< of their local nodes
};
} // namespace raymortar
