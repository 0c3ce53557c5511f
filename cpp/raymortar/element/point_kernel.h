// Residual and tangent of one point of an element, whatever the facets there
// are: one instance per law and dimension.
#pragma once

#include "raymortar/element/assembler.h"
#include "raymortar/element/germ.h"
#include <memory>

namespace raymortar
{
/// @brief What a law takes of slave and target at a point, as Taylor
/// coefficients: of geometry in the columns of Germ<D>::NodeMatrix, of fields
/// value and derivatives by xi, D numbers.
template <int D>
struct GermPoint
{
  using Facet = typename Germ<D>::NodeMatrix;
  Facet slave;
  Facet slave_old; ///< at the accepted step; friction only
  Facet reference; ///< undeformed; moving segments only
  Facet master;    ///< around the point that is hit
  Facet master_old;
  Mat<D, D> lam = Mat<D, D>::Zero(); ///< unknown traction; rows as components
  Vec<D> gamma;
  Vec<D> offset;
  Vec<D> coefficient;     ///< of the friction law, where has_coefficient
  Mat<D, D> traction_old; ///< of springs, see ContactState
  FrictionLaw friction;
  bool has_coefficient = false;
  bool is_hit = false;
  bool frame_of_target = false; ///< see ContactState::has_frame_of_target
  double lam_scale = 1.0;
  double touch = 0.0; ///< see PointState, length
  Measure measure = Measure::reference;
  double weight = 0.0; ///< in reference coordinates
  double area = 0.0;   ///< times the reference Jacobian
  double gap = 0.0;
  PointBound bound{}; ///< of a friction law that is known at points only
};

/// @brief Blocks over the Taylor coefficients of what is unknown: [slave u |
/// multiplier | target u], each value first, then derivatives, node-major.
template <int D>
struct PointBlocks
{
  static constexpr int T = D - 1;
  static constexpr int side = D * D;
  static constexpr int most = 3 * side;
  using Vector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, most, 1>;
  using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic,
                               Eigen::RowMajor, most, most>;
  using Gradient =
      Eigen::Matrix<double, Eigen::Dynamic, T, Eigen::ColMajor, most, T>;
  Vector b;      ///< residual
  Matrix A;      ///< tangent at a fixed point
  Vector f;      ///< integrand per unit of the weight
  Gradient f_xi; ///< its derivative along the slave facet
};

/// @brief What the law gives at a point.
template <int D>
struct PointResult
{
  ContactStatus status = ContactStatus::none;
  double pressure = 0.0;
  double weight = 0.0;
  double gamma = 0.0;
  double closing = 0.0;
  Vec<D> normal = Vec<D>::Zero(); ///< of the law's frame
  Vec<D> traction = Vec<D>::Zero();
  Vec<D> slip = Vec<D>::Zero();
  Vec<D> friction = Vec<D>::Zero();
};

/// @brief Kernel of a law at one point of unknown facets.
template <int D>
class PointKernel
{
public:
  virtual ~PointKernel() = default;

  /// Whether there is friction
  [[nodiscard]] virtual bool is_frictional() const = 0;

  virtual void residual(const GermPoint<D>& at, PointBlocks<D>& out) const = 0;

  /// @param[in] along Whether the integrand is asked for
  virtual void tangent(const GermPoint<D>& at, bool along,
                       PointBlocks<D>& out) const = 0;

  [[nodiscard]] virtual PointResult<D> result(const GermPoint<D>& at) const = 0;
};

template <int D>
[[nodiscard]] std::unique_ptr<PointKernel<D>>
make_point_kernel(const ContactState& s);
} // namespace raymortar
