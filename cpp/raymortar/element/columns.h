// From Taylor coefficients at a point to the unknowns they are made of.
#pragma once

#include "raymortar/core/types.h"
#include <array>

namespace raymortar
{
/// @brief How the Taylor coefficients of one side of an element hang on its
/// unknowns: of node a and coefficient p, B(p, a) times each component.
///
/// A facet's motion has one column of B per node and gdim components; a body
/// that moves as a whole has one per degree of freedom and one component, its
/// rows being those of all components.
struct Columns
{
  static constexpr int most = 9;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor, most,
                most>
      B;
  int components = 1;

  [[nodiscard]] Eigen::Index unknowns() const { return B.cols() * components; }
};

/// @brief Sides of an element in the order of its unknowns: slave, multiplier,
/// target.
using ElementColumns = std::array<Columns, 3>;

[[nodiscard]] inline Eigen::Index unknowns_of(const ElementColumns& sides)
{
  return sides[0].unknowns() + sides[1].unknowns() + sides[2].unknowns();
}

/// @brief Rows over unknowns from rows over coefficients.
/// @param[in] in Row-major, (coefficients, columns)
/// @param[out] out Row-major, (unknowns, columns)
inline void expand_rows(const ElementColumns& sides, const double* in,
                        Eigen::Index columns, double* out)
{
  using Rows =
      Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  for (const Columns& side : sides)
  {
    const Eigen::Index width = side.components * columns;
    const Eigen::Map<const Rows> from(in, side.B.rows(), width);
    Eigen::Map<Rows>(out, side.B.cols(), width).noalias() =
        side.B.transpose().lazyProduct(from);
    in += side.B.rows() * width;
    out += side.B.cols() * width;
  }
}

/// @brief A square block over unknowns from one over coefficients.
class BlockExpansion
{
public:
  using Block =
      Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  /// @brief Add to a block over the unknowns.
  /// @param[in] in Over the coefficients
  template <class In>
  void add(const ElementColumns& sides, const In& in, Block& out)
  {
    const Eigen::Index n = unknowns_of(sides), c = in.rows();
    _rows.resize(n, c);
    expand_rows(sides, in.data(), c, _rows.data());
    _turned = _rows.transpose();
    _both.resize(n, n);
    expand_rows(sides, _turned.data(), n, _both.data());
    out += _both.transpose();
  }

private:
  Block _rows, _turned, _both; ///< kept: no allocation per point
};
} // namespace raymortar
