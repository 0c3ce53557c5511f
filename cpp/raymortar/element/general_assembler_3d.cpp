#include "raymortar/element/general_assembler_impl.h"

namespace raymortar
{
template std::unique_ptr<Assembler>
general_assembler_in<3>(const ContactState&,
                        const std::shared_ptr<const DualField>&);
} // namespace raymortar
