// Seconds of a scope.
#pragma once

#include <ctime>

namespace raymortar
{
/// @brief Sets a number to the CPU seconds that this thread has spent between
/// construction and destruction.
///
/// Not the time on the wall, which says more about what else the machine does.
class Stopwatch
{
public:
  explicit Stopwatch(double& seconds) : _seconds(seconds) {}
  Stopwatch(const Stopwatch&) = delete;
  Stopwatch& operator=(const Stopwatch&) = delete;
  ~Stopwatch() { _seconds = now() - _start; }

private:
  static double now()
  {
    std::timespec t{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) +
           1e-9 * static_cast<double>(t.tv_nsec);
  }

  double& _seconds;
  double _start = now();
};
} // namespace raymortar
