#include "raymortar/nodes/nodal_assembler_impl.h"

namespace raymortar
{
template std::unique_ptr<Assembler>
nodal_assembler_in<2>(const ContactState&,
                      const std::shared_ptr<const NodeFunctions>&);
} // namespace raymortar
