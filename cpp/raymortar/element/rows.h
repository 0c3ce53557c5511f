// Sums of rows of an element's tangent.
#pragma once

#include "raymortar/core/types.h"

namespace raymortar
{
/// @brief A row of numbers and what it is multiplied by.
struct ScaledRow
{
  double factor;
  const double* row;
};

/// @brief Add the terms to a row of C numbers, which is read and written once.
/// Not by a loop: compilers cannot tell that the rows do not overlap, and fall
/// back to one number at a time.
template <int C, class... Terms>
void add_rows(double* row, const Terms&... terms)
{
  using Row = Eigen::Matrix<double, 1, C>;
  Eigen::Map<Row>{row} +=
      (... + (terms.factor * Eigen::Map<const Row>(terms.row)));
}
} // namespace raymortar
