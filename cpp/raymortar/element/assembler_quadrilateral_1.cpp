#include "raymortar/element/assembler_impl.h"

namespace raymortar
{
template std::unique_ptr<Assembler>
typed_assembler<FacetType<Shape::quadrilateral, 1, 1>, false>(
    const ContactState&);
template std::unique_ptr<Assembler>
typed_assembler<FacetType<Shape::quadrilateral, 1, 1>, true>(
    const ContactState&);
} // namespace raymortar
