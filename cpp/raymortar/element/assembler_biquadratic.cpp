#include "raymortar/element/assembler_impl.h"

namespace raymortar
{
template std::unique_ptr<Assembler>
assembler_for<FacetType<Shape::quadrilateral, 2, 2>>(const ContactState&);
} // namespace raymortar
