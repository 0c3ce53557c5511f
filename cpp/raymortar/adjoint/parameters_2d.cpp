#include "raymortar/adjoint/parameters_impl.h"

namespace raymortar
{
template void parameter_blocks<2>(const ContactState&, const Parameter&,
                                  const NodeFunctions*, const BlockSink&);
} // namespace raymortar
