#include "differences.h"
#include <Eigen/LU>
#include <Eigen/QR>

namespace raymortar::test
{
namespace
{
/// Central differences of f at x, one column per component
Matrix central(const Function& f, const Vector& x, double h)
{
  Matrix J(f(x).size(), x.size());
  for (Eigen::Index j = 0; j < x.size(); ++j)
  {
    const Vector e = h * Vector::Unit(x.size(), j);
    J.col(j) = (f(x + e) - f(x - e)) / (2.0 * h);
  }
  return J;
}
} // namespace

void expect_derivative(const Function& f, const Vector& x, const Matrix& J)
{
  ASSERT_TRUE(J.allFinite());
  const double scale = std::max(1.0, J.cwiseAbs().maxCoeff());
  const double coarse = (central(f, x, 1e-3) - J).cwiseAbs().maxCoeff();
  const double fine = (central(f, x, 1e-4) - J).cwiseAbs().maxCoeff();
  EXPECT_LE(fine, 1e-5 * scale);
  if (coarse > 1e-8 * scale)
  {
    EXPECT_NEAR(std::log10(coarse / fine), 2.0, 0.1);
  }
}

void expect_one_sided(const Function& f, const Vector& x, const Vector& d,
                      const Matrix& J)
{
  const double h = 1e-6;
  const Vector change = (f(x + h * d) - f(x)) / h;
  EXPECT_LE((change - J * d).cwiseAbs().maxCoeff(), 1e-4);
}

template <int D>
Mat<D, D> Random::rotation()
{
  Mat<D, D> A;
  for (int i = 0; i < D; ++i)
    A.col(i) = vector<D>();
  Mat<D, D> Q = Eigen::HouseholderQR<Mat<D, D>>(A).householderQ();
  Q.col(0) *= Q.determinant();
  return Q;
}

template Mat<2, 2> Random::rotation<2>();
template Mat<3, 3> Random::rotation<3>();
} // namespace raymortar::test
