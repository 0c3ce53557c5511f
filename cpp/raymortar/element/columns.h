// From Taylor coefficients at a point to the unknowns they are made of.
#pragma once

#include "raymortar/core/types.h"
#include <algorithm>
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

/// @brief One row over unknowns: the sum of P rows with the factors of a column
/// of B. Plain loops: Eigen's products of such sizes take several times as
/// long.
template <int P>
void expand_row(const Columns& side, Eigen::Index column, const double* in,
                Eigen::Index width, double* __restrict out)
{
  std::array<double, static_cast<std::size_t>(P)> b;
  for (int p = 0; p < P; ++p)
    b[static_cast<std::size_t>(p)] = side.B(p, column);
  for (Eigen::Index k = 0; k < width; ++k)
  {
    double sum = b[0] * in[k];
    for (int p = 1; p < P; ++p)
      sum += b[static_cast<std::size_t>(p)] * in[p * width + k];
    out[k] = sum;
  }
}

/// @brief Rows over unknowns from rows over coefficients.
/// @param[in] in Row-major, (coefficients, columns)
/// @param[out] out Row-major, (unknowns, columns)
inline void expand_rows(const ElementColumns& sides, const double* in,
                        Eigen::Index columns, double* __restrict out)
{
  for (const Columns& side : sides)
  {
    const Eigen::Index width = side.components * columns;
    const Eigen::Index coefficients = side.B.rows();
    for (Eigen::Index a = 0; a < side.B.cols(); ++a, out += width)
    {
      if (coefficients == 2)
        expand_row<2>(side, a, in, width, out);
      else if (coefficients == 3)
        expand_row<3>(side, a, in, width, out);
      else
      {
        std::fill_n(out, width, 0.0);
        for (Eigen::Index p = 0; p < coefficients; ++p)
          for (Eigen::Index k = 0; k < width; ++k)
            out[k] += side.B(p, a) * in[p * width + k];
      }
    }
    in += coefficients * width;
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
