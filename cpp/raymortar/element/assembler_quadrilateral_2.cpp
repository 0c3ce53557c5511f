#include "raymortar/element/assembler_impl.h"

namespace raymortar
{
template std::unique_ptr<Assembler>
typed_assembler<FacetType<Shape::quadrilateral, 2, 2>, false>(
    const ContactState&);
} // namespace raymortar
