// Fluxes of a scalar field between the sides of contact: heat, charge,
// moisture.
#pragma once

#include "raymortar/element/assembler.h"

namespace raymortar
{
/// @brief A scalar field on the facets of one side, turned outward as these.
struct FluxSide
{
  int degree = 1;                    ///< 1 or 2
  std::span<const double> values;    ///< (facets, nodes per facet)
  std::span<const GlobalIndex> rows; ///< of the coupled system, likewise
};

/// @brief The field on both sides of a zone.
struct FluxFields
{
  FluxSide slave;
  FluxSide master;   ///< on ContactState::master; nothing where there are tools
  double tool = 0.0; ///< value on rigid tools
};

/// @brief What the law of a flux takes, at the points with a hit.
struct FluxPoints
{
  std::vector<Index> point;     ///< index among all points
  std::vector<double> slave;    ///< field on the slave
  std::vector<double> target;   ///< on what is hit
  std::vector<double> pressure; ///< of the traction that acts, >= 0
  std::vector<double> gap;      ///< of the law, with the offset. Length
  std::vector<double> slip;     ///< length of T_n w of the step
  std::vector<double> work;     ///< of friction in the step, per area
  std::vector<double> weight;   ///< area that a point stands for
};

/// @brief The flux at these points, in their order.
struct FluxValues
{
  std::span<const double> q; ///< from the slave to the target, per area
  /// By both fields, pressure, gap and slip, (n, 5); tangents only
  std::span<const double> slopes;
  /// Along the slave facet where none of these changes, (n, gdim - 1); empty:
  /// none
  std::span<const double> along;
  double slave_heat = 0.0; ///< share of the work that the slave takes, per time
  double target_heat = 0.0; ///< the same of what is hit
};

/// @brief Entries of a vector or a matrix; the same may occur again.
struct FluxEntries
{
  std::vector<GlobalIndex> rows;
  std::vector<GlobalIndex> columns; ///< of matrices
  std::vector<double> values;
};

/// @throw Error for a degree that is neither 1 nor 2
[[nodiscard]] FluxPoints flux_points(const ContactState& s,
                                     const FluxFields& fields);

/// @brief Residual of the field's equation  [theory (7.1)].
[[nodiscard]] FluxEntries flux_residual(const ContactState& s,
                                        const FluxFields& fields,
                                        const FluxValues& flux);

/// @brief Its tangent by the field, the displacement, the multiplier and free
/// tools, with segments that move  [theory (7.4)].
[[nodiscard]] FluxEntries flux_tangent(const ContactState& s,
                                       const FluxFields& fields,
                                       const FluxValues& flux);
} // namespace raymortar
