// Sums and products of small matrices, by value.
//
// Eigen makes a type of every expression, and its compilation takes longer than
// that of everything else. These operators take the place of Eigen's between
// plain matrices of small fixed size: plain loops, one for each pair of sizes.
#pragma once

#include <Eigen/Core>
#include <type_traits>

namespace raymortar
{
template <int D>
using Vec = Eigen::Matrix<double, D, 1>;

template <int M, int N>
using Mat = Eigen::Matrix<double, M, N>;

namespace detail
{
/// Rows or columns first, as O says
template <int M, int N, int O>
using Plain = Eigen::Matrix<double, M, N, O, M, N>;

/// So small that a copy costs nothing: Eigen's expressions save copies
template <int M, int N>
concept Small = M >
0 and N > 0 and M* N <= 27;

/// Products are of matrices that are stored as Mat is
template <int M, int N, int O>
concept Factor = Small<M, N> and int(Mat<M, N>::Options) == O;

template <class A>
inline constexpr int rows = A::RowsAtCompileTime;
template <class A>
inline constexpr int columns = A::ColsAtCompileTime;

/// A matrix that is read through its transpose
template <class A>
concept Transposed =
    std::is_same_v<std::remove_const_t<A>, Mat<rows<A>, columns<A>>> and
    Small<rows<A>, columns<A>>;
} // namespace detail

template <int M, int N, int O>
requires detail::Small<M, N>
[[nodiscard, gnu::always_inline]] inline auto
operator+(const detail::Plain<M, N, O>& a, const detail::Plain<M, N, O>& b)
{
  detail::Plain<M, N, O> c;
  for (int i = 0; i < M * N; ++i)
    c.data()[i] = a.data()[i] + b.data()[i];
  return c;
}

template <int M, int N, int O>
requires detail::Small<M, N>
[[nodiscard, gnu::always_inline]] inline auto
operator-(const detail::Plain<M, N, O>& a, const detail::Plain<M, N, O>& b)
{
  detail::Plain<M, N, O> c;
  for (int i = 0; i < M * N; ++i)
    c.data()[i] = a.data()[i] - b.data()[i];
  return c;
}

template <int M, int N, int O>
requires detail::Small<M, N>
[[nodiscard, gnu::always_inline]] inline auto
operator-(const detail::Plain<M, N, O>& a)
{
  detail::Plain<M, N, O> c;
  for (int i = 0; i < M * N; ++i)
    c.data()[i] = -a.data()[i];
  return c;
}

template <int M, int N, int O, class S>
requires detail::Small<M, N> and std::is_arithmetic_v<S>
[[nodiscard, gnu::always_inline]] inline auto
operator*(const S& s, const detail::Plain<M, N, O>& a)
{
  detail::Plain<M, N, O> c;
  for (int i = 0; i < M * N; ++i)
    c.data()[i] = s * a.data()[i];
  return c;
}

template <int M, int N, int O, class S>
requires detail::Small<M, N> and std::is_arithmetic_v<S>
[[nodiscard, gnu::always_inline]] inline auto
operator*(const detail::Plain<M, N, O>& a, const S& s)
{
  return s * a;
}

template <int M, int N, int O, class S>
requires detail::Small<M, N> and std::is_arithmetic_v<S>
[[nodiscard, gnu::always_inline]] inline auto
operator/(const detail::Plain<M, N, O>& a, const S& s)
{
  detail::Plain<M, N, O> c;
  for (int i = 0; i < M * N; ++i)
    c.data()[i] = a.data()[i] / s;
  return c;
}

template <int M, int N, int O>
requires detail::Small<M, N>
[[gnu::always_inline]] inline auto& operator+=(detail::Plain<M, N, O>& a,
                                               const detail::Plain<M, N, O>& b)
{
  for (int i = 0; i < M * N; ++i)
    a.data()[i] += b.data()[i];
  return a;
}

template <int M, int N, int O>
requires detail::Small<M, N>
[[gnu::always_inline]] inline auto& operator-=(detail::Plain<M, N, O>& a,
                                               const detail::Plain<M, N, O>& b)
{
  for (int i = 0; i < M * N; ++i)
    a.data()[i] -= b.data()[i];
  return a;
}

template <int M, int K, int N, int O, int P>
requires detail::Factor<M, K, O> and detail::Factor<K, N, P> and
    detail::Small<M, N>
[[nodiscard, gnu::always_inline]] inline auto
operator*(const detail::Plain<M, K, O>& a, const detail::Plain<K, N, P>& b)
{
  Mat<M, N> c;
  for (int j = 0; j < N; ++j)
    for (int i = 0; i < M; ++i)
    {
      double sum = a.data()[i] * b.data()[j * K];
      for (int k = 1; k < K; ++k)
        sum += a.data()[i + k * M] * b.data()[k + j * K];
      c.data()[i + j * M] = sum;
    }
  return c;
}

/// a^T b
template <class A, int N, int O, int K = detail::rows<A>>
requires detail::Transposed<A> and detail::Factor<K, N, O> and
    detail::Small<detail::columns<A>, N>
[[nodiscard, gnu::always_inline]] inline auto
operator*(const Eigen::Transpose<A>& transposed,
          const detail::Plain<detail::rows<A>, N, O>& b)
{
  constexpr int M = detail::columns<A>;
  const double* const a = transposed.nestedExpression().data();
  Mat<M, N> c;
  for (int j = 0; j < N; ++j)
    for (int i = 0; i < M; ++i)
    {
      double sum = a[i * K] * b.data()[j * K];
      for (int k = 1; k < K; ++k)
        sum += a[k + i * K] * b.data()[k + j * K];
      c.data()[i + j * M] = sum;
    }
  return c;
}

/// a b^T
template <class B, int M, int O, int K = detail::columns<B>>
requires detail::Transposed<B> and detail::Factor<M, K, O> and
    detail::Small<M, detail::rows<B>>
[[nodiscard, gnu::always_inline]] inline auto
operator*(const detail::Plain<M, detail::columns<B>, O>& a,
          const Eigen::Transpose<B>& transposed)
{
  constexpr int N = detail::rows<B>;
  const double* const b = transposed.nestedExpression().data();
  Mat<M, N> c;
  for (int j = 0; j < N; ++j)
    for (int i = 0; i < M; ++i)
    {
      double sum = a.data()[i] * b[j];
      for (int k = 1; k < K; ++k)
        sum += a.data()[i + k * M] * b[j + k * N];
      c.data()[i + j * M] = sum;
    }
  return c;
}

/// @brief to += factor * from, N numbers each.
template <int N>
[[gnu::always_inline]] inline void add_scaled(double factor, const double* from,
                                              double* to)
{
  for (int n = 0; n < N; ++n)
    to[n] += factor * from[n];
}

/// @brief Add a number to the diagonal of a matrix.
template <int D>
[[gnu::always_inline]] inline void add_to_diagonal(Mat<D, D>& to, double number)
{
  for (int i = 0; i < D; ++i)
    to.data()[i + i * D] += number;
}

/// @brief Set a column of a matrix.
template <int M, int N>
[[gnu::always_inline]] inline void set_column(Mat<M, N>& to, int j,
                                              const Vec<M>& values)
{
  for (int i = 0; i < M; ++i)
    to.data()[i + j * M] = values.data()[i];
}

/// @brief A column of a matrix, by value.
template <int M, int N>
[[nodiscard, gnu::always_inline]] inline Vec<M> column(const Mat<M, N>& of,
                                                       int j)
{
  Vec<M> c;
  for (int i = 0; i < M; ++i)
    c.data()[i] = of.data()[i + j * M];
  return c;
}
} // namespace raymortar
