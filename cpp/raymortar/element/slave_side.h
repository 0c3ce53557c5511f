// Slave data of an integration point, for facets of any kind.
#pragma once

#include "raymortar/element/assembler.h"
#include "raymortar/element/facet_taylor.h"
#include "raymortar/element/point_shapes.h"
#include <optional>

namespace raymortar
{
/// @brief Slave facet, fields and multiplier of one element after the other.
template <int D>
class SlaveSide
{
public:
  static constexpr int T = D - 1;

  /// @param[in] tractions In place of those of the multiplier's nodes; null:
  /// those
  SlaveSide(const ContactState& s, const Wanted& wanted,
            const FacetTractions* tractions = nullptr);

  /// @brief Go to an element: sizes, and what is the same at all its points.
  void take(std::size_t element, TaylorData<D>& e, PointShapes<D>& shapes);

  /// @brief Set what is known of a point without its target.
  /// @return Whether the slave's tangents are others than at the point before
  bool place(std::size_t q, TaylorData<D>& e, PointShapes<D>& shapes);

private:
  /// Nodal values of a field on a facet, or its one value
  struct Scalars
  {
    std::array<double, 9> at;
    bool is_constant = true;
  };

  void take_facet(Index facet, TaylorData<D>& e);
  void take_multiplier(Index facet);
  void take_unfelt(Index facet, TaylorData<D>& e);
  void take_scalars(const FacetField& field, Index facet, Scalars& nodal,
                    Vec<D>& coefficients) const;
  void take_springs(Index facet, TaylorData<D>& e);
  void place_fields(const Vec<T>& xi, const ShapeRows<T>& N,
                    TaylorData<D>& e) const;
  void place_multiplier(const Vec<T>& xi, TaylorData<D>& e,
                        PointShapes<D>& shapes) const;
  /// Coefficients of fields at a point, as far as they are asked for
  void set(const Scalars& nodal, const ShapeRows<T>& N, Vec<D>& c) const;
  void set(const AnyNodes<D>& nodal, std::size_t count, const ShapeRows<T>& N,
           Mat<D, D>& c) const;

  const ContactState& _state;
  Wanted _wanted;
  const FacetTractions* _tractions;
  FacetTaylor<D> _facet;
  ShapeFunctions<T> _dofs; ///< of the displacement
  std::optional<ShapeFunctions<T>> _multiplier;
  std::size_t _dofs_per_facet, _multipliers = 0;
  bool _isoparametric;      ///< positions have the displacement's functions
  Index _number = no_index; ///< facet that is taken
  double _factor = 1.0;     ///< of gamma
  bool _has_rest = false;   ///< whether springs hold more than a polynomial
  AnyNodes<D> _reference, _springs, _lam, _kept;
  ShapeRows<T> _nodes; ///< of positions, where displacements have others
  Scalars _gamma, _offset, _coefficient;
};
} // namespace raymortar
