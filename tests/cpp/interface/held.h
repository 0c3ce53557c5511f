#pragma once
#include "facet_types.h"
#include "fem/zones.h"
#include "raymortar/interface/held_facets.h"

/// Facets whose components are held, for the tests of what both sides hold
namespace raymortar::test
{
constexpr double modulus = 3.0;

/// 1 for each component of a dof that is held, by its undeformed position
template <class F>
using Held = std::function<Vec<F::gdim>(const Vec<F::gdim>&)>;

/// Which components of a surface are held, (dofs, gdim)
template <class F>
std::vector<double> fixed(const Surface& s, const Held<F>& held)
{
  std::vector<double> all(s.rows.size(), 0.0);
  for (Index f = 0; f < s.num_facets(); ++f)
  {
    const auto x = s.nodes<F>(s.X, f);
    for (int a = 0; a < F::dofs; ++a)
      Eigen::Map<Vec<F::gdim>>(all.data() + F::gdim * s.dofs_of<F>(f)[a]) =
          held(x.col(a));
  }
  return all;
}

/// Multiplier without friction, or the vector with it
enum class Law
{
  scalar,
  vector,
  friction
};

inline ContactState with_law(ContactState s, Law law)
{
  if (law == Law::scalar)
    s.multipliers.components = 1;
  if (law == Law::friction)
    s.friction = Stick();
  return s;
}

template <class F>
HeldFacets find(const ContactState& s, Law law, const Held<F>& slave,
                const Held<F>& master, double of = modulus)
{
  HeldFacets held;
  find_held_facets(with_law(s, law), fixed<F>(s.slave, slave),
                   fixed<F>(s.master, master), of, held);
  return held;
}

template <class F>
Vec<F::gdim> everything(const Vec<F::gdim>&)
{
  return Vec<F::gdim>::Ones();
}

template <class F>
Vec<F::gdim> nothing(const Vec<F::gdim>&)
{
  return Vec<F::gdim>::Zero();
}

/// Smallest first coordinate of the slave, and whether one is there
template <class F>
double first_edge(const ContactState& s)
{
  return s.slave.nodes<F>(s.slave.X, 0).row(0).minCoeff();
}

inline bool is_at(double edge, double x) { return x < edge + 1e-9; }

using HeldTypes = testing::Types<Interval1, Interval2, Triangle1, Quad1>;
} // namespace raymortar::test
