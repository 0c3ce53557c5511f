#include "raymortar/geometry/tiles.h"
#include "raymortar/geometry/parallelogram.h"
#include "raymortar/geometry/predicates.h"
#include <cmath>

namespace raymortar
{
namespace
{
class Cutter
{
public:
  explicit Cutter(std::span<const Vec<2>> polygon) : _polygon(polygon)
  {
    _out.core_size = static_cast<int>(polygon.size());
    for (int v = 0; v < _out.core_size; ++v)
      _out.core[v] = static_cast<std::int8_t>(v);
    for (int v = 1; v + 1 < _out.core_size; ++v)
      _smallest += twice_area({0, v, v + 1});
    _smallest = tolerance::ear * std::abs(_smallest);
  }

  [[nodiscard]] Tiles cut() &&
  {
    while (_out.core_size > 3 and cut_ear())
    {
    }
    if (_out.core_size == 3)
      push({Tile::Kind::triangle, corners({0, 1, 2, 0})});
    else if (_out.core_size == 4)
      push({Tile::Kind::quadrilateral, corners({0, 1, 2, 3})});
    else
      for (int v = 0; v < _out.core_size; ++v)
        push({Tile::Kind::fan, {Tiles::centre, at(v), at(v + 1)}});
    return _out;
  }

private:
  /// Vertex of the core, around and around
  [[nodiscard]] std::int8_t at(int v) const
  {
    const int n = _out.core_size;
    return _out.core[(v + n) % n];
  }

  [[nodiscard]] std::array<std::int8_t, 4>
  corners(const std::array<int, 4>& of) const
  {
    return {at(of[0]), at(of[1]), at(of[2]), at(of[3])};
  }

  [[nodiscard]] double twice_area(const std::array<int, 3>& of) const
  {
    const auto point = [&](int k) -> const Vec<2>& { return _polygon[at(k)]; };
    const Vec<2> a = point(of[1]) - point(of[0]);
    const Vec<2> b = point(of[2]) - point(of[0]);
    return parallelogram(a, b);
  }

  void push(const Tile& tile) { _out.tiles[_out.size++] = tile; }

  /// The smallest ear, if it is small enough
  bool cut_ear()
  {
    int ear = -1;
    double least = _smallest;
    for (int v = 0; v < _out.core_size; ++v)
      if (const double area = std::abs(twice_area({v - 1, v, v + 1}));
          area < least)
      {
        ear = v;
        least = area;
      }
    if (ear < 0)
      return false;
    push({Tile::Kind::triangle, corners({ear - 1, ear, ear + 1, ear})});
    for (int v = ear; v + 1 < _out.core_size; ++v)
      _out.core[v] = at(v + 1);
    --_out.core_size;
    return true;
  }

  std::span<const Vec<2>> _polygon;
  double _smallest = 0.0; ///< twice the area from which on an ear is none
  Tiles _out;
};
} // namespace

Tiles tiles_of(std::span<const Vec<2>> polygon)
{
  return Cutter(polygon).cut();
}
} // namespace raymortar
