// Sums of rows in plain loops: Eigen's expressions of such sizes are stored and
// loaded once more than they need be.
#pragma once

#include "raymortar/core/types.h"
#include <array>

namespace raymortar
{
/// @brief A row of numbers and what it is multiplied by.
struct Term
{
  double factor;
  const double* row;
};

/// @brief Add the terms to a row of C numbers, which is read and written once.
template <int C, class... Terms>
void add_rows(double* __restrict row, const Terms&... terms)
{
  for (int k = 0; k < C; ++k)
    row[k] += (... + (terms.factor * terms.row[k]));
}
} // namespace raymortar
