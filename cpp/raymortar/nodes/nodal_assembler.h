// The kernel of laws that hold at nodes.
#pragma once

#include "raymortar/element/assembler.h"
#include "raymortar/nodes/node_functions.h"
#include "raymortar/nodes/node_sums.h"

namespace raymortar
{
/// @brief Element kernels of a law that holds at nodes.
class NodalAssembler
{
public:
  virtual ~NodalAssembler() = default;

  /// @brief What points give to the nodes at which the law holds.
  /// @param[out] tested Gaps and slips of each facet, which `NodeSums` are then
  /// without; null: all is in those
  [[nodiscard]] virtual NodeSums node_sums(const ContactState& s,
                                           FacetIntegrals* tested) const = 0;
};

/// @brief As make_assembler, of a law that holds at nodes: a NodalAssembler
/// too.
/// @param[in] functions In place of the shape functions of the multiplier,
/// whenever it assembles; null: those
[[nodiscard]] std::unique_ptr<Assembler>
make_nodal_assembler(const ContactState& s,
                     std::shared_ptr<const NodeFunctions> functions = nullptr);

/// @brief That in dimension D; each has its own unit.
template <int D>
[[nodiscard]] std::unique_ptr<Assembler>
nodal_assembler_in(const ContactState& s,
                   const std::shared_ptr<const NodeFunctions>& functions);
} // namespace raymortar
