#include "raymortar/adjoint/springs_back.h"
#include "raymortar/adjoint/spring_fit.h"
#include "raymortar/core/error.h"
#include <algorithm>

namespace raymortar
{
namespace
{
SpringsOfStep springs_of(const Interface& of, std::span<const double> weights)
{
  const ContactState& s = of.state();
  SpringsOfStep springs{spring_numbers(s, of.assembler().results(s)), weights};
  const auto count =
      springs.number.size() -
      static_cast<std::size_t>(
          std::count(springs.number.begin(), springs.number.end(), no_index));
  const auto width = static_cast<std::size_t>(2 * s.slave.gdim);
  if (not weights.empty() and weights.size() != count * width)
    throw Error("a step that is gone back to has other closed points than when "
                "it was accepted");
  return springs;
}
} // namespace

bool has_known_springs(const Interface& of)
{
  return of.state().method == Method::penalty and of.state().friction;
}

void springs_by_parameter(const Interface& of, const Parameter& by,
                          std::span<const double> weights, VectorSink& sink)
{
  const ContactState& s = of.state();
  if (weights.empty() or not has_known_springs(of))
    return;
  const SpringsOfStep springs = springs_of(of, weights);
  std::vector<double> row;
  const auto give = [&](std::size_t e, Index master, const double* block, int n)
  {
    row.assign(block, block + n);
    for (double& value : row)
      value = -value;
    sink.add(element_unknowns(s.elements.slave[e], master), row);
  };
  const BlockSink own = [&](std::size_t e, const double* block, int size)
  { give(e, s.master_of(e), block, size); };
  const CouplingSink other = [&](std::size_t e, Index master,
                                 const double* block, int size, const double*)
  { give(e, master, block, size); };
  if (s.slave.gdim == 2)
    held_by_parameter<2>(s, by, springs, own, other);
  else
    held_by_parameter<3>(s, by, springs, own, other);
}

std::vector<double> springs_back(const Interface& of,
                                 const AdjointOfStep& adjoint,
                                 std::span<const double> weights)
{
  const ContactState& s = of.state();
  if (s.spring_points.empty() or not has_known_springs(of))
    return {};
  const SpringsOfStep springs = springs_of(of, weights);
  return spring_weights(s, s.slave.gdim == 2
                               ? weights_of_field<2>(s, springs, adjoint)
                               : weights_of_field<3>(s, springs, adjoint));
}
} // namespace raymortar
