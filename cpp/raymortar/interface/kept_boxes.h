// Boxes stored with a margin. What was found for them is valid as long as the
// present boxes lie inside the stored ones.
#pragma once

#include "raymortar/geometry/aabb_tree.h"

namespace raymortar
{
class KeptBoxes
{
public:
  /// @brief Store boxes, each made larger by `margin(box number)`.
  template <int D, class Margin>
  void keep(const std::vector<Box<D>>& boxes, Margin&& margin)
  {
    _corners.clear();
    _corners.reserve(boxes.size() * 2 * D);
    for (std::size_t k = 0; k < boxes.size(); ++k)
    {
      const Box<D> b = boxes[k].inflated(margin(k));
      _corners.insert(_corners.end(), b.lower.data(), b.lower.data() + D);
      _corners.insert(_corners.end(), b.upper.data(), b.upper.data() + D);
    }
  }

  /// @brief Whether every box, made larger by a margin, lies in its stored one.
  template <int D>
  [[nodiscard]] bool hold(const std::vector<Box<D>>& boxes,
                          double margin = 0.0) const
  {
    if (_corners.size() != boxes.size() * 2 * D)
      return false;
    for (std::size_t k = 0; k < boxes.size(); ++k)
      for (int i = 0; i < D; ++i)
      {
        const double* box = _corners.data() + k * 2 * D;
        if (not(boxes[k].lower[i] - margin >= box[i] and
                boxes[k].upper[i] + margin <= box[D + i]))
          return false;
      }
    return true;
  }

  void forget() { _corners.clear(); }

  /// Lower and upper corners, box after box
  [[nodiscard]] const std::vector<double>& corners() const { return _corners; }

private:
  std::vector<double> _corners;
};
} // namespace raymortar
