// Blocks that act on the multipliers of single slave facets.
#pragma once

#include "raymortar/element/facet_block.h"
#include "raymortar/interface/term.h"

namespace raymortar
{
/// @brief Tractions of a slave facet, node after node.
/// @param[in] nodes How many a facet has
void facet_tractions(const Multipliers& m, Index facet, std::size_t nodes,
                     std::vector<double>& values);

/// @brief Add - factor lam . B mu of each facet to a residual.
void add_facet_residuals(const ContactState& s,
                         std::span<const FacetBlock> facets, double factor,
                         VectorSink& sink);

/// @brief Add its derivative.
void add_facet_tangents(const ContactState& s,
                        std::span<const FacetBlock> facets, double factor,
                        MatrixSink& sink);
} // namespace raymortar
