// Terms of contact: each adds to residual and tangent.
#pragma once

#include "raymortar/element/springs.h"
#include "raymortar/interface/step_start.h"
#include "raymortar/interface/unknowns.h"
#include <optional>

namespace raymortar
{
class CoverTerm;
class DampingTerm;

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

  /// @brief Called when points and rays are others.
  virtual void set_up(ContactState&) {}

  /// @brief Whether nothing that moves changes the pairs any more.
  [[nodiscard]] virtual bool keeps_pairs() const { return false; }

  /// @brief Called when the coefficient is another.
  virtual void take_gamma(const ContactState&) {}

  /// @brief Kernel of the law; null: the term has none.
  [[nodiscard]] virtual const Assembler* assembler() const { return nullptr; }

  /// @brief What smooths multipliers, to be told of moduli and nodes; null: the
  /// term does not.
  [[nodiscard]] virtual DampingTerm* damping() { return nullptr; }
  [[nodiscard]] virtual CoverTerm* cover() { return nullptr; }

  /// @brief How many sums the term has at each node of the multiplier.
  [[nodiscard]] virtual std::size_t sums_per_node(const ContactState&) const
  {
    return 0;
  }
  /// @brief What facets give to these, (nodes, sums per node), to be added over
  /// all zones and ranks that share a node; empty: nothing.
  [[nodiscard]] virtual std::vector<double> own_sums(const ContactState&) const
  {
    return {};
  }
  /// @brief Put the sums of all zones and ranks into the state.
  virtual void put_sums(std::span<const double>, ContactState&) const {}
  /// @brief Called when the state has other sums.
  virtual void take_sums(const ContactState&) {}

  /// @brief What the friction springs carry on, see Zone; none: the springs of
  /// points do.
  [[nodiscard]] virtual std::optional<Springs>
  accepted_springs(const ContactState&) const
  {
    return {};
  }
};

/// @brief Makes the terms of an interface.
class TermFactory
{
public:
  virtual ~TermFactory() = default;

  /// @brief Set what the terms ask of the state, once.
  virtual void prepare(ContactState&) const {}

  /// @brief Whether segments move with the bodies.
  [[nodiscard]] virtual bool lets_segments_move() const { return true; }

  /// @param[in] moves Whether tangents include the motion of segments
  [[nodiscard]] virtual std::vector<std::unique_ptr<Term>>
  make(const ContactState& s, bool moves) const = 0;
};
} // namespace raymortar
