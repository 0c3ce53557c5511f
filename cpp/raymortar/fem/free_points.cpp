#include "raymortar/fem/free_points.h"
#include "raymortar/element/free_tools.h"
#include "raymortar/pairing/facet_dofs.h"

namespace raymortar
{
namespace
{
bool any_free(const Surface& s, Index facet, const std::vector<double>& fixed)
{
  bool any = false;
  for_facet_dofs(s, facet,
                 [&](std::size_t k) { any = any or fixed[k] == 0.0; });
  return any;
}
} // namespace

std::vector<std::int8_t> free_points(const Zone& zone)
{
  const ContactState& s = zone.state();
  std::vector<std::int8_t> free(s.points.size(), 0);
  for (std::size_t e = 0; e < s.elements.size(); ++e)
  {
    const Index m = s.master_of(e);
    const bool moves =
        any_free(s.slave, s.elements.slave[e], zone.fixed_slave()) or
        (m != no_index and any_free(s.master, m, zone.fixed_master())) or
        free_tool_of(s, e) != no_index;
    for (const Index q : s.elements.points_of(e))
      free[q] = moves ? 1 : 0;
  }
  return free;
}
} // namespace raymortar
