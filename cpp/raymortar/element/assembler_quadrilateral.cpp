#include "raymortar/element/assembler_impl.h"

namespace raymortar
{
std::unique_ptr<Assembler> quadrilateral_assembler(const ContactState& s)
{
  return assembler_of_shape<Shape::quadrilateral>(s);
}
} // namespace raymortar
