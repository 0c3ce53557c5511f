#include "raymortar/interface/cover_term.h"
#include "raymortar/interface/facet_blocks.h"

namespace raymortar
{
Unknowns columns_of(const ContactState& s, const ShareSlope& slope)
{
  Unknowns columns{slope.slave};
  (s.has_tools() ? columns.tool : columns.master) = slope.target;
  return columns;
}

Work CoverTerm::residual(const ContactState& s, VectorSink& sink) const
{
  add_facet_residuals(s, cover_blocks(s, _data), 1.0, sink);
  return {};
}

Work CoverTerm::tangent(const ContactState& s, MatrixSink& sink) const
{
  add_facet_tangents(s, cover_blocks(s, _data), 1.0, sink);
  if (not s.moving_segments)
    return {};
  std::vector<double> block;
  for (const ShareSlope& slope : share_slopes(s, _data))
  {
    const Unknowns columns = columns_of(s, slope);
    if (not sink.wants(columns))
      continue;
    block.clear();
    for (const double change : slope.change)
      for (const double share : slope.share)
        block.push_back(s.multipliers.scale * change * share);
    sink.add({no_index, slope.slave, no_index}, columns, block.data());
  }
  return {};
}
} // namespace raymortar
