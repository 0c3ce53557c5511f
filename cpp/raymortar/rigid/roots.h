// Places where a polynomial changes its sign.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace raymortar
{
/// Coefficients of 1, t, ..., t^N
template <int N>
using Polynomial = std::array<double, N + 1>;

/// @brief Places in ascending order.
template <int N>
struct SignChanges
{
  struct Place
  {
    double place;
    bool rises; ///< from negative to positive
  };
  int size = 0;
  std::array<Place, N> at;
};

template <int N>
[[nodiscard]] double value_at(const Polynomial<N>& p, double t)
{
  double value = p[N];
  for (int k = N - 1; k >= 0; --k)
    value = value * t + p[static_cast<std::size_t>(k)];
  return value;
}

template <int N>
[[nodiscard]] Polynomial<N - 1> derivative(const Polynomial<N>& p)
{
  Polynomial<N - 1> d;
  for (std::size_t k = 1; k <= N; ++k)
    d[k - 1] = static_cast<double>(k) * p[k];
  return d;
}

/// @brief Newton's method that stays between two places of unlike sign.
/// @complexity At most about 60 steps, some 6 as a rule
template <int N>
[[nodiscard]] double root_between(const Polynomial<N>& p, double low,
                                  double high)
{
  const bool rises = value_at<N>(p, high) > 0.0;
  const Polynomial<N - 1> slope = derivative<N>(p);
  double t = 0.5 * (low + high);
  for (int step = 0; step < 100; ++step)
  {
    const double value = value_at<N>(p, t);
    if (value == 0.0)
      return t;
    ((value > 0.0) == rises ? high : low) = t;
    const double newton = t - value / value_at<N - 1>(slope, t);
    const double next =
        newton > low and newton < high ? newton : 0.5 * (low + high);
    const double tiny = std::numeric_limits<double>::epsilon() * std::abs(t);
    if (std::abs(next - t) <= tiny or high - low <= tiny)
      return next;
    t = next;
  }
  return t;
}

/// @brief All sign changes: between those of the derivative there is at most
/// one. Degree N, with a leading coefficient that is not zero.
template <int N>
[[nodiscard]] SignChanges<N> sign_changes(const Polynomial<N>& p)
{
  SignChanges<N> found;
  if constexpr (N == 1)
  {
    found.at[0] = {-p[0] / p[1], p[1] > 0.0};
    found.size = 1;
  }
  else
  {
    // No root is farther from 0 (Cauchy)
    double bound = 0.0;
    for (std::size_t k = 0; k < N; ++k)
      bound = std::max(bound, std::abs(p[k] / p[N]));
    bound += 1.0;
    const auto extrema = sign_changes<N - 1>(derivative<N>(p));
    double low = -bound;
    for (int k = 0; k <= extrema.size; ++k)
    {
      const double high = k < extrema.size
                              ? extrema.at[static_cast<std::size_t>(k)].place
                              : bound;
      const bool was = value_at<N>(p, low) > 0.0;
      const bool is = value_at<N>(p, high) > 0.0;
      if (was != is)
        found.at[static_cast<std::size_t>(found.size++)] = {
            root_between<N>(p, low, high), is};
      low = high;
    }
  }
  return found;
}
} // namespace raymortar
