#include "raymortar/element/any_blocks.h"

namespace raymortar
{
namespace
{
/// Add the sum of some rows over the first `count` unknowns, each times a
/// factor, to one of a block
template <int R, int D>
void add_sum(const std::array<double, static_cast<std::size_t>(R)>& by,
             const UnknownRows<R, D>& rows, int count, double* __restrict out)
{
  for (std::size_t k = 0; k < static_cast<std::size_t>(count); ++k)
  {
    double sum = by[0] * rows[0][k];
    for (std::size_t r = 1; r < R; ++r)
      sum += by[r] * rows[r][k];
    out[k] += sum;
  }
}

void add_row(double by, const double* row, int count, double* __restrict out)
{
  for (int k = 0; k < count; ++k)
    out[k] += by * row[k];
}

template <int N>
std::array<double, static_cast<std::size_t>(N)> factors(const Vec<N>& v)
{
  std::array<double, static_cast<std::size_t>(N)> by;
  for (int i = 0; i < N; ++i)
    by[static_cast<std::size_t>(i)] = v[i];
  return by;
}

template <int R, int D>
void set_columns(const Mat<R, D>& m, std::size_t first, UnknownRows<R, D>& out)
{
  for (std::size_t r = 0; r < R; ++r)
    for (std::size_t i = 0; i < D; ++i)
      out[r][first + i] =
          m(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(i));
}

/// A body's columns: rows over value and derivatives times how these move
template <int R, int D>
void expand_body(const PointShapes<D>& at, const TaylorRows<R, D>& in,
                 int parts, UnknownRows<R, D>& out)
{
  const auto first = static_cast<std::size_t>(at.alone());
  for (std::size_t r = 0; r < R; ++r)
  {
    Eigen::Matrix<double, 1, 6> sum = Eigen::Matrix<double, 1, 6>::Zero();
    for (int p = 0; p < parts; ++p)
      for (int i = 0; i < D; ++i)
        sum += in.target[static_cast<std::size_t>(p)](
                   static_cast<Eigen::Index>(r), i) *
               at.body.row(D * p + i);
    for (int j = 0; j < at.body_unknowns; ++j)
      out[r][first + static_cast<std::size_t>(j)] = sum[j];
  }
}
} // namespace

template <int R, int D>
void expand(const PointShapes<D>& at, const TaylorRows<R, D>& in,
            TargetPart part, UnknownRows<R, D>& out)
{
  for (std::size_t a = 0; a < static_cast<std::size_t>(at.slave_nodes); ++a)
  {
    const auto& N = at.slave[a];
    Mat<R, D> m = N[0] * in.slave[0] + N[1] * in.slave[1];
    if constexpr (D == 3)
      m += N[2] * in.slave[2];
    set_columns<R, D>(m, D * a, out);
  }
  if (part == TargetPart::none)
    return;
  const std::size_t parts = part == TargetPart::all ? D : 1;
  const auto first = static_cast<std::size_t>(at.alone());
  for (std::size_t a = 0; a < static_cast<std::size_t>(at.target_nodes); ++a)
  {
    const auto& N = at.target[a];
    Mat<R, D> m = N[0] * in.target[0];
    for (std::size_t j = 1; j < parts; ++j)
      m += N[j] * in.target[j];
    set_columns<R, D>(m, first + D * a, out);
  }
  if (at.body_unknowns > 0)
    expand_body<R, D>(at, in, static_cast<int>(parts), out);
}

template <int D>
void AnyBlocks<D>::add_work_rows(double w, const UnknownRows<D, D>& rows,
                                 int count, const Shapes& at)
{
  const int n = at.size();
  double* out = A.data();
  for (int a = 0; a < at.slave_nodes; ++a)
    for (const auto& row : rows)
    {
      add_row(-w * at.slave_value(a), row.data(), count, out);
      out += n;
    }
  out = A.data() + at.alone() * n;
  for (int a = 0; a < at.target_nodes; ++a)
    for (const auto& row : rows)
    {
      add_row(w * at.target_value(a), row.data(), count, out);
      out += n;
    }
  for (int j = 0; j < at.body_unknowns; ++j, out += n)
    add_sum<D, D>(factors<D>(w * at.body.col(j).template head<D>()), rows,
                  count, out);
}

template <int D>
void AnyBlocks<D>::add_multiplier(double w, const Shapes& at)
{
  const int n = at.size();
  for (int k = 0; k < at.multipliers; ++k)
  {
    const double by = w * at.multiplier_value(k);
    for (int i = 0; i < D; ++i)
    {
      double* column = A.data() + at.side() + k * D + i;
      for (int a = 0; a < at.slave_nodes; ++a)
        column[(D * a + i) * n] -= by * at.slave_value(a);
      column += at.alone() * n;
      for (int a = 0; a < at.target_nodes; ++a)
        column[(D * a + i) * n] += by * at.target_value(a);
      for (int j = 0; j < at.body_unknowns; ++j)
        column[j * n] += by * at.body(i, j);
    }
  }
}

template <int D>
UnknownRows<D - 1, D> AnyBlocks<D>::slide_rows(const TaylorRows<T, D>& eta,
                                               const Shapes& at)
{
  UnknownRows<T, D> rows;
  expand<T, D>(at, eta, TargetPart::value, rows);
  for (auto& row : rows)
    std::fill(row.begin() + at.side(), row.begin() + at.alone(), 0.0);
  return rows;
}

template <int D>
void AnyBlocks<D>::add_slide(const Vec<D>& f, const TaylorRows<T, D>& eta,
                             const Shapes& at)
{
  const UnknownRows<T, D> rows = slide_rows(eta, at);
  const int n = at.size();
  double* out = A.data() + at.alone() * n;
  for (int a = 0; a < at.target_nodes; ++a)
    for (int i = 0; i < D; ++i, out += n)
      add_sum<T, D>(factors<T>(f[i] * at.target_gradient(a)), rows, n, out);
  for (int j = 0; j < at.body_unknowns; ++j, out += n)
  {
    Vec<T> by;
    for (int i = 0; i < T; ++i)
      by[i] = at.body.col(j).template segment<D>(D * (1 + i)).dot(f);
    add_sum<T, D>(factors<T>(by), rows, n, out);
  }
}

template <int D>
template <int M>
void AnyBlocks<D>::add_condition_rows(double w, const UnknownRows<M, D>& rows,
                                      int count, const Shapes& at)
{
  const int n = at.size();
  double* out = A.data() + at.side() * n;
  for (int k = 0; k < at.multipliers; ++k)
    for (const auto& row : rows)
    {
      add_row(w * at.multiplier_value(k), row.data(), count, out);
      out += n;
    }
}

template <int D>
void AnyBlocks<D>::add_turn_rows(Side side, double w, const Vec<D>& n,
                                 const UnknownRows<T, D>& rows,
                                 const Vec<T>& held, const Mat<D, T>& dual,
                                 const Shapes& at)
{
  const bool of_slave = side == Side::slave;
  const int nodes = of_slave ? at.slave_nodes : at.target_nodes;
  const int first = of_slave ? 0 : at.alone();
  const auto gradient = [&](int a)
  { return of_slave ? at.slave_gradient(a) : at.target_gradient(a); };
  std::array<Vec<D>, 9> G; // surface gradients of shape functions
  for (int a = 0; a < nodes; ++a)
    G[place(a)] = dual * gradient(a);
  const int size = at.size();
  std::array<double, most> row;
  for (int a = 0; a < nodes; ++a)
  {
    const Vec<T> dN = gradient(a);
    std::fill_n(row.begin(), size, 0.0);
    add_sum<T, D>(factors<T>(dN), rows, size, row.data());
    const double by = w * dN.dot(held);
    for (int i = 0; i < D; ++i)
    {
      double* const out = A.data() + (first + D * a + i) * size;
      add_row(w * n[i], row.data(), size, out);
      for (int c = 0; c < nodes; ++c)
        for (int k = 0; k < D; ++k)
          out[first + D * c + k] += by * G[place(c)][i] * n[k];
    }
  }
  if (not of_slave)
    add_body_turn_rows(w, n, rows, held, dual, at);
}

template <int D>
void AnyBlocks<D>::add_body_turn_rows(double w, const Vec<D>& n,
                                      const UnknownRows<T, D>& rows,
                                      const Vec<T>& held, const Mat<D, T>& dual,
                                      const Shapes& at)
{
  const int size = at.size(), first = at.alone();
  for (int j = 0; j < at.body_unknowns; ++j)
  {
    double* const out = A.data() + (first + j) * size;
    add_sum<T, D>(factors<T>(Vec<T>(w * at.body_rates(j, n))), rows, size, out);
    Vec<D> moved = Vec<D>::Zero(); // by which the normal's change counts
    for (int k = 0; k < T; ++k)
      moved += held[k] * at.body.col(j).template segment<D>(D * (1 + k));
    const Vec<T> along = w * dual.transpose() * moved;
    for (int i = 0; i < at.body_unknowns; ++i)
      out[first + i] += along.dot(at.body_rates(i, n));
  }
}

template <int D>
void AnyBlocks<D>::add_turn_slide(double w, const Vec<T>& f, const Vec<D>& n,
                                  const Mat<D, T>& bend,
                                  const UnknownRows<T, D>& eta,
                                  const Shapes& at)
{
  const int size = at.size();
  double* out = A.data() + at.alone() * size;
  for (int a = 0; a < at.target_nodes; ++a)
  {
    const Vec<T> second = at.target_second(a) * f;
    const double along = at.target_gradient(a).dot(f);
    for (int i = 0; i < D; ++i, out += size)
      add_sum<T, D>(factors<T>(Vec<T>(
                        w * (n[i] * second + along * bend.row(i).transpose()))),
                    eta, size, out);
  }
  // A tool bends along its normal, whose turn has no part along it
  for (int j = 0; j < at.body_unknowns; ++j, out += size)
  {
    Vec<T> by = Vec<T>::Zero();
    for (int k = 0; k < T; ++k)
      by += w * f[k] * bend.transpose() *
            at.body.col(j).template segment<D>(D * (1 + k));
    add_sum<T, D>(factors<T>(by), eta, size, out);
  }
}

#define RAYMORTAR_EXPAND(R, D)                                                 \
  template void expand<R, D>(const PointShapes<D>&, const TaylorRows<R, D>&,   \
                             TargetPart, UnknownRows<R, D>&)
RAYMORTAR_EXPAND(1, 2);
RAYMORTAR_EXPAND(2, 2);
RAYMORTAR_EXPAND(1, 3);
RAYMORTAR_EXPAND(2, 3);
RAYMORTAR_EXPAND(3, 3);
#undef RAYMORTAR_EXPAND

template class AnyBlocks<2>;
template class AnyBlocks<3>;
template void AnyBlocks<2>::add_condition_rows<1>(double,
                                                  const UnknownRows<1, 2>&, int,
                                                  const Shapes&);
template void AnyBlocks<2>::add_condition_rows<2>(double,
                                                  const UnknownRows<2, 2>&, int,
                                                  const Shapes&);
template void AnyBlocks<3>::add_condition_rows<1>(double,
                                                  const UnknownRows<1, 3>&, int,
                                                  const Shapes&);
template void AnyBlocks<3>::add_condition_rows<3>(double,
                                                  const UnknownRows<3, 3>&, int,
                                                  const Shapes&);
} // namespace raymortar
