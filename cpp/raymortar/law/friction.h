// Friction laws: how much tangential traction a normal traction can hold.
// One small class per law; a new one is a class here and an alternative of
// FrictionLaw.
#pragma once

#include <algorithm>
#include <array>
#include <limits>
#include <variant>

namespace raymortar
{
/// @brief Largest tangential traction s, and its derivatives: by the normal
/// traction p, by the length of the slip increment, by the law's coefficient.
struct FrictionBound
{
  double s;
  double s_p;
  double s_slip = 0.0;
  double s_coefficient = 0.0;
  double elastic_slip = 0.0; ///< slip that is given back, see ElasticDisc
};

/// @brief Coulomb: s = -mu p.
struct Coulomb
{
  double mu = 0.0;           ///< friction coefficient
  double elastic_slip = 0.0; ///< slip at which s is reached. Length

  [[nodiscard]] FrictionBound operator()(double p) const
  {
    return {-mu * p, -mu, 0.0, -p, elastic_slip};
  }
};

/// @brief Tresca: the bound is given, whatever the pressure.
struct Tresca
{
  double bound = 0.0; ///< traction

  [[nodiscard]] FrictionBound operator()(double) const
  {
    return {bound, 0.0, 0.0, 1.0};
  }
};

/// @brief No slip while the contact is closed.
struct Stick
{
  [[nodiscard]] FrictionBound operator()(double) const
  {
    return {std::numeric_limits<double>::infinity(), 0.0};
  }
};

/// @brief A law that is known at one point only, for the pressure and the slip
/// that are there: a function of the user's, evaluated at all points at once.
struct PointBound
{
  double s = 0.0;      ///< traction
  double s_p = 0.0;    ///< its derivative by the normal traction, <= 0
  double s_slip = 0.0; ///< by the length of the slip increment
  /// Along the facet where neither changes: of fields and places
  std::array<double, 2> s_xi{};

  [[nodiscard]] FrictionBound operator()(double) const
  {
    return {s, s_p, s_slip, 1.0};
  }
};

using FrictionLaw = std::variant<Coulomb, Tresca, Stick, PointBound>;

/// @brief The law at a pressure and slip nearby: one that is known at one point
/// is taken for linear.
/// @param[in] p, slip Changes of the normal traction and of the slip's length
[[nodiscard]] inline FrictionLaw nearby(const FrictionLaw& law, double p,
                                        double slip)
{
  const auto* const known = std::get_if<PointBound>(&law);
  if (not known)
    return law;
  PointBound there = *known;
  there.s = std::max(0.0, there.s + there.s_p * p + there.s_slip * slip);
  return there;
}

/// @brief The law with the coefficient that a field has at a point: mu of
/// Coulomb's, the bound of Tresca's. The others have none.
[[nodiscard]] inline FrictionLaw with_coefficient(const FrictionLaw& law,
                                                  double value)
{
  if (const auto* const coulomb = std::get_if<Coulomb>(&law))
    return Coulomb{value, coulomb->elastic_slip};
  if (std::holds_alternative<Tresca>(law))
    return Tresca{value};
  return law;
}

/// @brief Slip that a law gives back, a length; 0: none.
[[nodiscard]] inline double elastic_slip_of(const FrictionLaw& law)
{
  const auto* const coulomb = std::get_if<Coulomb>(&law);
  return coulomb ? coulomb->elastic_slip : 0.0;
}

/// @brief Bound of whichever law at normal traction p.
///
/// Bodies that touch may have p > 0 by rounding [theory (4.4)]; the bound of
/// p = 0 then keeps s >= 0.
[[nodiscard]] inline FrictionBound bound_at(const FrictionLaw& law, double p)
{
  return std::visit([p](const auto& l) { return l(std::min(p, 0.0)); }, law);
}
} // namespace raymortar
