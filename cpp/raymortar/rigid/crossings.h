// Crossings of a line with the surface of a solid, and the one that a ray
// meets.
#pragma once

#include <array>
#include <limits>
#include <optional>

namespace raymortar
{
/// @brief Crossings of a line with a surface, in any order.
struct Crossings
{
  struct Crossing
  {
    double g;      ///< along the line
    bool is_entry; ///< into the solid
  };
  static constexpr int capacity = 4;

  int size = 0;
  std::array<Crossing, capacity> at;

  void add(double g, bool is_entry)
  {
    at[static_cast<std::size_t>(size++)] = {g, is_entry};
  }

  /// @brief The entry that a ray from g = 0 meets: the last crossing behind if
  /// it is one, as the point is inside then; else the first ahead if it is one.
  ///
  /// A point that is inside, but has come through another side, meets nothing.
  [[nodiscard]] std::optional<double> entry() const
  {
    const Crossing* behind = nullptr;
    const Crossing* ahead = nullptr;
    for (int k = 0; k < size; ++k)
    {
      const Crossing& one = at[static_cast<std::size_t>(k)];
      if (one.g < 0.0 and (behind == nullptr or one.g > behind->g))
        behind = &one;
      if (one.g >= 0.0 and (ahead == nullptr or one.g < ahead->g))
        ahead = &one;
    }
    if (behind != nullptr and behind->is_entry)
      return behind->g;
    if (ahead != nullptr and ahead->is_entry)
      return ahead->g;
    return {};
  }

  /// @brief The same of what is outside the solid.
  [[nodiscard]] Crossings turned_inside_out() const
  {
    Crossings other = *this;
    for (Crossing& one : other.at)
      one.is_entry = not one.is_entry;
    return other;
  }
};
} // namespace raymortar
