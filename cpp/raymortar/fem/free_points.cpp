#include "raymortar/fem/free_points.h"

namespace raymortar
{
namespace
{
bool any_free(const Surface& s, Index facet, const std::vector<double>& fixed)
{
  const auto n = static_cast<std::size_t>(s.dofs_per_facet());
  const auto d = static_cast<std::size_t>(s.gdim);
  for (std::size_t a = 0; a < n; ++a)
  {
    const auto dof = static_cast<std::size_t>(
        s.facet_dofs[static_cast<std::size_t>(facet) * n + a]);
    for (std::size_t i = 0; i < d; ++i)
      if (fixed[dof * d + i] == 0.0)
        return true;
  }
  return false;
}
} // namespace

std::vector<std::int8_t> free_points(const Zone& zone)
{
  const ContactState& s = zone.state();
  std::vector<std::int8_t> free(s.points.size(), 0);
  for (std::size_t e = 0; e < s.elements.size(); ++e)
  {
    const Index m = s.elements.master[e];
    const bool moves =
        any_free(s.slave, s.elements.slave[e], zone.fixed_slave()) or
        (m != no_index and any_free(s.master, m, zone.fixed_master()));
    for (const Index q : s.elements.points_of(e))
      free[static_cast<std::size_t>(q)] = moves;
  }
  return free;
}
} // namespace raymortar
