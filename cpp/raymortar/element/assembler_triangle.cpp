#include "raymortar/element/assembler_impl.h"

namespace raymortar
{
std::unique_ptr<Assembler> triangle_assembler(const ContactState& s)
{
  return assembler_of_shape<Shape::triangle>(s);
}
} // namespace raymortar
