// Derivatives along a path through friction springs, step by step backwards.
#pragma once

#include "raymortar/adjoint/parameter.h"
#include "raymortar/interface/interface.h"

namespace raymortar
{
/// @brief Springs that a step hands on.
struct SpringsOfStep
{
  std::vector<Index> number;       ///< of each integration point, see springs.h
  std::span<const double> weights; ///< (spring points, 2 gdim); empty: zero
};

/// @brief Factors of the residual's rows, (dofs, gdim) of each side.
struct AdjointOfStep
{
  std::span<const double> slave, master;
};

/// @brief Whether the law of an interface has friction springs whose
/// derivatives are known: those of a penalty.
[[nodiscard]] bool has_known_springs(const Interface& of);

/// @brief Give minus the derivative of weights times what springs hold at the
/// end of a step  [theory (8.13)].
/// @param[in] weights (spring points, 2 gdim)
void springs_by_parameter(const Interface& of, const Parameter& by,
                          std::span<const double> weights, VectorSink& sink);

/// @brief Weights of what springs held at the step's start  [theory (8.10)].
/// @param[in] weights Of what they hold at its end
[[nodiscard]] std::vector<double> springs_back(const Interface& of,
                                               const AdjointOfStep& adjoint,
                                               std::span<const double> weights);

/// @brief The first rows of the blocks of all elements, and of couplings, in
/// dimension D; each has its own unit.
template <int D>
void held_by_parameter(const ContactState& s, const Parameter& by,
                       const SpringsOfStep& springs, const BlockSink& sink,
                       const CouplingSink& couplings);

/// @brief Weights of the field that springs held, at the integration points, in
/// dimension D.
template <int D>
[[nodiscard]] std::vector<double>
weights_of_field(const ContactState& s, const SpringsOfStep& springs,
                 const AdjointOfStep& adjoint);
} // namespace raymortar
