#include "raymortar/element/assembler_impl.h"

namespace raymortar
{
std::unique_ptr<Assembler> interval_assembler(const ContactState& s,
                                              LawKind law)
{
  return assembler_of_shape<Shape::interval>(s, law);
}
} // namespace raymortar
