// One integration point of the contact state as an element takes it.
#pragma once

#include "raymortar/element/assembler.h"
#include "raymortar/element/element.h"

namespace raymortar
{
template <class F>
[[nodiscard]] ElementPoint<F> element_point(const ContactState& s,
                                            std::size_t q)
{
  return {s.points.xi[q].template head<F::tdim>(),
          s.hits.eta[q].template head<F::tdim>(),
          s.points.weight[q],
          s.points.area[q],
          s.hits.gap[q],
          s.friction_bounds.empty() ? PointBound{} : s.friction_bounds[q]};
}
} // namespace raymortar
