// Derivatives of contact's residual by what it depends on besides the unknowns.
#pragma once

#include "raymortar/adjoint/parameter.h"
#include "raymortar/interface/interface.h"
#include "raymortar/nodes/node_functions.h"

namespace raymortar
{
/// @brief Give the derivatives of an interface's residual by a parameter, in
/// the columns of displacements  [theory (8.6)]. Of the law's integrals alone:
/// what smooths a multiplier does not depend on parameters, but for undeformed
/// positions.
void by_parameter(const Interface& of, const Parameter& by, MatrixSink& sink);

/// @brief The blocks of all elements, in dimension D; each has its own unit.
/// @param[in] functions See `make_nodal_assembler`
template <int D>
void parameter_blocks(const ContactState& s, const Parameter& by,
                      const NodeFunctions* functions, const BlockSink& sink);
} // namespace raymortar
