// Element loops of derivatives of springs, in one dimension; units
// parameters_*.cpp instantiate them.
#pragma once

#include "raymortar/adjoint/spring_element.h"
#include "raymortar/adjoint/springs_back.h"
#include "raymortar/element/assembler_impl.h"
#include "raymortar/pairing/facet_dofs.h"

namespace raymortar
{
template <int D>
class SpringLoop
{
  using Points = PointsOf<D, FrictionalPenalty>;
  using Motion = SegmentMotion<D>;

public:
  SpringLoop(const ContactState& s, const Parameter& by,
             const SpringsOfStep& springs)
      : _state(s), _springs(springs), _kernel(by),
        _points(s, {.old = true, .target = true, .bends = true, .along = true},
                nullptr),
        _moves(by.kind == Parameter::Kind::unknowns and s.moving_segments)
  {
  }

  /// Give the derivatives of all elements, in the first rows of blocks
  void by_parameter(const BlockSink& sink, const CouplingSink& couplings)
  {
    Motion motion(_state);
    AnyIntegrand<D> along{};
    for (std::size_t e = 0; e < _state.elements.size(); ++e)
    {
      const int size = take(e);
      const bool moves = _moves and has_moving_vertices(_state, e);
      const typename Motion::Element element{e, _points.shapes.alone(), size,
                                             _kernel.A.data(), couplings};
      for_points(_points, e,
                 [&](std::size_t q)
                 {
                   if (_springs.number[q] == no_index)
                     return;
                   add_held(e, q, moves ? &along : nullptr);
                   if (moves)
                     motion.add(element, q, along);
                 });
      if (moves)
        motion.finish(element);
      sink(e, _kernel.A.data(), size);
    }
  }

  /// Weights of the field of springs that the step has started from
  [[nodiscard]] std::vector<double> by_field(const AdjointOfStep& adjoint)
  {
    std::vector<double> found(_state.points.size() * D, 0.0);
    for (std::size_t e = 0; e < _state.elements.size(); ++e)
    {
      const int size = take(e);
      const std::vector<double> w = weights(e, adjoint);
      for_points(_points, e,
                 [&](std::size_t q)
                 {
                   if (not _points.has_target)
                     return;
                   double* const to = found.data() + q * D;
                   _kernel.clear_tangent(size);
                   _kernel.add(_points, _state.elements.master[e]);
                   for (int r = 0; r < size; ++r)
                     add_row(-w[std::size_t(r)], r * size, to);
                   if (_springs.number[q] == no_index)
                     return;
                   _kernel.clear_tangent(size);
                   add_held(e, q, nullptr);
                   add_row(1.0, 0, to);
                 });
    }
    return found;
  }

private:
  [[nodiscard]] int take(std::size_t e)
  {
    _points.take(e);
    _kernel.clear_tangent(_points.shapes.size());
    return _points.shapes.size();
  }

  void add_held(std::size_t e, std::size_t q, AnyIntegrand<D>* along)
  {
    const auto number = static_cast<std::size_t>(_springs.number[q]);
    if (not _springs.weights.empty())
      _kernel.add_held(_points, _state.elements.master[e],
                       SpringWeights<D>(_springs.weights, number), along);
  }

  /// Add a factor times a row's entries at the slave, summed over its nodes
  void add_row(double factor, int row, double* to) const
  {
    for (int a = 0; a < _points.shapes.slave_nodes; ++a)
      for (int i = 0; i < D; ++i)
        to[i] += factor * _kernel.A[static_cast<std::size_t>(row + D * a + i)];
  }

  /// The adjoint at the unknowns of an element
  [[nodiscard]] std::vector<double> weights(std::size_t e,
                                            const AdjointOfStep& adjoint) const
  {
    std::vector<double> w;
    append_values(_state.slave, _state.elements.slave[e], adjoint.slave, w);
    if (const Index m = _state.master_of(e); m != no_index)
      append_values(_state.master, m, adjoint.master, w);
    return w;
  }

  const ContactState& _state;
  const SpringsOfStep& _springs;
  SpringElement<D> _kernel;
  Points _points;
  bool _moves;
};

template <int D>
void held_by_parameter(const ContactState& s, const Parameter& by,
                       const SpringsOfStep& springs, const BlockSink& sink,
                       const CouplingSink& couplings)
{
  std::make_unique<SpringLoop<D>>(s, by, springs)
      ->by_parameter(sink, couplings);
}

template <int D>
std::vector<double> weights_of_field(const ContactState& s,
                                     const SpringsOfStep& springs,
                                     const AdjointOfStep& adjoint)
{
  const Parameter by{Parameter::Kind::springs, no_index, {}, {}};
  return std::make_unique<SpringLoop<D>>(s, by, springs)->by_field(adjoint);
}
} // namespace raymortar
