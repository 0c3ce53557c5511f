#include "raymortar/pairing/candidates.h"
#include "raymortar/geometry/dispatch.h"
#include "raymortar/geometry/frame.h"
#include "raymortar/geometry/patch.h"
#include "raymortar/pairing/cells.h"
#include "raymortar/pairing/group_pairs.h"
#include <algorithm>

namespace raymortar
{
namespace
{
/// A quadratic facet bulges out of the box of its nodes by at most this share
/// of its diameter as long as its mid nodes stay in the middle half
template <class F>
constexpr double bulge()
{
  return F::node_degree == 1 ? 1e-9 : 0.25;
}

template <class F>
Box<F::gdim> box_of(const typename F::NodeMatrix& nodes)
{
  return {nodes.rowwise().minCoeff(), nodes.rowwise().maxCoeff()};
}

template <class F>
std::vector<Box<F::gdim>> boxes_of(const Surface& s)
{
  std::vector<Box<F::gdim>> boxes;
  boxes.reserve(static_cast<std::size_t>(s.num_facets()));
  for (Index f = 0; f < s.num_facets(); ++f)
  {
    const auto nodes = s.nodes<F>(s.x, f);
    boxes.push_back(box_of<F>(nodes).inflated(bulge<F>() * diameter<F>(nodes)));
  }
  return boxes;
}

/// Box that a facet's points sweep along their rays.
///
/// Ends are taken at every node. Between the nodes the normal leaves the hull
/// of theirs: by 1 - cos(angle) at most while the un-normalised normal is a
/// mean of theirs (planar and bilinear facets, quadratic intervals), hence the
/// sagitta of their cone, doubled for quadratic facets in 3D.
template <class F>
Box<F::gdim> swept_box(const typename F::NodeMatrix& nodes,
                       const SearchDistances& distances)
{
  Box<F::gdim> box = box_of<F>(nodes);
  Mat<F::gdim, F::nodes> normals;
  for (int a = 0; a < F::nodes; ++a)
  {
    const typename F::RefPoint xi(
        F::Node::points[static_cast<std::size_t>(a)].data());
    const auto frame = frame_at<F>(nodes, xi);
    normals.col(a) = frame.n;
    for (const double g : {distances.reach, -distances.depth})
    {
      const typename F::Point end = frame.x + g * frame.n;
      box.lower = box.lower.cwiseMin(end);
      box.upper = box.upper.cwiseMax(end);
    }
  }
  const typename F::Point axis = normals.rowwise().mean().normalized();
  const double spread =
      (normals.colwise() - axis).colwise().squaredNorm().maxCoeff();
  const double sagitta = std::max(distances.reach, distances.depth) * spread *
                         (F::node_degree == 2 and F::tdim == 2 ? 1.0 : 0.5);
  return box.inflated(distances.skin + bulge<F>() * diameter<F>(nodes) +
                      (sagitta > 0.0 ? sagitta : 0.0));
}

template <class F>
std::vector<Box<F::gdim>> swept_boxes(const Surface& s,
                                      const FacetDistances& distances)
{
  std::vector<Box<F::gdim>> boxes;
  boxes.reserve(static_cast<std::size_t>(s.num_facets()));
  for (Index f = 0; f < s.num_facets(); ++f)
    boxes.push_back(swept_box<F>(s.nodes<F>(s.x, f), distances[f]));
  return boxes;
}

template <int D>
Candidates by_brute_force(std::span<const Box<D>> slaves,
                          std::span<const Box<D>> masters)
{
  Candidates c;
  for (const Box<D>& slave : slaves)
  {
    for (std::size_t m = 0; m < masters.size(); ++m)
      if (masters[m].overlaps(slave))
        c.masters.push_back(static_cast<Index>(m));
    c.offsets.push_back(static_cast<std::int64_t>(c.masters.size()));
  }
  return c;
}

/// In groups, whatever the order in which a mesh has its facets
template <int D>
Candidates by_tree(std::span<const Box<D>> slaves,
                   std::span<const Box<D>> masters)
{
  const BoxGroups groups = group_by_cells<D>(slaves);
  GroupPairs<D> pairs(slaves, masters);
  for (std::size_t k = 0; k < groups.size(); ++k)
    pairs.add(groups[k]);
  return pairs.in_order();
}
} // namespace

template <int D>
std::vector<Box<D>> ray_boxes(const Surface& slave,
                              const FacetDistances& distances)
{
  return with_geometry(slave,
                       [&]<class F>(F) -> std::vector<Box<D>>
                       {
                         if constexpr (F::gdim == D)
                           return swept_boxes<F>(slave, distances);
                         else
                           return {};
                       });
}

template <int D>
std::vector<Box<D>> facet_boxes(const Surface& surface)
{
  return with_geometry(surface,
                       [&]<class F>(F) -> std::vector<Box<D>>
                       {
                         if constexpr (F::gdim == D)
                           return boxes_of<F>(surface);
                         else
                           return {};
                       });
}

template std::vector<Box<2>> ray_boxes<2>(const Surface&,
                                          const FacetDistances&);
template std::vector<Box<3>> ray_boxes<3>(const Surface&,
                                          const FacetDistances&);
template std::vector<Box<2>> facet_boxes<2>(const Surface&);
template std::vector<Box<3>> facet_boxes<3>(const Surface&);

namespace
{
template <int D>
Candidates found_in_tree(const Surface& slave, const Surface& master,
                         const FacetDistances& distances)
{
  const auto slaves = ray_boxes<D>(slave, distances);
  const auto masters = facet_boxes<D>(master);
  return by_tree<D>(slaves, masters);
}

template <int D>
Candidates compared(const Surface& slave, const Surface& master,
                    const FacetDistances& distances)
{
  const auto slaves = ray_boxes<D>(slave, distances);
  const auto masters = facet_boxes<D>(master);
  return by_brute_force<D>(slaves, masters);
}
} // namespace

Candidates find_candidates(const Surface& slave, const Surface& master,
                           const FacetDistances& distances)
{
  return slave.gdim == 2 ? found_in_tree<2>(slave, master, distances)
                         : found_in_tree<3>(slave, master, distances);
}

Candidates compare_all_boxes(const Surface& slave, const Surface& master,
                             const FacetDistances& distances)
{
  return slave.gdim == 2 ? compared<2>(slave, master, distances)
                         : compared<3>(slave, master, distances);
}
} // namespace raymortar
