#include "raymortar/element/assembler_units.h"
#include "raymortar/element/general_assembler.h"
#include "raymortar/geometry/dispatch.h"

namespace raymortar
{
namespace
{
/// @throws Error for a multiplier that is not stable with the displacement
void check_multiplier(const ContactState& s)
{
  const Multipliers& m = s.multipliers;
  const int most = s.slave.gdim == 2 ? s.slave.degree : 1;
  if (m.components == 0 or (1 <= m.degree and m.degree <= most))
    return;
  throw Error("multiplier of degree " + std::to_string(m.degree) +
              " on facets with displacement of degree " +
              std::to_string(s.slave.degree) +
              ": 2D takes up to the displacement's degree, 3D takes 1");
}

/// Whether slave and master are facets of one kind with displacements of the
/// degree of positions, and their law is at points in the slave's frame
bool may_have_typed(const ContactState& s)
{
  return not s.has_tools() and s.slave.kind() == s.master.kind() and
         s.slave.degree == s.slave.node_degree and
         s.frame != LawFrame::master and not s.has_law_at_nodes();
}

/// Null where there is none
std::unique_ptr<Assembler> find_typed(const ContactState& s)
{
  if (not may_have_typed(s))
    return nullptr;
  return with_geometry(s.slave,
                       [&s]<class F>(F) -> std::unique_ptr<Assembler>
                       {
                         if (not s.friction)
                           return typed_assembler<F, false>(s);
                         if constexpr (has_typed_friction<F>)
                           return typed_assembler<F, true>(s);
                         return nullptr;
                       });
}
} // namespace

std::unique_ptr<Assembler> make_assembler(const ContactState& s)
{
  check_multiplier(s);
  std::unique_ptr<Assembler> typed = find_typed(s);
  return typed ? std::move(typed) : make_general_assembler(s);
}
} // namespace raymortar
