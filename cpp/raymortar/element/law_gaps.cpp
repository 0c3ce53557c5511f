#include "raymortar/element/law_gaps.h"
#include "raymortar/geometry/dispatch.h"

namespace raymortar
{
std::vector<double> law_gaps(const ContactState& s)
{
  std::vector<double> gaps = s.hits.gap;
  if (s.offset.empty())
    return gaps;
  const auto add = [&]<class F>(F)
  {
    for (std::size_t q = 0; q < gaps.size(); ++q)
      gaps[q] += s.offset.at<F>(
          s.points.slave[q],
          F::Disp::values(s.points.xi[q].template head<F::tdim>()));
  };
  with_facet_type(s.slave, add);
  return gaps;
}
} // namespace raymortar
