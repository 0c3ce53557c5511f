// Seconds of a scope.
#pragma once

#include <chrono>

namespace raymortar
{
/// @brief Sets a number to the seconds between construction and destruction.
class Stopwatch
{
public:
  explicit Stopwatch(double& seconds) : _seconds(seconds) {}
  Stopwatch(const Stopwatch&) = delete;
  Stopwatch& operator=(const Stopwatch&) = delete;
  ~Stopwatch()
  {
    _seconds = std::chrono::duration<double>(Clock::now() - _start).count();
  }

private:
  using Clock = std::chrono::steady_clock;
  double& _seconds;
  Clock::time_point _start = Clock::now();
};
} // namespace raymortar
