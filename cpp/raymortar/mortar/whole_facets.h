// Segments that are whole slave facets: what faces them has no edges.
#pragma once

#include "raymortar/mortar/segmentation.h"

namespace raymortar
{
/// @brief One segment per slave facet, of master 0, whose vertices do not move
/// on the facet.
[[nodiscard]] Segmentation whole_facets(const Surface& slave);
} // namespace raymortar
