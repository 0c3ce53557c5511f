// Rows of a matrix, with the columns of the blocks that they are in.
#pragma once

#include "raymortar/core/sorted.h"
#include <algorithm>
#include <cstdint>
#include <petscsys.h>
#include <span>
#include <utility>
#include <vector>

namespace raymortar
{
using Columns = std::vector<PetscInt>;

/// @brief Rows of the matrix that contact adds to, each with the blocks it is
/// in.
class ContactRows
{
public:
  void add(std::span<const PetscInt> block) { add(block, block); }

  void add(std::span<const PetscInt> rows, std::span<const PetscInt> block)
  {
    const auto begin = static_cast<std::int64_t>(_columns.size());
    _columns.insert(_columns.end(), block.begin(), block.end());
    for (const PetscInt row : rows)
      _entries.push_back({row, begin, static_cast<std::int32_t>(block.size())});
  }

  /// @brief Sort: all blocks of a row follow each other.
  void sort()
  {
    std::sort(_entries.begin(), _entries.end(),
              [](const Entry& a, const Entry& b) {
                return std::pair{a.row, a.begin} < std::pair{b.row, b.begin};
              });
  }

  /// @brief Calls fn(row, sorted unique columns) for each row.
  template <class Fn>
  void for_each_row(Fn&& fn) const
  {
    Columns columns;
    for (std::size_t i = 0; i < _entries.size();)
    {
      const PetscInt row = _entries[i].row;
      columns.clear();
      for (; i < _entries.size() and _entries[i].row == row; ++i)
      {
        const auto from = _columns.begin() + _entries[i].begin;
        columns.insert(columns.end(), from, from + _entries[i].size);
      }
      sort_unique(columns);
      fn(row, columns);
    }
  }

private:
  struct Entry
  {
    PetscInt row;
    std::int64_t begin;
    std::int32_t size;
  };
  std::vector<PetscInt> _columns;
  std::vector<Entry> _entries;
};
} // namespace raymortar
