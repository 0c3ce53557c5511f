// Exact arithmetic on doubles: integers of any size in a common binary unit.
#pragma once

#include "geometry/rational.h"
#include <algorithm>
#include <bit>
#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <limits>
#include <span>

namespace raymortar::test
{
/// Grows beyond 1024 bits when it must; most pairs need no allocation
using Big =
    boost::multiprecision::number<boost::multiprecision::cpp_int_backend<1024>,
                                  boost::multiprecision::et_off>;

/// Exponent of the last bit of a double that is set
inline int last_bit(double x)
{
  if (x == 0)
    return std::numeric_limits<int>::max();
  int exponent = 0;
  const double mantissa = std::ldexp(std::frexp(x, &exponent), 53);
  const auto bits = static_cast<std::uint64_t>(std::abs(mantissa));
  return exponent - 53 + std::countr_zero(bits);
}

/// Largest unit 2^k of which every component is a multiple
template <int D>
int common_unit(std::span<const Vec<D>> points, int unit = 0)
{
  for (const Vec<D>& x : points)
    for (int i = 0; i < D; ++i)
      unit = std::min(unit, last_bit(x[i]));
  return unit;
}

/// x in units of 2^unit, without rounding
inline Big in_units(double x, int unit)
{
  int exponent = 0;
  const auto mantissa =
      static_cast<std::int64_t>(std::ldexp(std::frexp(x, &exponent), 53));
  const int shift = exponent - 53 - unit;
  if (mantissa == 0)
    return 0;
  return shift >= 0 ? Big(mantissa) << static_cast<unsigned>(shift)
                    : Big(mantissa >> -shift);
}

inline ExactVector<Big> in_units(const Vec<2>& x, int unit)
{
  return {in_units(x.x(), unit), in_units(x.y(), unit)};
}

/// Quotient to the last digits of a double; overflow is out of reach
inline double quotient(const Big& top, const Big& bottom)
{
  constexpr unsigned fraction = 192;
  const Big q = (top << fraction) / bottom;
  return static_cast<double>(
      std::ldexp(static_cast<long double>(q), -static_cast<int>(fraction)));
}

/// Common area, in squared units, of the polygon left of all lines
inline double exact_area(const std::vector<ExactLine<Big>>& lines)
{
  Big twice = 0;
  constexpr unsigned fraction = 192;
  for (const auto& [top, bottom] : area_shares(lines))
    twice += (top << fraction) / bottom;
  return static_cast<double>(std::ldexp(static_cast<long double>(twice),
                                        -1 - static_cast<int>(fraction)));
}

struct Exact3
{
  std::array<Big, 3> x;

  friend Exact3 operator-(const Exact3& a, const Exact3& b)
  {
    return {a.x[0] - b.x[0], a.x[1] - b.x[1], a.x[2] - b.x[2]};
  }
};

inline Exact3 in_units(const Vec<3>& x, int unit)
{
  return {in_units(x[0], unit), in_units(x[1], unit), in_units(x[2], unit)};
}

inline Big dot(const Exact3& a, const Exact3& b)
{
  return a.x[0] * b.x[0] + a.x[1] * b.x[1] + a.x[2] * b.x[2];
}

inline Exact3 cross(const Exact3& a, const Exact3& b)
{
  return {a.x[1] * b.x[2] - a.x[2] * b.x[1], a.x[2] * b.x[0] - a.x[0] * b.x[2],
          a.x[0] * b.x[1] - a.x[1] * b.x[0]};
}
} // namespace raymortar::test
