#include "raymortar/element/facet_field.h"
#include "raymortar/geometry/dispatch.h"
#include "raymortar/geometry/frame.h"
#include <Eigen/Cholesky>

namespace raymortar
{
namespace
{
template <class F>
Mat<F::dofs, F::dofs> mass_matrix(const typename F::NodeMatrix& nodes,
                                  const QuadratureRule& rule)
{
  Mat<F::dofs, F::dofs> M = Mat<F::dofs, F::dofs>::Zero();
  for (std::size_t q = 0; q < rule.points.size(); ++q)
  {
    const typename F::RefPoint xi = rule.points[q].template head<F::tdim>();
    const Vec<F::dofs> N = F::Disp::values(xi);
    M += rule.weights[q] * frame_at<F>(nodes, xi).jacobian * N * N.transpose();
  }
  return M;
}

template <class F>
std::vector<double>
project(const Surface& slave, const IntegrationPoints& points,
        std::span<const double> values, const QuadratureRule& rule)
{
  constexpr int D = F::gdim;
  constexpr std::size_t width = static_cast<std::size_t>(F::dofs) * D;
  std::vector<double> field(
      static_cast<std::size_t>(slave.num_facets()) * width, 0.0);
  for (std::size_t q = 0; q < points.size(); ++q)
  {
    const Vec<F::dofs> N =
        F::Disp::values(points.xi[q].template head<F::tdim>());
    Eigen::Map<Mat<D, F::dofs>> load(
        field.data() + static_cast<std::size_t>(points.slave[q]) * width);
    load += points.area[q] * Eigen::Map<const Vec<D>>(values.data() + q * D) *
            N.transpose();
  }
  for (Index f = 0; f < slave.num_facets(); ++f)
  {
    Eigen::Map<Mat<D, F::dofs>> nodal(field.data() +
                                      static_cast<std::size_t>(f) * width);
    if (nodal.isZero(0.0))
      continue;
    const auto M = mass_matrix<F>(slave.nodes<F>(slave.X, f), rule);
    nodal = M.ldlt().solve(nodal.transpose()).transpose().eval();
  }
  return field;
}
} // namespace

std::vector<double> project_on_facets(const Surface& slave,
                                      const IntegrationPoints& points,
                                      std::span<const double> values,
                                      const QuadratureRule& facet_rule)
{
  return with_facet_type(slave,
                         [&]<class F>(F) {
                           return project<F>(slave, points, values, facet_rule);
                         });
}
} // namespace raymortar
