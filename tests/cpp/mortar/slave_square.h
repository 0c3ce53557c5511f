// Corners of the facets that tests of planes, overlaps and layers work on.
#pragma once

#include "raymortar/core/types.h"
#include <array>

namespace raymortar::test
{
template <int D>
using Corners = std::array<Vec<D>, 4>;

inline const Corners<2> slave_reference = {Vec<2>(0, 0), Vec<2>(1, 0),
                                           Vec<2>(1, 1), Vec<2>(0, 1)};
inline const Corners<3> slave_square = {Vec<3>(0, 0, 0), Vec<3>(1, 0, 0),
                                        Vec<3>(1, 1, 0), Vec<3>(0, 1, 0)};
} // namespace raymortar::test
