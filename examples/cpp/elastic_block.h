// A rectangle of four-node cells in plane strain: any finite element code of
// your own stands here.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

struct Material
{
  double E;  ///< Young's modulus, force per area
  double nu; ///< Poisson's ratio
};

/// @brief Structured mesh; node (i, j) has the number i + (cells[0] + 1) j.
struct ElasticBlock
{
  std::array<double, 2> lower; ///< corner, length
  std::array<double, 2> size;
  std::array<int, 2> cells;
  Material material;

  [[nodiscard]] int num_nodes() const
  {
    return (cells[0] + 1) * (cells[1] + 1);
  }
  [[nodiscard]] int node(int i, int j) const { return i + (cells[0] + 1) * j; }
  [[nodiscard]] std::array<double, 2> position(int node) const;

  /// Nodes along the lower or upper side, with the body on the left of the
  /// way: the order in which raymortar finds the normal pointing outward
  [[nodiscard]] std::vector<int> bottom() const;
  [[nodiscard]] std::vector<int> top() const;

  /// Corner nodes of every cell
  [[nodiscard]] std::vector<std::array<int, 4>> connectivity() const;

  /// Stiffness of a cell, all being equal; dofs (node 0 x, node 0 y, ...)
  [[nodiscard]] Eigen::Matrix<double, 8, 8, Eigen::RowMajor> stiffness() const;
};
