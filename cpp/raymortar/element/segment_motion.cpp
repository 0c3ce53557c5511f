#include "raymortar/element/segment_motion.h"

namespace raymortar
{
template <int D>
SegmentMotion<D>::SegmentMotion(const ContactState& s)
    : _state(s), _is_map(s.slave.shape == Shape::quadrilateral),
      _map(corners(no_index))
{
}

template <int D>
void SegmentMotion<D>::add(const Element& e, std::size_t q,
                           const AnyIntegrand<D>& at)
{
  const Index segment = _state.points.segment[q];
  if (segment != _segment)
  {
    finish(e);
    take(e, segment);
  }
  set_change(q, at, e.size);
  _points.visit(
      _state.segment_rules, static_cast<std::size_t>(_state.points.place[q]),
      [&](std::size_t v, double N, const Mat<1, T>& dJ)
      {
        for (std::size_t t = 0; t < T; ++t)
          add_vertex(_by_vertex[v][t], t, N, dJ[static_cast<int>(t)], e.size);
      });
}

template <int D>
void SegmentMotion<D>::finish(const Element& e)
{
  if (_segment != no_index)
    flush(e, _state.segmentation.segments[static_cast<std::size_t>(_segment)]);
  _segment = no_index;
}

template <int D>
typename SegmentMotion<D>::Plane::NodeMatrix
SegmentMotion<D>::corners(Index facet) const
{
  typename Plane::NodeMatrix x = Plane::NodeMatrix::Zero();
  if (facet == no_index)
  {
    for (int c = 0; c < Plane::nodes; ++c)
      for (int i = 0; i < T; ++i)
        x(i, c) = Plane::Node::points[static_cast<std::size_t>(c)]
                                     [static_cast<std::size_t>(i)];
    return x;
  }
  AnyNodes<D> nodes;
  nodes.take(_state.slave, _state.slave.X, facet,
             static_cast<std::size_t>(_state.slave.nodes_per_facet()));
  for (int c = 0; c < Plane::nodes; ++c)
    x.col(c) = nodes.at[static_cast<std::size_t>(c)];
  return x;
}

template <int D>
void SegmentMotion<D>::set_change(std::size_t q, const AnyIntegrand<D>& at,
                                  int size)
{
  const double weight = _state.points.weight[q];
  _by_measure = at.f.data();
  if (not _is_map)
  {
    for (std::size_t t = 0; t < T; ++t)
      for (std::size_t r = 0; r < std::size_t(size); ++r)
        _by_y[t][r] = weight * at.f_xi[t][r];
    return;
  }
  if constexpr (T == 2)
    set_mapped(_state.points.xi[q], weight, at, size);
}

template <int D>
void SegmentMotion<D>::set_mapped(const Vec<2>& xi, double weight,
                                  const AnyIntegrand<D>& at, int size)
{
  if constexpr (T == 2)
  {
    const Mat<2, 2> G = _map.gradient(xi);
    const Mat<2, 2> to_y = weight * G.inverse();
    const Mat<1, 2> log_det = _map.log_det_gradient(xi).transpose() * to_y;
    const double scale = 1.0 / G.determinant();
    for (int t = 0; t < 2; ++t)
    {
      const double a = to_y(0, t), b = to_y(1, t), by_f = log_det[t];
      Row& by_y = _by_y[static_cast<std::size_t>(t)];
      for (std::size_t r = 0; r < std::size_t(size); ++r)
        by_y[r] = a * at.f_xi[0][r] + b * at.f_xi[1][r] - by_f * at.f[r];
    }
    for (std::size_t r = 0; r < std::size_t(size); ++r)
      _scaled[r] = scale * at.f[r];
    _by_measure = _scaled.data();
  }
}

template <int D>
void SegmentMotion<D>::take(const Element& e, Index number)
{
  _segment = number;
  const Segment& segment =
      _state.segmentation.segments[static_cast<std::size_t>(number)];
  if (_is_map and segment.slave != _facet)
  {
    _facet = segment.slave;
    _map = FlatMap<Plane>(corners(_facet));
  }
  _points.take(_state.segmentation, segment, _map);
  const auto clear = [&e](Sum& sum)
  {
    for (Row& row : sum)
      std::fill_n(row.begin(), e.size, 0.0);
  };
  for (std::size_t v = 0; v < static_cast<std::size_t>(segment.size); ++v)
    clear(_by_vertex[v]);
  if (_points.has_centre())
    clear(_by_vertex[Points::centre]);
}

template <int D>
void SegmentMotion<D>::to_facet(std::size_t vertex, Sum& sum, int size) const
{
  if (not _is_map)
    return;
  const Mat<T, T> G =
      _map.gradient(_state.segmentation.vertices[vertex].template head<T>());
  for (std::size_t r = 0; r < std::size_t(size); ++r)
  {
    Mat<1, T> row;
    for (int t = 0; t < T; ++t)
      row[t] = sum[std::size_t(t)][r];
    row = (row * G).eval();
    for (int t = 0; t < T; ++t)
      sum[std::size_t(t)][r] = row[t];
  }
}

template <int D>
void SegmentMotion<D>::flush(const Element& e, const Segment& of)
{
  _points.share_centre(
      [&](std::size_t v, double share)
      {
        for (std::size_t t = 0; t < T; ++t)
          for (std::size_t r = 0; r < std::size_t(e.size); ++r)
            _by_vertex[v][t][r] += share * _by_vertex[Points::centre][t][r];
      });
  visit_targets<D>(_state, of,
                   [&](const SegmentTarget<D>& target)
                   { add_motion(e, of, target); });
}

template <int D>
void SegmentMotion<D>::add_motion(const Element& e, const Segment& of,
                                  const SegmentTarget<D>& target)
{
  const Index hit = target_of(_state, e.number);
  const bool own = target.number() == hit;
  const auto columns = static_cast<int>(target.unknowns());
  const int size = e.alone + columns;
  if (not own)
  {
    std::fill_n(_coupling.begin(), size * size, 0.0);
    std::fill_n(_hit_rows.begin(), (e.size - e.alone) * columns, 0.0);
  }
  for (std::size_t v = 0; v < static_cast<std::size_t>(of.size); ++v)
  {
    const std::size_t at = static_cast<std::size_t>(of.begin) + v;
    if (not target.moves(at))
      continue;
    const AnyVertexMotion<D> motion = target.motion(at);
    const auto by_target = target.columns(motion);
    Sum& sum = _by_vertex[v];
    to_facet(at, sum, e.size);
    add_product(sum, 0, e.size, motion.by_slave, e.A, e.size);
    if (own)
      add_product(sum, 0, e.size, by_target, e.A + e.alone, e.size);
    else
    {
      add_product(sum, 0, e.alone, by_target, _coupling.data() + e.alone, size);
      add_product(sum, e.alone, e.size, by_target, _hit_rows.data(), columns);
    }
  }
  if (not own and columns > 0)
    e.couplings(e.number, target.number(), _coupling.data(), size,
                hit == no_index ? nullptr : _hit_rows.data());
}

template class SegmentMotion<2>;
template class SegmentMotion<3>;
} // namespace raymortar
