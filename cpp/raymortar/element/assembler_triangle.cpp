#include "raymortar/element/assembler_impl.h"

namespace raymortar
{
std::unique_ptr<Assembler> triangle_assembler(const ContactState& s,
                                              LawKind law)
{
  return assembler_of_shape<Shape::triangle>(s, law);
}
} // namespace raymortar
