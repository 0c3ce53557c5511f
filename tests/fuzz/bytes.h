// Doubles of any kind from the fuzzer's bytes.
#pragma once

#include "raymortar/core/types.h"
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>

namespace raymortar::test
{
/// Reads zeros beyond the end
struct Bytes
{
  const std::uint8_t* data;
  std::size_t size;

  std::uint8_t byte()
  {
    if (size == 0)
      return 0;
    --size;
    return *data++;
  }

  /// Any bit pattern, or small multiples of 1/16 so that points coincide
  double real(bool raw)
  {
    if (!raw)
      return static_cast<std::int8_t>(byte()) / 16.0;
    std::uint64_t bits = 0;
    for (int k = 0; k < 8; ++k)
      bits = bits << 8 | byte();
    double x = 0;
    std::memcpy(&x, &bits, sizeof x);
    return x;
  }

  template <int D>
  Vec<D> point(bool raw)
  {
    Vec<D> x;
    for (int i = 0; i < D; ++i)
      x[i] = real(raw);
    return x;
  }
};

/// A broken promise stops the fuzzer, which then keeps the input
inline void require(bool promise)
{
  if (!promise)
    std::abort();
}

/// Products of three such numbers neither overflow nor vanish
inline bool is_ordinary(double x)
{
  const double size = x < 0 ? -x : x;
  return size == 0 or (size > 1e-60 and size < 1e60);
}
} // namespace raymortar::test
