// Residual and tangent of an element of facets of any kind, over its unknowns:
// what there is to do with them whatever the law.
#pragma once

#include "raymortar/element/point_shapes.h"

namespace raymortar
{
/// @brief Derivatives of R numbers by the Taylor coefficients of both
/// displacements: by the value and by each derivative.
template <int R, int D>
struct TaylorRows
{
  std::array<Mat<R, D>, D> slave;
  std::array<Mat<R, D>, D> target;
};

/// @brief Which of a target's coefficients count.
enum class TargetPart
{
  none,
  value,
  all ///< with the derivatives
};

/// @brief Whose normal turns.
enum class Side
{
  slave,
  target
};

/// @brief R rows over the unknowns of an element.
template <int R, int D>
using UnknownRows = std::array<std::array<double, PointShapes<D>::most>,
                               static_cast<std::size_t>(R)>;

/// @brief Rows over the displacements' unknowns from rows over Taylor
/// coefficients. Those of the multiplier, and of a target that does not count,
/// are left as they are.
template <int R, int D>
void expand(const PointShapes<D>& at, const TaylorRows<R, D>& in,
            TargetPart part, UnknownRows<R, D>& out);

/// @brief Sums of the blocks of one element, point by point.
template <int D>
class AnyBlocks
{
public:
  static constexpr int T = D - 1;
  static constexpr int most = PointShapes<D>::most;
  using Shapes = PointShapes<D>;

  std::array<double, most> b;
  std::array<double, static_cast<std::size_t>(most* most)>
      A; ///< row-major, without gaps

  void clear_residual(int size) { std::fill_n(b.begin(), size, 0.0); }
  void clear_tangent(int size) { std::fill_n(A.begin(), size * size, 0.0); }

  /// @brief Add to the residual: work of a force on the target, and of the
  /// opposite one on the slave.
  void add_force(const Vec<D>& t, const Shapes& at)
  {
    for (int a = 0; a < at.slave_nodes; ++a)
      add_vector(-at.slave_value(a) * t, D * a);
    for (int a = 0; a < at.target_nodes; ++a)
      add_vector(at.target_value(a) * t, at.alone() + D * a);
    for (int j = 0; j < at.body_unknowns; ++j)
      for (int i = 0; i < D; ++i)
        b[place(at.alone() + j)] += at.body(i, j) * t[i];
  }

  /// @brief Add to the residual: work on the turn of a side's normal n.
  /// @param[in] f Force times arm by the gradients of shape functions
  void add_turn(Side side, const Vec<T>& f, const Vec<D>& n, const Shapes& at)
  {
    if (side == Side::slave)
    {
      for (int a = 0; a < at.slave_nodes; ++a)
        add_vector(at.slave_gradient(a).dot(f) * n, D * a);
      return;
    }
    for (int a = 0; a < at.target_nodes; ++a)
      add_vector(at.target_gradient(a).dot(f) * n, at.alone() + D * a);
    for (int j = 0; j < at.body_unknowns; ++j)
      b[place(at.alone() + j)] += at.body_rates(j, n).dot(f);
  }

  /// @brief Add to the residual: the multiplier's equation, for C / gamma times
  /// the area.
  template <int M>
  void add_condition(const Vec<M>& C, const Shapes& at)
  {
    for (int k = 0; k < at.multipliers; ++k)
      for (int i = 0; i < M; ++i)
        b[place(at.side() + k * M + i)] += at.multiplier_value(k) * C[i];
  }

protected:
  /// Add w times the work of rows over the first `count` unknowns
  void add_work_rows(double w, const UnknownRows<D, D>& rows, int count,
                     const Shapes& at);

  /// Add w times the work of the multiplier, component by component
  void add_multiplier(double w, const Shapes& at);

  /// Add that a force f acts at another point of the target, which moves by
  /// some rows along it
  void add_slide(const Vec<D>& f, const TaylorRows<T, D>& eta,
                 const Shapes& at);

  /// Set the columns of the multiplier in some rows
  template <int M>
  static void set_multiplier_columns(const Mat<M, M>& by_lam,
                                     UnknownRows<M, D>& rows, const Shapes& at)
  {
    for (int k = 0; k < at.multipliers; ++k)
      for (int i = 0; i < M; ++i)
        for (int j = 0; j < M; ++j)
          rows[place(i)][place(at.side() + k * M + j)] =
              at.multiplier_value(k) * by_lam(i, j);
  }

  /// Take from them what they have of the multiplier's unfelt parts
  template <int M>
  static void leave_out_unfelt(const Mat<M, D>& by_trial,
                               const std::array<Mat<D, D>, 4>& unfelt,
                               UnknownRows<M, D>& rows, const Shapes& at)
  {
    for (int k = 0; k < at.multipliers; ++k)
    {
      const Mat<M, D> by_lam = by_trial * unfelt[place(k)];
      for (int i = 0; i < M; ++i)
        for (int j = 0; j < M; ++j)
          rows[place(i)][place(at.side() + k * M + j)] -=
              at.multiplier_value(k) * by_lam(i, j);
    }
  }

  /// Add w times the multiplier's equation, for its derivative over the first
  /// `count` unknowns
  template <int M>
  void add_condition_rows(double w, const UnknownRows<M, D>& rows, int count,
                          const Shapes& at);

  /// Add w times, to rows of a side's displacement along its normal n: how
  /// what multiplies the gradients of shape functions varies
  /// @param[in] held Minus that itself: the normal turns as well
  /// @param[in] dual Of the side's tangents
  void add_turn_rows(Side side, double w, const Vec<D>& n,
                     const UnknownRows<T, D>& rows, const Vec<T>& held,
                     const Mat<D, T>& dual, const Shapes& at);

  /// Add w times: what multiplies the gradients of the target's shape functions
  /// acts at another point of the target, where these and the normal are others
  /// @param[in] f, n That and the normal
  /// @param[in] bend Derivative of the normal along the target
  /// @param[in] eta How the point moves, see slide_rows
  void add_turn_slide(double w, const Vec<T>& f, const Vec<D>& n,
                      const Mat<D, T>& bend, const UnknownRows<T, D>& eta,
                      const Shapes& at);

  /// Variation of the hit point along the target, over all unknowns
  [[nodiscard]] static UnknownRows<D - 1, D>
  slide_rows(const TaylorRows<T, D>& eta, const Shapes& at);

private:
  void add_body_turn_rows(double w, const Vec<D>& n,
                          const UnknownRows<T, D>& rows, const Vec<T>& held,
                          const Mat<D, T>& dual, const Shapes& at);

  [[nodiscard]] static std::size_t place(int k)
  {
    return static_cast<std::size_t>(k);
  }

  void add_vector(const Vec<D>& v, int at)
  {
    for (int i = 0; i < D; ++i)
      b[place(at + i)] += v[i];
  }
};
} // namespace raymortar
