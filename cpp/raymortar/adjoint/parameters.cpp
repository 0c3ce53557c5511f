#include "raymortar/adjoint/parameters.h"
#include "raymortar/dual/dual_term.h"

namespace raymortar
{
namespace
{
/// Functions of a law at nodes, null: shape functions
const NodeFunctions* functions_of(const Interface& of)
{
  for (const auto& term : of.terms())
    if (const auto* dual = dynamic_cast<const DualTerm*>(term.get()))
      return &dual->functions();
  return nullptr;
}
} // namespace

void by_parameter(const Interface& of, const Parameter& by, MatrixSink& sink)
{
  const ContactState& s = of.state();
  const BlockSink add = [&](std::size_t e, const double* block, int)
  {
    const Unknowns unknowns =
        element_unknowns(s.elements.slave[e], s.master_of(e));
    sink.add(unknowns, unknowns, block);
  };
  if (s.slave.gdim == 2)
    parameter_blocks<2>(s, by, functions_of(of), add);
  else
    parameter_blocks<3>(s, by, functions_of(of), add);
}
} // namespace raymortar
