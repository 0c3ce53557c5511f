// Masters that move the vertices of a segment.
#pragma once

#include "raymortar/mortar/segmentation.h"

namespace raymortar
{
/// @brief Call visit(master) once for each master facet that vertices of a
/// segment move with: its own, and those of nearer layers.
template <class Visit>
void visit_movers(const Segmentation& s, const Segment& of, Visit&& visit)
{
  const auto breaks = s.breaks_of(of);
  for (auto one = breaks.begin(); one != breaks.end(); ++one)
    if (one->moves() and std::none_of(breaks.begin(), one,
                                      [one](const Break& before) {
                                        return before.moves() and
                                               before.master == one->master;
                                      }))
      visit(one->master);
}
} // namespace raymortar
