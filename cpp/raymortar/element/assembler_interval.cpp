#include "raymortar/element/assembler_impl.h"

namespace raymortar
{
std::unique_ptr<Assembler> interval_assembler(const ContactState& s)
{
  return assembler_of_shape<Shape::interval>(s);
}
} // namespace raymortar
