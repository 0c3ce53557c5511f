// Sums and products of small matrices, by value.
//
// Eigen makes a type of every expression, and its compilation takes longer than
// that of everything else. These operators take the place of Eigen's between
// plain matrices of small fixed size: plain loops, one for each pair of sizes.
// If columns have an even length, the loops take two numbers at a time, as
// Eigen does. Mixing both is slow: a load of two numbers waits for two single
// stores.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstring>
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
concept Small = (M > 0) and (N > 0) and (M * N <= 27);

/// Two numbers
using Pair [[gnu::vector_size(16)]] = double;

[[nodiscard, gnu::always_inline]] inline Pair load_pair(const double* from)
{
  Pair p;
  std::memcpy(&p, from, sizeof(Pair));
  return p;
}

[[gnu::always_inline]] inline void store_pair(Pair p, double* to)
{
  std::memcpy(to, &p, sizeof(Pair));
}

/// c_i = f(a_i, b_i) for N numbers: two at a time if N is even
template <int N, class F>
[[gnu::always_inline]] inline void for_each(const double* a, const double* b,
                                            double* c, F&& f)
{
  if constexpr (N % 2 == 0)
    for (int i = 0; i < N; i += 2)
      store_pair(f(load_pair(a + i), load_pair(b + i)), c + i);
  else
    for (int i = 0; i < N; ++i)
      c[i] = f(a[i], b[i]);
}

/// sum_k a_k b_k
template <int K>
[[nodiscard, gnu::always_inline]] inline double sum_of(const double* a,
                                                       const double* b)
{
  if constexpr (K % 2 == 0)
  {
    Pair sum = load_pair(a) * load_pair(b);
    for (int k = 2; k < K; k += 2)
      sum += load_pair(a + k) * load_pair(b + k);
    return sum[0] + sum[1];
  }
  else
  {
    double sum = a[0] * b[0];
    for (int k = 1; k < K; ++k)
      sum += a[k] * b[k];
    return sum;
  }
}

/// c = sum_k b_k a_k over columns a_k of M numbers; S is the distance between
/// two b_k
template <int M, int K, int S>
[[gnu::always_inline]] inline void combine(const double* a, const double* b,
                                           double* c)
{
  if constexpr (M % 2 == 0)
    for (int i = 0; i < M; i += 2)
    {
      Pair sum = load_pair(a + i) * b[0];
      for (int k = 1; k < K; ++k)
        sum += load_pair(a + i + k * M) * b[k * S];
      store_pair(sum, c + i);
    }
  else
    for (int i = 0; i < M; ++i)
    {
      double sum = a[i] * b[0];
      for (int k = 1; k < K; ++k)
        sum += a[i + k * M] * b[k * S];
      c[i] = sum;
    }
}

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
  detail::for_each<M * N>(a.data(), b.data(), c.data(),
                          [](auto x, auto y) { return x + y; });
  return c;
}

template <int M, int N, int O>
requires detail::Small<M, N>
[[nodiscard, gnu::always_inline]] inline auto
operator-(const detail::Plain<M, N, O>& a, const detail::Plain<M, N, O>& b)
{
  detail::Plain<M, N, O> c;
  detail::for_each<M * N>(a.data(), b.data(), c.data(),
                          [](auto x, auto y) { return x - y; });
  return c;
}

template <int M, int N, int O>
requires detail::Small<M, N>
[[nodiscard, gnu::always_inline]] inline auto
operator-(const detail::Plain<M, N, O>& a)
{
  detail::Plain<M, N, O> c;
  detail::for_each<M * N>(a.data(), a.data(), c.data(),
                          [](auto x, auto) { return -x; });
  return c;
}

template <int M, int N, int O, class S>
requires detail::Small<M, N> and std::is_arithmetic_v<S>
[[nodiscard, gnu::always_inline]] inline auto
operator*(const S& s, const detail::Plain<M, N, O>& a)
{
  detail::Plain<M, N, O> c;
  detail::for_each<M * N>(a.data(), a.data(), c.data(),
                          [s = static_cast<double>(s)](auto x, auto)
                          { return s * x; });
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
  detail::for_each<M * N>(a.data(), a.data(), c.data(),
                          [s = static_cast<double>(s)](auto x, auto)
                          { return x / s; });
  return c;
}

template <int M, int N, int O>
requires detail::Small<M, N>
[[gnu::always_inline]] inline auto& operator+=(detail::Plain<M, N, O>& a,
                                               const detail::Plain<M, N, O>& b)
{
  detail::for_each<M * N>(a.data(), b.data(), a.data(),
                          [](auto x, auto y) { return x + y; });
  return a;
}

template <int M, int N, int O>
requires detail::Small<M, N>
[[gnu::always_inline]] inline auto& operator-=(detail::Plain<M, N, O>& a,
                                               const detail::Plain<M, N, O>& b)
{
  detail::for_each<M * N>(a.data(), b.data(), a.data(),
                          [](auto x, auto y) { return x - y; });
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
    if constexpr (M == 1)
      c.data()[j] = detail::sum_of<K>(a.data(), b.data() + j * K);
    else
      detail::combine<M, K, 1>(a.data(), b.data() + j * K, c.data() + j * M);
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
      c.data()[i + j * M] = detail::sum_of<K>(a + i * K, b.data() + j * K);
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
    detail::combine<M, K, N>(a.data(), b + j, c.data() + j * M);
  return c;
}

/// @brief a . b
template <int M>
[[nodiscard, gnu::always_inline]] inline double dot(const Vec<M>& a,
                                                    const Vec<M>& b)
{
  return detail::sum_of<M>(a.data(), b.data());
}

/// @brief |a|
template <int M>
[[nodiscard, gnu::always_inline]] inline double length(const Vec<M>& a)
{
  return std::sqrt(dot<M>(a, a));
}

/// @brief to += factor * from, N numbers each, at different places.
template <int N>
[[gnu::always_inline]] inline void
add_scaled(double factor, const double* __restrict from, double* __restrict to)
{
  detail::for_each<N>(to, from, to,
                      [factor](auto x, auto y) { return x + factor * y; });
}

/// @brief Store a vector in a row of dofs.
template <int M>
[[gnu::always_inline]] inline void put(const Vec<M>& from, double* to)
{
  detail::for_each<M>(from.data(), from.data(), to,
                      [](auto x, auto) { return x; });
}

/// @brief A row of a matrix, by value.
template <int M, int N>
[[nodiscard, gnu::always_inline]] inline Vec<N> row_of(const Mat<M, N>& a,
                                                       int i)
{
  Vec<N> c;
  for (int j = 0; j < N; ++j)
    c.data()[j] = a.data()[i + j * M];
  return c;
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
