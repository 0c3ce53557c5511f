// Search distances of slave facets.
#pragma once

#include "raymortar/core/types.h"
#include <span>
#include <utility>
#include <vector>

namespace raymortar
{
/// @brief Distances of one slave facet. Lengths.
struct SearchDistances
{
  double reach = 0.0; ///< largest gap that counts, along the slave normal
  double depth = 0.0; ///< largest penetration that counts, against it
  double skin = 0.0;  ///< margin that candidates stay valid for
};

/// @brief Distances of all slave facets: the same for every one, or each its
/// own.
class FacetDistances
{
public:
  FacetDistances() = default;
  // A set of distances is one for all facets
  // NOLINTNEXTLINE(google-explicit-constructor)
  FacetDistances(const SearchDistances& all) : _all(all) {}
  FacetDistances(double reach, double depth, double skin = 0.0)
      : _all{reach, depth, skin}
  {
  }
  /// @param[in] each One per slave facet
  /// @param[in] is_default Whether nobody has asked for this depth: what lies
  /// behind the surfaces limits it then
  FacetDistances(std::vector<SearchDistances> each, bool is_default)
      : _each(std::move(each)), _is_local(true), _is_default(is_default)
  {
  }

  [[nodiscard]] const SearchDistances& operator[](Index slave) const
  {
    return _is_local ? _each[static_cast<std::size_t>(slave)] : _all;
  }
  [[nodiscard]] bool depth_is_default() const { return _is_default; }

  /// @brief The same with more reach and depth, (slave facets,) each.
  [[nodiscard]] FacetDistances widened(std::span<const double> reach,
                                       std::span<const double> depth) const
  {
    FacetDistances result = *this;
    result._each.clear();
    result._is_local = true;
    for (std::size_t f = 0; f < reach.size(); ++f)
    {
      const SearchDistances& own = (*this)[static_cast<Index>(f)];
      result._each.push_back(
          {own.reach + reach[f], own.depth + depth[f], own.skin});
    }
    return result;
  }

  /// @brief The same without skin.
  [[nodiscard]] FacetDistances bare() const
  {
    FacetDistances result = *this;
    result._all.skin = 0.0;
    for (SearchDistances& one : result._each)
      one.skin = 0.0;
    return result;
  }

private:
  SearchDistances _all;
  std::vector<SearchDistances> _each;
  bool _is_local = false;
  bool _is_default = false;
};
} // namespace raymortar
