#include "raymortar/element/assembler_impl.h"
#include "raymortar/element/general_assembler.h"

namespace raymortar
{
std::unique_ptr<Assembler> make_assembler(const ContactState& s)
{
  if (s.has_tools() or s.slave.kind() != s.master.kind() or
      s.slave.degree != s.slave.node_degree or s.frame == LawFrame::master or
      s.has_law_at_nodes())
    return make_general_assembler(s);
  switch (s.slave.shape)
  {
  case Shape::interval:
    return interval_assembler(s);
  case Shape::triangle:
    return triangle_assembler(s);
  case Shape::quadrilateral:
    return quadrilateral_assembler(s);
  }
  throw Error("unknown facet shape");
}
} // namespace raymortar
