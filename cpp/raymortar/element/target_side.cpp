#include "raymortar/element/target_side.h"

namespace raymortar
{
namespace
{
/// Tangents of unit length whose normal, as of a facet's, is a given one
Mat<2, 1> tangents_across(const Vec<2>& n) { return Vec<2>(-n[1], n[0]); }
Mat<3, 2> tangents_across(const Vec<3>& n)
{
  Mat<3, 2> t;
  Eigen::Index least = 0;
  n.cwiseAbs().minCoeff(&least);
  t.col(0) = n.cross(Vec<3>::Unit(least)).normalized();
  t.col(1) = n.cross(t.col(0));
  return t;
}

/// Whose facets are hit; where none are, any
const Surface& facets_of(const ContactState& s)
{
  return s.has_tools() or s.master.num_facets() == 0 ? s.slave : s.master;
}
} // namespace

template <int D>
TargetSide<D>::TargetSide(const ContactState& s, const Wanted& wanted)
    : _state(s), _wanted(wanted), _facet(facets_of(s), wanted.old),
      _dofs(facets_of(s).shape, facets_of(s).degree)
{
}

template <int D>
bool TargetSide<D>::take(std::size_t element, PointShapes<D>& shapes)
{
  const Index number = _state.elements.master[element];
  shapes.target_nodes = 0;
  shapes.body_unknowns = 0;
  if (number == no_index)
    return false;
  const bool other = number != _number;
  _number = number;
  if (_state.has_tools())
  {
    if (other)
      take_tool(number);
    shapes.body_unknowns = _freedom ? _freedom->size() : 0;
    return true;
  }
  _is_new = _is_new or other;
  shapes.target_nodes = _dofs.nodes();
  return true;
}

template <int D>
bool TargetSide<D>::place(std::size_t q, TaylorData<D>& e,
                          PointShapes<D>& shapes)
{
  e.frame_of_target = _state.has_frame_of_target(q);
  return _state.has_tools() ? place_tool(q, e, shapes)
                            : place_facet(q, e, shapes);
}

template <int D>
bool TargetSide<D>::place_facet(std::size_t q, TaylorData<D>& e,
                                PointShapes<D>& shapes)
{
  const ContactState& s = _state;
  const Vec<T> eta = s.hits.eta[q].template head<T>();
  const bool bends = _wanted.bends and _facet.bends();
  const bool own = s.master.degree != s.master.node_degree;
  const auto tabulate = [&](const ShapeFunctions<T>& of, ShapeRows<T>& rows)
  { bends ? of.second(eta, rows) : of.first(eta, rows); };
  tabulate(_dofs, shapes.target);
  if (not(_wanted.old or _wanted.target or e.frame_of_target))
    return false;
  if (_is_new)
    _facet.take(_number);
  _is_new = false;
  if (own)
    tabulate(_facet.shapes(), _nodes);
  e.master_bends = _facet.bends();
  return _facet.place(own ? _nodes : shapes.target, bends, e.master,
                      e.history.master_old, e.master_frames);
}

template <int D>
void TargetSide<D>::take_tool(Index number)
{
  const PlacedTool& tool = _state.tools[static_cast<std::size_t>(number)];
  _freedom = freedom_of(tool);
  _turns = tool.now.rotation != tool.old.rotation;
  _turn_back.setIdentity();
  if (_turns)
    _turn_back = tool.turn_back().template topLeftCorner<D, D>();
  _shift_back = tool.old.shift.template head<D>() -
                _turn_back * tool.now.shift.template head<D>();
  _is_new = true;
}

template <int D>
bool TargetSide<D>::place_tool(std::size_t q, TaylorData<D>& e,
                               PointShapes<D>& shapes)
{
  const Hits& hits = _state.hits;
  const Frame<D>& slave = e.slave_frames.now;
  Frame<D>& now = e.master_frames.now;
  const Vec<D> n = hits.normal[q].template head<D>();
  const bool turned = _is_new or n != now.n;
  _is_new = false;
  const Vec<D> x = slave.x + hits.gap[q] * slave.n;
  now.x = x;
  e.master.col(0) = x;
  if (turned)
    turn_frames(n, e);
  if (_wanted.old)
    e.master_frames.old.x =
        _turns ? Vec<D>(_turn_back * x + _shift_back) : Vec<D>(x + _shift_back);
  if (_wanted.bends)
    set_bends(q, e);
  if (_freedom)
    move_body(now, shapes.body);
  return turned;
}

/// Both frames of the tool for a normal
template <int D>
void TargetSide<D>::turn_frames(const Vec<D>& n, TaylorData<D>& e) const
{
  Frame<D>& now = e.master_frames.now;
  now.t = tangents_across(n);
  now.n = n;
  now.jacobian = 1.0;
  e.master.template middleCols<T>(1) = now.t;
  if (not _wanted.old)
    return;
  Frame<D>& old = e.master_frames.old;
  old = now;
  if (_turns)
  {
    old.t = _turn_back * now.t;
    old.n = _turn_back * n;
  }
  e.master_frames.old_dual = old.t;
}

/// Second derivatives of the tool's surface in unit tangents: it bends away
/// from the normal where it is convex
template <int D>
void TargetSide<D>::set_bends(std::size_t q, TaylorData<D>& e) const
{
  constexpr int count = taylor_size<T> - 1 - T;
  const Mat<3, 3>& bend = _state.hits.bend[q];
  e.master_bends = not bend.isZero(0.0);
  if (not e.master_bends)
    return;
  const Frame<D>& now = e.master_frames.now;
  const Mat<T, T> k =
      now.t.transpose() * bend.template topLeftCorner<D, D>() * now.t;
  Mat<D, count> second;
  for (int i = 0; i < T; ++i)
    for (int j = i; j < T; ++j)
      second.col(i + j) = -k(i, j) * now.n;
  e.master.template rightCols<count>() = second;
  if (_wanted.old)
    e.history.master_old.template rightCols<count>() =
        _turns ? Mat<D, count>(_turn_back * second) : second;
}

/// Motion of position and tangents by the unknowns of a free body
template <int D>
void TargetSide<D>::move_body(const Frame<D>& target,
                              BodyColumns<D>& columns) const
{
  for (Index j = 0; j < _freedom->size(); ++j)
  {
    const Mat<D, D> spin = _freedom->rates[static_cast<std::size_t>(j)]
                               .spin.template topLeftCorner<D, D>();
    auto column = columns.col(j);
    column.template head<D>() = velocity<D>(*_freedom, j, target.x);
    for (int i = 0; i < T; ++i)
      column.template segment<D>(D * (1 + i)) = spin * target.t.col(i);
  }
}

template class TargetSide<2>;
template class TargetSide<3>;
} // namespace raymortar
