// The multiplier's equation on slave facets that no master covers throughout.
#pragma once

#include "raymortar/element/cover.h"
#include "raymortar/interface/term.h"

namespace raymortar
{
/// @brief Adds the equations of uncovered parts [theory (5.9)-(5.11)]. It
/// decides nothing: the covered share comes from the state.
class CoverTerm final : public Term
{
public:
  explicit CoverTerm(const ContactState& s)
  {
    _data.corners.assign(s.multipliers.row.size(), 0);
  }

  void set_shear_modulus(double modulus) { _data.shear_modulus = modulus; }
  void set_nodes(std::vector<std::int8_t> nodes)
  {
    _data.nodes = std::move(nodes);
  }
  void set_corners(std::vector<std::int8_t> corners)
  {
    _data.corners = std::move(corners);
  }

  [[nodiscard]] const CoverData& data() const { return _data; }

  [[nodiscard]] CoverTerm* cover() override { return this; }
  /// Nodes that are covered on this rank, until the zone tells of others
  void set_up(ContactState& s) override { set_nodes(covered_nodes(s)); }
  Work residual(const ContactState& s, VectorSink& sink) const override;
  /// Segments have the same pairs of facets: the mortar term needs them
  Work tangent(const ContactState& s, MatrixSink& sink) const override;

private:
  CoverData _data;
};

/// @brief Unknowns that the share of a segment varies with.
[[nodiscard]] Unknowns columns_of(const ContactState& s,
                                  const ShareSlope& slope);
} // namespace raymortar
