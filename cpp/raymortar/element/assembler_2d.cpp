#include "raymortar/element/assembler_impl.h"

namespace raymortar
{
template std::unique_ptr<Assembler> assembler_in<2>(const ContactState&);
} // namespace raymortar
