#include "raymortar/interface/held_facets.h"
#include "raymortar/geometry/dispatch.h"
#include "raymortar/geometry/facet_mass.h"
#include "raymortar/geometry/frame.h"
#include "raymortar/geometry/middle.h"
#include "raymortar/geometry/taylor.h"
#include "raymortar/pairing/facet_dofs.h"
#include "raymortar/target/freedom.h"
#include <algorithm>
#include <cmath>

namespace raymortar
{
namespace
{
/// Share of a facet that is rounding error
constexpr double unmet = 1e-9;
/// Part of a unit normal along some axes, up to which it is none
constexpr double along = 1e-6;

/// Integral of (v_a - Pi v_a)(v_b - Pi v_b) on a facet of area 1, Pi the
/// projection on polynomials of one degree less
template <class F>
Mat<F::dofs, F::dofs> roughness()
{
  if constexpr (F::degree == 1)
    return unit_deviation<F::shape, 1>();
  else
  {
    // A parabola of height b minus its mean is b (4 xi (1 - xi) - 2 / 3)
    static_assert(F::shape == Shape::interval);
    const Vec<F::dofs> height(-0.5, -0.5, 1.0);
    return 4.0 / 45.0 * height * height.transpose();
  }
}

/// 1 where a node of a facet is held, (gdim, dofs per facet)
template <class F>
Mat<F::gdim, F::dofs> held_nodes(const Surface& s, Index facet,
                                 std::span<const double> fixed)
{
  Mat<F::gdim, F::dofs> held;
  const auto dofs = s.dofs_of<F>(facet);
  for (std::size_t a = 0; a < F::dofs; ++a)
    for (std::size_t i = 0; i < F::gdim; ++i)
      held(static_cast<int>(i), static_cast<int>(a)) =
          fixed[static_cast<std::size_t>(dofs[a]) * F::gdim + i] != 0.0;
  return held;
}

/// A slave facet with its held nodes, and integrals over its hits that tell by
/// component how much of what lies opposite to them is held
template <class F>
struct Candidate
{
  Index slave;
  Mat<F::gdim, F::dofs> held;
  bool has_met = false;
  Vec<F::gdim> opposite_held = Vec<F::gdim>::Zero();
  Vec<F::gdim> all = Vec<F::gdim>::Zero();
  /// Area that has met any free node, by component, and all that has met
  Vec<F::gdim> felt = Vec<F::gdim>::Zero();
  double met = 0.0;

  /// Whether neither this facet nor what lies opposite is free
  [[nodiscard]] bool is_unfelt(int i) const
  {
    return held.row(i).sum() == F::dofs and felt[i] <= unmet * met;
  }

