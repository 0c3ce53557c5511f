// Lists without repetition.
#pragma once

#include <algorithm>
#include <vector>

namespace raymortar
{
/// @brief Sort values and drop those that are there more than once.
template <class T>
void sort_unique(std::vector<T>& values)
{
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
}
} // namespace raymortar
