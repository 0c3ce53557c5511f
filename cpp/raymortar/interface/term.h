// Terms of contact: each adds to residual and tangent.
#pragma once

#include "raymortar/element/assembler.h"
#include "raymortar/interface/step_start.h"
#include "raymortar/interface/unknowns.h"

namespace raymortar
{
/// @brief Takes blocks of a residual.
class VectorSink
{
public:
  virtual ~VectorSink() = default;

  /// @param[in] values One per unknown, (size,)
  virtual void add(const Unknowns& rows, std::span<const double> values) = 0;
};

/// @brief Takes blocks of a tangent.
class MatrixSink
{
public:
  virtual ~MatrixSink() = default;

  /// @brief Whether blocks with these columns are used: others need not be
  /// computed.
  [[nodiscard]] virtual bool wants(const Unknowns& columns) const = 0;

  /// @param[in] block Row-major, (rows, columns)
  virtual void add(const Unknowns& rows, const Unknowns& columns,
                   const double* block) = 0;
};

/// @brief Facets whose unknowns meet in blocks. Those of one slave facet meet
/// each other anyway.
struct PatternNeeds
{
  struct Pair
  {
    Index slave;
    Index master;
  };
  /// Two masters whose unknowns meet, and the slave facet that makes them
  struct Coupling
  {
    Index slave;
    Index first;
    Index second;
  };
  std::vector<Pair> pairs;
  std::vector<Coupling> couplings;
};

/// @brief Elements of one assembly: those computed, and those left out because
/// their blocks are zero.
struct Work
{
  std::int64_t computed = 0;
  std::int64_t skipped = 0;
};

/// @brief One share of the contact forces and of the multiplier's equation.
///
/// A term takes its decisions in `begin_step` from the accepted configuration
/// and keeps them until the next call. So residual and tangent are functions of
/// the present state, whatever was computed before.
class Term
{
public:
  virtual ~Term() = default;

  /// @brief Called when a step has been accepted, and when other displacement
  /// components are prescribed. All ranks call it, with or without facets.
  virtual void begin_step(const StepStart&) {}

  /// @brief Append the facets whose unknowns meet in the tangent's blocks.
  virtual void add_needs(const ContactState&, PatternNeeds&) const {}

  virtual Work residual(const ContactState& s, VectorSink& sink) const = 0;
  virtual Work tangent(const ContactState& s, MatrixSink& sink) const = 0;

  /// @brief Derivatives of the residual by a parameter, in the columns of
  /// displacements.
  virtual void by_parameter(const ContactState&, const Parameter&,
                            MatrixSink&) const
  {
  }
};
} // namespace raymortar
