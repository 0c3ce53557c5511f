// Coefficients of a zone whose slave facets face several bodies.
#pragma once

#include "raymortar/core/types.h"
#include <algorithm>
#include <vector>

namespace raymortar
{
/// @brief What share of a slave facet's coefficient counts against each body.
struct PairFactors
{
  std::vector<Index> slaves;   ///< bodies of the slave surface, ascending
  std::vector<Index> masters;  ///< bodies of the master surface, ascending
  std::vector<double> factors; ///< (slaves, masters); empty: 1 for all pairs

  [[nodiscard]] double of(Index slave, Index master) const
  {
    if (factors.empty())
      return 1.0;
    return factors[place(slaves, slave) * masters.size() +
                   place(masters, master)];
  }

private:
  [[nodiscard]] static std::size_t place(const std::vector<Index>& bodies,
                                         Index body)
  {
    return static_cast<std::size_t>(
        std::lower_bound(bodies.begin(), bodies.end(), body) - bodies.begin());
  }
};
} // namespace raymortar
