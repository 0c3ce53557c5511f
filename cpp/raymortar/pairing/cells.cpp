#include "raymortar/pairing/cells.h"
#include <algorithm>
#include <array>
#include <cmath>

namespace raymortar
{
namespace
{
/// Boxes that a cell is made for, and that a group has at most: by measurement
constexpr double boxes_per_cell = 16.0;
constexpr std::size_t largest_group = 32;

/// Bits of a key that one pass of the sort looks at
constexpr int digit_bits = 11;

struct Entry
{
  std::uint32_t key;
  Index box;
};

/// The number's bits, D places apart
template <int D>
std::uint32_t spread(std::uint32_t number, int bits)
{
  std::uint32_t result = 0;
  for (int i = 0; i < bits; ++i)
    result |= ((number >> i) & 1u) << (D * i);
  return result;
}

/// Bits per axis that give a surface of n boxes its cells
template <int D>
int bits_for(std::size_t n)
{
  const double cells = std::max(1.0, static_cast<double>(n) / boxes_per_cell);
  const int bits = static_cast<int>(std::ceil(std::log2(cells) / (D - 1)));
  return std::clamp(bits, 1, 32 / D);
}

/// Keys of the cells that the boxes' centres are in
template <int D>
std::vector<Entry> entries_of(std::span<const Box<D>> boxes, int bits)
{
  Box<D> all;
  for (const Box<D>& box : boxes)
    all.merge(box);
  const double extent = (all.upper - all.lower).maxCoeff();
  const double last = std::ldexp(1.0, bits) - 1.0;
  const bool has_extent = extent > 0.0 and std::isfinite(extent);
  const double scale = has_extent ? (last + 1.0) / extent : 0.0;
  std::vector<Entry> entries;
  entries.reserve(boxes.size());
  for (const Box<D>& box : boxes)
  {
    Entry entry{0, static_cast<Index>(entries.size())};
    const Vec<D> x = scale * (0.5 * (box.lower + box.upper) - all.lower);
    for (int i = 0; i < D; ++i)
      // False for what is not a number, too
      if (x[i] > 0.0)
        entry.key |=
            spread<D>(static_cast<std::uint32_t>(std::min(x[i], last)), bits)
            << i;
    entries.push_back(entry);
  }
  return entries;
}

/// Radix sort by the keys; boxes of one key keep their order
void sort_by_key(std::vector<Entry>& entries, int key_bits)
{
  constexpr std::size_t digits = std::size_t{1} << digit_bits;
  std::vector<Entry> sorted(entries.size());
  for (int shift = 0; shift < key_bits; shift += digit_bits)
  {
    const auto digit = [shift](const Entry& e)
    { return (e.key >> shift) & (digits - 1); };
    std::array<std::size_t, digits + 1> begin{};
    for (const Entry& e : entries)
      ++begin[digit(e) + 1];
    for (std::size_t d = 0; d < digits; ++d)
      begin[d + 1] += begin[d];
    for (const Entry& e : entries)
      sorted[begin[digit(e)]++] = e;
    entries.swap(sorted);
  }
}
} // namespace

template <int D>
BoxGroups group_by_cells(std::span<const Box<D>> boxes)
{
  const int bits = bits_for<D>(boxes.size());
  std::vector<Entry> entries = entries_of<D>(boxes, bits);
  sort_by_key(entries, D * bits);
  BoxGroups groups;
  groups.order.reserve(entries.size());
  for (std::size_t i = 0; i < entries.size(); ++i)
  {
    const bool full = i - groups.offsets.back() == largest_group;
    if (i > 0 and (full or entries[i].key != entries[i - 1].key))
      groups.offsets.push_back(i);
    groups.order.push_back(entries[i].box);
  }
  if (not entries.empty())
    groups.offsets.push_back(entries.size());
  return groups;
}

template BoxGroups group_by_cells<2>(std::span<const Box<2>>);
template BoxGroups group_by_cells<3>(std::span<const Box<3>>);
} // namespace raymortar
