#include "raymortar/element/assembler_impl.h"
#include "raymortar/element/general_assembler.h"

namespace raymortar
{
std::unique_ptr<Assembler> make_assembler(const ContactState& s, LawKind law)
{
  if (not s.slave.is_of_kind(s.master))
    return make_general_assembler(s, law);
  switch (s.slave.shape)
  {
  case Shape::interval:
    return interval_assembler(s, law);
  case Shape::triangle:
    return triangle_assembler(s, law);
  case Shape::quadrilateral:
    return quadrilateral_assembler(s, law);
  }
  throw Error("unknown facet shape");
}
} // namespace raymortar
