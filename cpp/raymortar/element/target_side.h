// Target data of an integration point: a master facet of any kind, or a rigid
// tool.
#pragma once

#include "raymortar/element/assembler.h"
#include "raymortar/element/facet_taylor.h"
#include "raymortar/element/point_shapes.h"
#include "raymortar/target/freedom.h"
#include <optional>

namespace raymortar
{
/// @brief Target of one element after the other.
template <int D>
class TargetSide
{
public:
  static constexpr int T = D - 1;

  TargetSide(const ContactState& s, const Wanted& wanted);

  /// @brief Go to an element.
  /// @return Whether it has a target; without one its points have no hits
  bool take(std::size_t element, PointShapes<D>& shapes);

  /// @brief Set what a point's ray has hit, after its slave is set.
  /// @return Whether the target's tangents are others than at the point before
  bool place(std::size_t q, TaylorData<D>& e, PointShapes<D>& shapes);

  /// @brief How the body that is hit is free; null: it is not, or no body.
  [[nodiscard]] const Freedom* freedom() const { return _freedom; }

private:
  bool place_facet(std::size_t q, TaylorData<D>& e, PointShapes<D>& shapes);
  bool place_tool(std::size_t q, TaylorData<D>& e, PointShapes<D>& shapes);
  void take_tool(Index number);
  void turn_frames(const Vec<D>& n, TaylorData<D>& e) const;
  void set_bends(std::size_t q, TaylorData<D>& e) const;
  void move_body(const Frame<D>& target, BodyColumns<D>& columns) const;

  const ContactState& _state;
  Wanted _wanted;
  FacetTaylor<D> _facet;
  ShapeFunctions<T> _dofs;  ///< of a facet's displacement
  ShapeRows<T> _nodes;      ///< of its positions, where these have others
  Index _number = no_index; ///< facet or tool that is taken
  bool _is_new = true;
  const Freedom* _freedom = nullptr;
  bool _turns = false;  ///< since the accepted step
  Mat<D, D> _turn_back; ///< to the accepted step
  Vec<D> _shift_back;   ///< the same of the body's points
};
} // namespace raymortar
