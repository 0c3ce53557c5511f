#include "raymortar/rigid/rims.h"
#include "raymortar/geometry/dispatch.h"
#include "raymortar/geometry/frame.h"
#include <cmath>
#include <numbers>

namespace raymortar
{
namespace
{
/// Facets whose normals differ by more have a sharp edge. Fine facets of a
/// round tool differ by less: cutting along all their edges would be of no use
const double sharp = std::cos(std::numbers::pi / 6.0);

template <class F>
class Rim
{
public:
  static constexpr int D = F::gdim;

  explicit Rim(const ToolFacets& facets) : _facets(facets) {}

  [[nodiscard]] std::vector<Box<D>> boxes() const
  {
    const std::vector<Edge> edges = sorted_edges();
    std::vector<Box<D>> found;
    for (std::size_t i = 0, j = 0; i < edges.size(); i = j)
    {
      while (j < edges.size() and edges[j].ends == edges[i].ends)
        ++j;
      if (j - i != 2 or is_sharp(edges[i], edges[i + 1]))
        found.push_back(box_of(edges[i]));
    }
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

  [[nodiscard]] bool is_sharp(const Edge& one, const Edge& other) const
  {
    const Frame<D> here = middle_of(one), there = middle_of(other);
    if (not(here.n.dot(there.n) < sharp))
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
} // namespace

template <int D>
std::vector<Box<D>> rim_boxes(const ToolFacets& facets)
{
  struct Kind
  {
    Shape shape;
    int node_degree;
  };
  return with_geometry(Kind{facets.shape, facets.degree},
                       [&]<class F>(F) -> std::vector<Box<D>>
                       {
                         if constexpr (F::gdim == D)
                           return Rim<F>(facets).boxes();
                         else
                           throw Error("facets of another dimension");
                       });
}

template std::vector<Box<2>> rim_boxes<2>(const ToolFacets&);
template std::vector<Box<3>> rim_boxes<3>(const ToolFacets&);
} // namespace raymortar
