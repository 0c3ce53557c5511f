// State and response of a contact law at one integration point.
#pragma once

#include "raymortar/core/types.h"

namespace raymortar
{
enum class ContactStatus : std::int8_t
{
  none, ///< no admissible hit
  open,
  stick,
  slip
};

/// @brief State of a point: kinematics and multiplier.
/// @tparam M Components of the multiplier: 0, 1 or D
template <int D, int M>
struct PointState
{
  Vec<D> n;     ///< slave unit normal
  double g;     ///< gap, length
  Vec<M> lam;   ///< multiplier, traction
  double gamma; ///< augmentation or penalty coefficient, traction per length
  double touch; ///< closed up to this value of the gap, length
};

/// @brief Traction of (3) and residual C of (4).
template <int D, int M>
struct PointValue
{
  ContactStatus status;
  double p = 0.0; ///< normal traction of the law, <= 0
  Vec<D> t;       ///< traction on the slave
  Vec<M> C;       ///< residual of the multiplier equation
  /// Trial traction of friction, on its disc: what springs hold. Friction only
  Vec<D> held;
};

/// @brief The same with their derivatives.
///
/// `a_b` is the derivative of a with respect to b. With a multiplier the
/// traction is the multiplier, t = lam, or t = lam n of a scalar one: t_g = 0,
/// and of a vector t_n = 0 and t_lam = I. Elements skip these.
template <int D, int M>
struct PointResponse : PointValue<D, M>
{
  Mat<D, D> t_n = Mat<D, D>::Zero();
  Vec<D> t_g = Vec<D>::Zero();
  Mat<D, M> t_lam = Mat<D, M>::Zero();
  Mat<M, D> C_n = Mat<M, D>::Zero();
  Vec<M> C_g = Vec<M>::Zero();
  Mat<M, M> C_lam = Mat<M, M>::Zero();
};

/// @brief Whether a law with a multiplier has a condition at each point.
template <class Law>
inline constexpr bool holds_at_points = true;
} // namespace raymortar
