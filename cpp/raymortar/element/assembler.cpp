#include "raymortar/element/general_assembler.h"
#include "raymortar/element/typed_assembler.h"
#include "raymortar/geometry/dispatch.h"

namespace raymortar
{
std::unique_ptr<Assembler> make_assembler(const ContactState& s)
{
  if (s.has_tools() or s.slave.kind() != s.master.kind() or
      s.slave.degree != s.slave.node_degree or s.frame == LawFrame::master or
      s.has_law_at_nodes())
    return make_general_assembler(s);
  return with_geometry(s.slave,
                       [&s]<class F>(F) { return assembler_for<F>(s); });
}
} // namespace raymortar
