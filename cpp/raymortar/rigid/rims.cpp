#include "raymortar/rigid/rims.h"
#include "raymortar/geometry/dispatch.h"
#include "raymortar/geometry/frame.h"
#include <cmath>
#include <numbers>
#include <span>

namespace raymortar
{
namespace
{
/// Facets whose normals differ by more have a sharp edge. Fine facets of a
/// round tool differ by less: cutting along all their edges would be of no use.
/// Rounding counts an angle of 30 degrees as sharp
const double sharp = std::cos(std::numbers::pi / 6.0) + 1e-9;

/// Lengths of the difference of normals that go on across an edge: of flat
/// facets, which are coplanar, and of bent ones, 2 degrees
constexpr double coplanar = 1e-5;
constexpr double bent = std::numbers::pi / 90.0;

template <class F>
class Rim
{
public:
  static constexpr int D = F::gdim;

  explicit Rim(const ToolFacets& facets) : _facets(facets) {}

  [[nodiscard]] std::vector<Box<D>> boxes() const
  {
    std::vector<Box<D>> found;
    for_edges(
        [&](std::span<const Edge> sides)
        {
          if (sides.size() != 2 or turns_away(sides[0], sides[1]))
            found.push_back(box_of(sides[0]));
        });
    return found;
  }

  [[nodiscard]] std::vector<std::int8_t> smooth() const
  {
    std::vector<std::int8_t> found(_facets.nodes.size() / F::nodes, 1);
    for_edges(
        [&](std::span<const Edge> sides)
        {
          if (sides.size() == 2 and jumps(sides[0], sides[1]))
            for (const Edge& side : sides)
              found[static_cast<std::size_t>(side.facet)] = 0;
        });
    return found;
  }

private:
  /// By its sorted corners, and where it was seen
  struct Edge
  {
    std::array<Index, 2> ends;
    Index facet;
    int number;
  };

  [[nodiscard]] static int corner(int k)
  {
    return F::Ref::cycle[static_cast<std::size_t>(k % F::Ref::edges)];
  }
  /// In 2D an edge is a point
  [[nodiscard]] static int end_of(int edge)
  {
    return corner(F::tdim == 1 ? edge : edge + 1);
  }

  /// Call with what has been seen of each edge
  template <class Call>
  void for_edges(Call&& call) const
  {
    const std::vector<Edge> edges = sorted_edges();
    for (std::size_t i = 0, j = 0; i < edges.size(); i = j)
    {
      while (j < edges.size() and edges[j].ends == edges[i].ends)
        ++j;
      call(std::span(edges).subspan(i, j - i));
    }
  }

  [[nodiscard]] std::vector<Edge> sorted_edges() const
  {
    const std::size_t count = _facets.nodes.size() / F::nodes;
    std::vector<Edge> edges;
    edges.reserve(count * F::Ref::edges);
    for (std::size_t f = 0; f < count; ++f)
    {
      const Index* node = _facets.nodes.data() + f * F::nodes;
      for (int e = 0; e < F::Ref::edges; ++e)
      {
        const Index a = node[corner(e)], b = node[end_of(e)];
        edges.push_back(
            {{std::min(a, b), std::max(a, b)}, static_cast<Index>(f), e});
      }
    }
    std::sort(edges.begin(), edges.end(),
              [](const Edge& a, const Edge& b) { return a.ends < b.ends; });
    return edges;
  }

  [[nodiscard]] static typename F::RefPoint place(int corner)
  {
    return typename F::RefPoint(
        F::Node::points[static_cast<std::size_t>(corner)].data());
  }
  [[nodiscard]] Frame<D> middle_of(const Edge& edge) const
  {
    return frame_at<F>(
        _facets.nodes_of<F>(edge.facet),
        0.5 * (place(corner(edge.number)) + place(end_of(edge.number))));
  }

  [[nodiscard]] static bool is_sharp(const Vec<D>& n, const Vec<D>& other)
  {
    return n.dot(other) < sharp;
  }

  /// Whether normals differ by less than at a sharp edge, but visibly
  [[nodiscard]] bool jumps(const Edge& one, const Edge& other) const
  {
    const Vec<D> n = middle_of(one).n, m = middle_of(other).n;
    return (n - m).norm() > (F::node_degree == 1 ? coplanar : bent) and
           not is_sharp(n, m);
  }

  [[nodiscard]] bool turns_away(const Edge& one, const Edge& other) const
  {
    const Frame<D> here = middle_of(one), there = middle_of(other);
    if (not is_sharp(here.n, there.n))
      return false;
    const Vec<D> centre = _facets.nodes_of<F>(other.facet).rowwise().mean();
    return here.n.dot(centre - here.x) < 0.0;
  }

  /// A bent edge lies within the corners of its control polygon
  [[nodiscard]] Box<D> box_of(const Edge& edge) const
  {
    const auto nodes = _facets.nodes_of<F>(edge.facet);
    const Vec<D> a = nodes.col(corner(edge.number));
    const Vec<D> b = nodes.col(end_of(edge.number));
    const Vec<D> control = 2.0 * middle_of(edge).x - 0.5 * (a + b);
    return {a.cwiseMin(b).cwiseMin(control), a.cwiseMax(b).cwiseMax(control)};
  }

  const ToolFacets& _facets;
};

/// What `call` gives for the rim of facets in D dimensions
template <int D, class Result, class Call>
Result with_rim(const ToolFacets& facets, Call&& call)
{
  struct Kind
  {
    Shape shape;
    int node_degree;
  };
  return with_geometry(Kind{facets.shape, facets.degree},
                       [&]<class F>(F) -> Result
                       {
                         if constexpr (F::gdim == D)
                           return call(Rim<F>(facets));
                         else
                           throw Error("facets of another dimension");
                       });
}
} // namespace

template <int D>
std::vector<Box<D>> rim_boxes(const ToolFacets& facets)
{
  return with_rim<D, std::vector<Box<D>>>(facets, [](const auto& rim)
                                          { return rim.boxes(); });
}

template <int D>
std::vector<std::int8_t> smooth_facets(const ToolFacets& facets)
{
  return with_rim<D, std::vector<std::int8_t>>(facets, [](const auto& rim)
                                               { return rim.smooth(); });
}

template std::vector<Box<2>> rim_boxes<2>(const ToolFacets&);
template std::vector<Box<3>> rim_boxes<3>(const ToolFacets&);
template std::vector<std::int8_t> smooth_facets<2>(const ToolFacets&);
template std::vector<std::int8_t> smooth_facets<3>(const ToolFacets&);
} // namespace raymortar
