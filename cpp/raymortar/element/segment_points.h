// Points and weights of one segment as functions of its vertices.
#pragma once

#include "raymortar/element/assembler.h"
#include "raymortar/mortar/flat_map.h"

namespace raymortar
{
/// @brief How the integral over a segment changes with its vertices.
///
/// Points are laid on tiles of the segment, in the plane in which its sides are
/// straight; with the vertices in that plane move place and measure of each
/// [theory (3.8)].
template <class F>
class SegmentPoints
{
public:
  static constexpr int T = F::tdim;
  using Flat = Vec<T>;
  /// Most vertices, and the mean of the core after all of them
  static constexpr std::size_t capacity = Tiles::capacity;
  static constexpr auto centre = static_cast<std::size_t>(Tiles::centre);

  /// @brief Take vertices and tiles of a segment.
  void take(const Segmentation& s, const Segment& segment,
            const FlatMap<F>& map)
  {
    for (std::size_t v = 0; v < static_cast<std::size_t>(segment.size); ++v)
    {
      const auto k = static_cast<std::size_t>(segment.begin) + v;
      _y[v] = map.to_flat(s.vertices[k].template head<T>());
    }
    if constexpr (T == 2)
    {
      _tiles = s.tiles(segment);
      if (_tiles.has_centre())
        _y[centre] = mean_of_core(_tiles, _y);
    }
  }

  [[nodiscard]] bool has_centre() const
  {
    return T == 2 and _tiles.has_centre();
  }

  /// @brief Call give(vertex, share) for the vertices of the core, whose mean
  /// the centre is: what is summed for the centre is theirs.
  template <class Give>
  void share_centre(Give&& give) const
  {
    if (not has_centre())
      return;
    for (int v = 0; v < _tiles.core_size; ++v)
      give(static_cast<std::size_t>(_tiles.core[static_cast<std::size_t>(v)]),
           1.0 / static_cast<double>(_tiles.core_size));
  }

  /// @brief Call visit(vertex, N, dJ) for the vertices that move a point: N is
  /// the derivative of its position y by the vertex, dJ the derivative of its
  /// measure, (1, T).
  /// @param[in] place Index of the point in the segment, tile by tile: the rule
  /// of append_on_polygon, and the index in that rule
  template <class Visit>
  void visit(const SegmentRules& rules, std::size_t place, Visit&& visit) const
  {
    if constexpr (T == 1)
      visit_corners<Shape::interval>(rules.simplex, place, {0, 1}, visit);
    else
    {
      const Tile* tile = _tiles.tiles.data();
      while (place >= rules.on(tile->kind).weights.size())
        place -= rules.on((tile++)->kind).weights.size();
      const QuadratureRule& rule = rules.on(tile->kind);
      const auto& [a, b, c, d] = tile->corners;
      const auto at = [](std::int8_t v) { return static_cast<std::size_t>(v); };
      if (tile->kind == Tile::Kind::quadrilateral)
        visit_corners<Shape::quadrilateral>(
            rule, place, {at(a), at(b), at(d), at(c)}, visit);
      else
        visit_corners<Shape::triangle>(rule, place, {at(a), at(b), at(c)},
                                       visit);
    }
  }

private:
  /// Point k of a rule under the map of some vertices
  template <Shape P, class Visit>
  void
  visit_corners(const QuadratureRule& rule, std::size_t k,
                const std::array<std::size_t, Reference<P>::corners>& corners,
                Visit&& visit) const
  {
    constexpr int count = Reference<P>::corners;
    const Flat r = rule.points[k].template head<T>();
    const Vec<count> N = Lagrange<P, 1>::values(r);
    const Mat<count, T> dN = Lagrange<P, 1>::gradients(r);
    Mat<T, T> J = Mat<T, T>::Zero();
    for (int c = 0; c < count; ++c)
      J += _y[corners[static_cast<std::size_t>(c)]] * dN.row(c);
    const Mat<count, T> dJ = rule.weights[k] * dN * adjugate(J);
    for (int c = 0; c < count; ++c)
      visit(corners[static_cast<std::size_t>(c)], N[c], Mat<1, T>(dJ.row(c)));
  }

  /// det(J) J^-1: the derivative of det(J) by a corner is its row of dN times
  /// this, also where the tile has no area
  [[nodiscard]] static Mat<T, T> adjugate(const Mat<T, T>& J)
  {
    if constexpr (T == 1)
      return Mat<T, T>::Identity();
    else
    {
      Mat<T, T> adj;
      adj << J(1, 1), -J(0, 1), -J(1, 0), J(0, 0);
      return adj;
    }
  }

  Tiles _tiles;
  std::array<Flat, capacity + 1> _y;
};

} // namespace raymortar