  /// Share of what lies opposite that is held, in [0, 1]; 0 for components that
  /// are not held here [theory (5.6)]
  [[nodiscard]] Vec<F::gdim> share() const
  {
    Vec<F::gdim> share = Vec<F::gdim>::Zero();
    for (int i = 0; i < F::gdim; ++i)
      if (all[i] > 0.0)
        share[i] = std::clamp(opposite_held[i] / all[i], 0.0, 1.0);
    return share;
  }
};

/// Facets with held nodes that have not met a master yet; all others are known
template <class F>
std::vector<Candidate<F>> candidates(const Surface& slave,
                                     std::span<const double> fixed,
                                     std::span<std::int8_t> known)
{
  std::vector<Candidate<F>> found;
  for (Index f = 0; f < slave.num_facets(); ++f)
  {
    if (known[f])
      continue;
    Candidate<F> one{f, held_nodes<F>(slave, f, fixed)};
    if (one.held.isZero(0.0))
      known[f] = 1;
    else
      found.push_back(one);
  }
  return found;
}

/// Shares of the nodes at a point, positive for quadratic functions too
template <int D>
Eigen::VectorXd nearness(const Surface& s, const Vec<2>& xi)
{
  const Eigen::VectorXd N =
      shape_taylor<D - 1>(s.shape, s.degree, xi.head<D - 1>())
          .col(0)
          .cwiseAbs();
  return N / N.sum();
}

/// By component, how much of a master facet is held at one of its points
template <int D>
Vec<D> held_opposite(const Surface& master, Index facet, const Vec<2>& eta,
                     std::span<const double> fixed)
{
  const Eigen::VectorXd shares = nearness<D>(master, eta);
  Vec<D> held = Vec<D>::Zero();
  Eigen::Index k = 0;
  for_facet_dofs(master, facet,
                 [&](std::size_t dof)
                 {
                   if (fixed[dof] != 0.0)
                     held[k % D] += shares[k / D];
                   ++k;
                 });
  return held;
}

/// By component, 1 where a master facet is free
template <int D>
Vec<D> free_opposite(const Surface& master, Index facet,
                     std::span<const double> fixed)
{
  Vec<D> free = Vec<D>::Zero();
  Eigen::Index k = 0;
  for_facet_dofs(master, facet,
                 [&](std::size_t dof)
                 {
                   if (fixed[dof] == 0.0)
                     free[k % D] = 1.0;
                   ++k;
                 });
  return free;
}

/// By component, 1 where a tool is free
template <int D>
Vec<D> free_motion(const PlacedTool& tool)
{
  Vec<D> free = Vec<D>::Zero();
  if (const Freedom* const freedom = freedom_of(tool))
    for (const Freedom::Rate& rate : freedom->rates)
      for (int i = 0; i < D; ++i)
        if (rate.drift[i] != 0.0 or not rate.spin.row(i).isZero(0.0))
          free[i] = 1.0;
  return free;
}

template <class F>
void look_opposite(const ContactState& s, std::span<const double> fixed_master,
                   std::vector<Candidate<F>>& found)
{
  std::vector<Candidate<F>*> of_facet(s.slave.num_facets(), nullptr);
  for (Candidate<F>& one : found)
    of_facet[one.slave] = &one;
  for (std::size_t q = 0; q < s.points.size(); ++q)
  {
    Candidate<F>* one = of_facet[s.points.slave[q]];
    if (one == nullptr or s.hits.status[q] != RayStatus::hit)
      continue;
    const Vec<F::gdim> at_held =
        s.points.area[q] *
        (one->held * nearness<F::gdim>(s.slave, s.points.xi[q]));
    // Tools are held throughout
    const Vec<F::gdim> held =
        s.has_tools() ? Vec<F::gdim>::Ones().eval()
                      : held_opposite<F::gdim>(s.master, s.hits.master[q],
                                               s.hits.eta[q], fixed_master);
    const auto met = static_cast<std::size_t>(s.hits.master[q]);
    one->felt +=
        s.points.area[q] *
        (s.has_tools() ? free_motion<F::gdim>(s.tools[met])
                       : free_opposite<F::gdim>(s.master, s.hits.master[q],
                                                fixed_master));
    one->met += s.points.area[q];
    one->has_met = true;
    one->all += at_held;
    one->opposite_held += at_held.cwiseProduct(held);
  }
}

/// Weights where friction keeps what nothing feels of a traction along the
/// surface (5.22); of a pressure that nothing feels nothing else tells
/// [theory (5.23)]
template <class F>
Mat<F::gdim, F::gdim> frictional_weights(const Candidate<F>& one,
                                         const Vec<F::gdim>& n)
{
  Vec<F::gdim> damped = one.share();
  Vec<F::gdim> pressure = Vec<F::gdim>::Zero();
  double moves = 0.0;
  for (int i = 0; i < F::gdim; ++i)
    if (one.is_unfelt(i))
    {
      pressure[i] = std::sqrt(damped[i]) * n[i];
      damped[i] = 0.0;
    }
    else
      moves = std::hypot(moves, n[i]);
  Mat<F::gdim, F::gdim> W = damped.asDiagonal();
  if (moves <= along)
    W += pressure * pressure.transpose();
  return W;
}

/// Weight of a multiplier along the normal, by how much of the normal may move
/// here. Without friction only a node that is held along the normal has a
/// traction in excess: rollers along the surface, or nearly so, change nothing
/// [theory (5.7)]
template <int D>
double normal_weight(const Vec<D>& share, const Vec<D>& moves, const Vec<D>& n)
{
  const Vec<D> squares = n.cwiseAbs2();
  return std::max(0.0, 1.0 - 2.0 * moves.dot(squares)) * share.dot(squares);
}

/// Weights of the multiplier's components, (components, components)
/// [theory (5.7)]
template <class F>
Eigen::MatrixXd weights(const ContactState& s, const Candidate<F>& one,
                        const Vec<F::gdim>& n)
{
  const Vec<F::gdim> damped = one.share();
  if (s.friction)
    return damped.asDiagonal();
  const Vec<F::gdim> moves =
      (one.held.rowwise().sum().array() == 0.0).template cast<double>();
  const double w = normal_weight<F::gdim>(damped, moves, n);
  if (s.multipliers.components == 1)
    return Eigen::MatrixXd::Constant(1, 1, w);
  return w * n * n.transpose();
}

template <class F>
auto middle_frame(const ContactState& s, Index facet)
{
  return frame_at<F>(s.slave.nodes<F>(s.slave.X, facet),
                     middle_of_reference<F>());
}

template <class F>
FacetBlock damping(const ContactState& s, double modulus,
                   const Candidate<F>& one, bool is_kept = false)
{
  const auto frame = middle_frame<F>(s, one.slave);
  const double area = s.points.whole[one.slave];
  const double size = s.points.width[one.slave];
  const Eigen::MatrixXd W =
      size * area / modulus *
      (is_kept ? Eigen::MatrixXd(frictional_weights<F>(one, frame.n))
               : weights<F>(s, one, frame.n));
  const Mat<F::dofs, F::dofs> S = roughness<F>();
  const Eigen::Index m = W.rows();
  FacetBlock facet{one.slave, {}};
  for (Eigen::Index k = 0; k < F::dofs * m; ++k)
    for (Eigen::Index j = 0; j < F::dofs * m; ++j)
      facet.block.push_back(S(k / m, j / m) * W(k % m, j % m));
  return facet;
}

/// Mark the nodes of a facet that are held along its normal, as is some of what
/// they face
template <class F>
void mark_nodes(const ContactState& s, const Candidate<F>& one,
                std::span<std::int8_t> nodes)
{
  const Vec<F::gdim> n = middle_frame<F>(s, one.slave).n;
  const Vec<F::gdim> share = one.share();
  const auto first = static_cast<std::size_t>(one.slave) * F::dofs;
  for (std::size_t a = 0; a < F::dofs; ++a)
  {
    const Vec<F::gdim> moves =
        Vec<F::gdim>::Ones() - one.held.col(static_cast<int>(a));
    nodes[first + a] = normal_weight<F::gdim>(share, moves, n) > unmet;
  }
}

bool may_be_damped(const ContactState& s)
{
  return s.multipliers.components > 0 and
         s.multipliers.degree == s.slave.degree and
         (s.slave.degree == 1 or s.slave.gdim == 2);
}

bool is_zero(const FacetBlock& f)
{
  return std::all_of(f.block.begin(), f.block.end(),
                     [](double v) { return v == 0.0; });
}
} // namespace

std::vector<Index> facets_with_held_nodes(const ContactState& s,
                                          std::span<const double> fixed_slave)
{
  std::vector<Index> facets;
  if (s.multipliers.components == 0)
    return facets;
  const auto add = [&]<class F>(F)
  {
    for (Index f = 0; f < s.slave.num_facets(); ++f)
      if (not held_nodes<F>(s.slave, f, fixed_slave).isZero(0.0))
        facets.push_back(f);
  };
  with_facet_type(s.slave, add);
  return facets;
}

void find_held_facets(const ContactState& s,
                      std::span<const double> fixed_slave,
                      std::span<const double> fixed_master, double modulus,
                      HeldFacets& held)
{
  if (s.multipliers.components == 0)
    return;
  const auto facets = static_cast<std::size_t>(s.slave.num_facets());
  const auto d = static_cast<std::size_t>(s.slave.gdim);
  held.known.resize(facets, 0);
  held.unfelt.resize(facets * d, 0);
  held.nodes.resize(s.slave.facet_dofs.size(), 0);
  const auto add = [&]<class F>(F)
  {
    auto found = candidates<F>(s.slave, fixed_slave, held.known);
    if (found.empty())
      return;
    look_opposite<F>(s, fixed_master, found);
    for (const Candidate<F>& one : found)
    {
      held.known[one.slave] = one.has_met;
      for (int i = 0; i < F::gdim; ++i)
        held.unfelt[static_cast<std::size_t>(one.slave) * d +
                    static_cast<std::size_t>(i)] = one.is_unfelt(i);
      mark_nodes<F>(s, one, held.nodes);
      if constexpr (F::degree == 1 or F::tdim == 1)
        if (may_be_damped(s) and not one.share().isZero(0.0))
        {
          const FacetBlock full = damping<F>(s, modulus, one);
          if (is_zero(full))
            continue; // rollers along the surface
          held.facets.push_back(full);
          held.rest.push_back(s.friction ? damping<F>(s, modulus, one, true)
                                         : full);
        }
    }
  };
  with_facet_type(s.slave, add);
}

std::vector<FacetBlock>
find_crossing_facets(const ContactState& s,
                     std::span<const std::int8_t> crossing, double modulus)
{
  std::vector<FacetBlock> facets;
  if (not may_be_damped(s))
    return facets;
  const auto add = [&]<class F>(F)
  {
    if constexpr (F::degree == 1 or F::tdim == 1)
      for (Index f = 0; f < s.slave.num_facets(); ++f)
      {
        const auto dofs = s.slave.dofs_of<F>(f);
        if (std::none_of(dofs.begin(), dofs.end(),
                         [&](Index dof) { return crossing[dof] != 0; }))
          continue;
        Candidate<F> one{f, Mat<F::gdim, F::dofs>::Ones()};
        one.all = one.opposite_held = Vec<F::gdim>::Ones();
        facets.push_back(damping<F>(s, modulus, one));
      }
  };
  with_facet_type(s.slave, add);
  return facets;
}
} // namespace raymortar
