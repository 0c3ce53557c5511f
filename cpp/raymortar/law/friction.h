// Friction laws: how much tangential traction a normal traction can hold.
// One small class per law; a new one is a class here and an alternative of
// FrictionLaw.
#pragma once

#include <algorithm>
#include <limits>
#include <variant>

namespace raymortar
{
/// @brief Largest tangential traction s, and its derivative by p.
struct FrictionBound
{
  double s;
  double s_p;
};

/// @brief Coulomb: s = -mu p.
struct Coulomb
{
  double mu = 0.0; ///< friction coefficient

  [[nodiscard]] FrictionBound operator()(double p) const
  {
    return {-mu * p, -mu};
  }
};

/// @brief Tresca: the bound is given, whatever the pressure.
struct Tresca
{
  double bound = 0.0; ///< traction

  [[nodiscard]] FrictionBound operator()(double) const { return {bound, 0.0}; }
};

/// @brief No slip while the contact is closed.
struct Stick
{
  [[nodiscard]] FrictionBound operator()(double) const
  {
    return {std::numeric_limits<double>::infinity(), 0.0};
  }
};

using FrictionLaw = std::variant<Coulomb, Tresca, Stick>;

/// @brief Bound of whichever law at normal traction p.
///
/// Bodies that touch may have p > 0 by rounding [theory (4.4)]; the bound of
/// p = 0 then keeps s >= 0.
[[nodiscard]] inline FrictionBound bound_at(const FrictionLaw& law, double p)
{
  return std::visit([p](const auto& l) { return l(std::min(p, 0.0)); }, law);
}
} // namespace raymortar
