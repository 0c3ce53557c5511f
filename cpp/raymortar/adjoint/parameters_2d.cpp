#include "raymortar/adjoint/parameters_impl.h"
#include "raymortar/adjoint/springs_impl.h"

namespace raymortar
{
template void parameter_blocks<2>(const ContactState&, const Parameter&,
                                  const NodeFunctions*, const BlockSink&);
template void held_by_parameter<2>(const ContactState&, const Parameter&,
                                   const SpringsOfStep&, const BlockSink&,
                                   const CouplingSink&);
template std::vector<double> weights_of_field<2>(const ContactState&,
                                                 const SpringsOfStep&,
                                                 const AdjointOfStep&);
} // namespace raymortar
