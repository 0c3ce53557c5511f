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

PointResults results_without_hits(const ContactState& s)
{
  const std::size_t n = s.points.size();
  const std::vector<double> scalars(n, 0.0);
  const std::vector<double> vectors(n * static_cast<std::size_t>(s.slave.gdim),
                                    0.0);
  const std::vector<double> slips =
      s.friction ? vectors : std::vector<double>{};
  const bool elastic = s.has_elastic_slip();
  return {.status = std::vector<ContactStatus>(n, ContactStatus::none),
          .gap = law_gaps(s),
          .pressure = scalars,
          .traction = vectors,
          .weight = scalars,
          .x = vectors,
          .normal = vectors,
          .contact_normal = vectors,
          .master_normal = vectors,
          .gamma = scalars,
          .slip = slips,
          .closing = s.friction ? scalars : std::vector<double>{},
          .friction = slips,
          .dissipated = s.friction ? scalars : std::vector<double>{},
          .elastic_slip = elastic ? vectors : std::vector<double>{},
          .elastic_energy = elastic ? scalars : std::vector<double>{}};
}
} // namespace raymortar
