// The kernel of laws that hold at nodes.
#pragma once

#include "raymortar/element/assembler.h"
#include "raymortar/nodes/node_sums.h"

namespace raymortar
{
/// @brief Element kernels of a law that holds at nodes.
class NodalAssembler
{
public:
  virtual ~NodalAssembler() = default;

  /// @brief What points give to the nodes at which the law holds.
  [[nodiscard]] virtual NodeSums node_sums(const ContactState& s) const = 0;
};

/// @brief As make_assembler, of a law that holds at nodes: a NodalAssembler
/// too.
[[nodiscard]] std::unique_ptr<Assembler>
make_nodal_assembler(const ContactState& s,
                     std::shared_ptr<const FacetTractions> tractions = nullptr);

/// @brief That in dimension D; each has its own unit.
template <int D>
[[nodiscard]] std::unique_ptr<Assembler>
nodal_assembler_in(const ContactState& s,
                   const std::shared_ptr<const FacetTractions>& tractions);
} // namespace raymortar
