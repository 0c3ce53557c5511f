#include "raymortar/element/assembler_impl.h"

namespace raymortar
{
template std::unique_ptr<Assembler>
typed_assembler<FacetType<Shape::interval, 1, 1>, false>(const ContactState&);
template std::unique_ptr<Assembler>
typed_assembler<FacetType<Shape::interval, 1, 1>, true>(const ContactState&);
} // namespace raymortar
