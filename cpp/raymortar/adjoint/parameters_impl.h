// Element loops of derivatives by parameters, in one dimension; units
// parameters_*.cpp instantiate them.
#pragma once

#include "raymortar/adjoint/parameter_element.h"
#include "raymortar/adjoint/parameters.h"
#include "raymortar/nodes/nodal_assembler_impl.h"

namespace raymortar
{
/// @tparam Points As of AssemblerOf
template <int D, class Law, class Points>
void add_parameter_blocks(const ContactState& s, const Parameter& by,
                          const typename Points::Functions* functions,
                          const BlockSink& sink)
{
  using Kernel = ParameterElement<D, Law, typename Points::Kernel>;
  const auto kernel = std::make_unique<Kernel>(by);
  const auto points = std::make_unique<Points>(s,
                                               Wanted{.old = is_frictional<Law>,
                                                      .target = true,
                                                      .bends = true,
                                                      .along = true},
                                               functions);
  points->prepare();
  for (std::size_t e = 0; e < s.elements.size(); ++e)
  {
    points->take(e);
    kernel->clear_tangent(points->shapes.size());
    for_points(*points, e,
               [&](std::size_t)
               { kernel->add(*points, s.elements.master[e]); });
    sink(e, kernel->A.data(), points->shapes.size());
  }
}

template <int D>
void parameter_blocks(const ContactState& s, const Parameter& by,
                      const NodeFunctions* functions, const BlockSink& sink)
{
  if (s.has_law_at_nodes())
    with_nodal_law(s,
                   [&]<class Law>() {
                     add_parameter_blocks<D, Law, NodalPoints<D, Law>>(
                         s, by, functions, sink);
                   });
  else
    with_law(s,
             [&]<class Law>() {
               add_parameter_blocks<D, Law, PointsOf<D, Law>>(s, by, nullptr,
                                                              sink);
             });
}
} // namespace raymortar
