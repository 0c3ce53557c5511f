#include "elastic_block.h"
#include <cmath>

namespace
{
/// Plane strain: (e_xx, e_yy, 2 e_xy) to (s_xx, s_yy, s_xy)
Eigen::Matrix3d elasticity(const Material& m)
{
  const double mu = m.E / (2 * (1 + m.nu));
  const double lambda = m.E * m.nu / ((1 + m.nu) * (1 - 2 * m.nu));
  Eigen::Matrix3d C = Eigen::Matrix3d::Zero();
  C.topLeftCorner<2, 2>().setConstant(lambda);
  C.diagonal() += Eigen::Vector3d(2 * mu, 2 * mu, mu);
  return C;
}
} // namespace

std::array<double, 2> ElasticBlock::position(int node) const
{
  const int i = node % (cells[0] + 1), j = node / (cells[0] + 1);
  return {lower[0] + size[0] * i / cells[0], lower[1] + size[1] * j / cells[1]};
}

std::vector<int> ElasticBlock::bottom() const
{
  std::vector<int> nodes;
  for (int i = 0; i <= cells[0]; ++i)
    nodes.push_back(node(i, 0));
  return nodes;
}

std::vector<int> ElasticBlock::top() const
{
  std::vector<int> nodes;
  for (int i = cells[0]; i >= 0; --i)
    nodes.push_back(node(i, cells[1]));
  return nodes;
}

std::vector<std::array<int, 4>> ElasticBlock::connectivity() const
{
  std::vector<std::array<int, 4>> all;
  for (int j = 0; j < cells[1]; ++j)
    for (int i = 0; i < cells[0]; ++i)
      all.push_back(
          {node(i, j), node(i + 1, j), node(i, j + 1), node(i + 1, j + 1)});
  return all;
}

Eigen::Matrix<double, 8, 8, Eigen::RowMajor> ElasticBlock::stiffness() const
{
  const double hx = size[0] / cells[0], hy = size[1] / cells[1];
  const Eigen::Matrix3d C = elasticity(material);
  const double gauss[] = {0.5 - std::sqrt(1.0 / 12), 0.5 + std::sqrt(1.0 / 12)};
  Eigen::Matrix<double, 8, 8, Eigen::RowMajor> K;
  K.setZero();
  for (const double s : gauss)
    for (const double t : gauss)
    {
      const double dN_dx[] = {-(1 - t) / hx, (1 - t) / hx, -t / hx, t / hx};
      const double dN_dy[] = {-(1 - s) / hy, -s / hy, (1 - s) / hy, s / hy};
      Eigen::Matrix<double, 3, 8> B = Eigen::Matrix<double, 3, 8>::Zero();
      for (int a = 0; a < 4; ++a)
      {
        B(0, 2 * a) = B(2, 2 * a + 1) = dN_dx[a];
        B(1, 2 * a + 1) = B(2, 2 * a) = dN_dy[a];
      }
      K += 0.25 * hx * hy * B.transpose() * C * B;
    }
  return K;
}
