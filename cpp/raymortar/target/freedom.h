// Motion of a free rigid body by its unknowns.
#pragma once

#include "raymortar/target/tool.h"

namespace raymortar
{
/// @brief Derivatives of a body's points by its unknowns, where it is.
///
/// Of unknown j the point x moves with drift_j + spin_j (x - centre); the
/// second derivative by j and k is bend_jk (x - centre).
struct Freedom
{
  /// Motion by one unknown, per unit of it
  struct Rate
  {
    Vec<3> drift = Vec<3>::Zero();
    Mat<3, 3> spin = Mat<3, 3>::Zero(); ///< skew
  };

  Vec<3> centre = Vec<3>::Zero();
  std::vector<Rate> rates;
  std::vector<Mat<3, 3>> bends;  ///< (unknowns, unknowns)
  std::vector<GlobalIndex> rows; ///< of the coupled system, (unknowns,)

  [[nodiscard]] Index size() const { return static_cast<Index>(rates.size()); }

  [[nodiscard]] const Mat<3, 3>& bend(Index j, Index k) const
  {
    return bends[static_cast<std::size_t>(j * size() + k)];
  }
};

/// @brief How a point of the body moves by unknown j.
/// @param[in] x Where it is. Length
template <int D>
[[nodiscard]] Vec<D> velocity(const Freedom& freedom, Index j, const Vec<D>& x)
{
  const Freedom::Rate& rate = freedom.rates[static_cast<std::size_t>(j)];
  return rate.drift.template head<D>() +
         rate.spin.template topLeftCorner<D, D>() *
             (x - freedom.centre.template head<D>());
}

/// @brief A tool whose body is free: rays meet it as they meet the shape.
class FreeTool final : public Tool
{
public:
  FreeTool(std::shared_ptr<const Tool> shape, Freedom freedom)
      : _shape(std::move(shape)), _freedom(std::move(freedom))
  {
  }

  void cast(std::span<const ToolRay> rays,
            std::span<ToolHit> hits) const override
  {
    _shape->cast(rays, hits);
  }
  [[nodiscard]] double distance(const Vec<3>& x) const override
  {
    return _shape->distance(x);
  }
  [[nodiscard]] const ToolCutter* cutter() const override
  {
    return _shape->cutter();
  }

  [[nodiscard]] const std::shared_ptr<const Tool>& shape() const
  {
    return _shape;
  }
  [[nodiscard]] const Freedom& freedom() const { return _freedom; }

private:
  std::shared_ptr<const Tool> _shape;
  Freedom _freedom;
};

/// @brief How a tool is free; null: its motion is prescribed.
[[nodiscard]] inline const Freedom* freedom_of(const PlacedTool& placed)
{
  const auto* const free = dynamic_cast<const FreeTool*>(placed.tool.get());
  return free == nullptr ? nullptr : &free->freedom();
}

/// @brief The same tool with another freedom; without unknowns it is held.
[[nodiscard]] inline std::shared_ptr<const Tool>
with_freedom(const std::shared_ptr<const Tool>& tool, Freedom freedom)
{
  const auto* const free = dynamic_cast<const FreeTool*>(tool.get());
  const std::shared_ptr<const Tool> shape = free ? free->shape() : tool;
  if (freedom.size() == 0)
    return shape;
  return std::make_shared<FreeTool>(shape, std::move(freedom));
}
} // namespace raymortar
