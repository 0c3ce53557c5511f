#include "raymortar/nodes/nodal_assembler.h"

namespace raymortar
{
std::unique_ptr<Assembler>
make_nodal_assembler(const ContactState& s,
                     std::shared_ptr<const NodeFunctions> functions)
{
  require_degree(s);
  return s.slave.gdim == 2 ? nodal_assembler_in<2>(s, functions)
                           : nodal_assembler_in<3>(s, functions);
}
} // namespace raymortar
