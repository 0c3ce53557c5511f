// Slave and target data that a law takes at one point, for facets of any kind.
// All points share one set of these data.
#pragma once

#include "raymortar/element/measure.h"
#include "raymortar/element/spin.h"
#include "raymortar/element/taylor_facet.h"
#include "raymortar/law/friction.h"

namespace raymortar
{
/// @brief One integration point of an element.
struct ElementPoint
{
  double weight;      ///< in reference coordinates
  double area;        ///< times the reference Jacobian
  double g;           ///< length of the ray from slave to target
  PointBound bound{}; ///< of a friction law that is known at points only
  /// Of ContactState::point_changes, (2 D); null: none
  const double* changes = nullptr;
};

/// @brief What friction needs of the accepted step, as TaylorData has it.
template <int D>
struct FrictionData
{
  using Taylor = typename TaylorFacet<D>::NodeMatrix;
  Taylor slave_old = Taylor::Zero();
  Taylor master_old = Taylor::Zero();
  Mat<D, D> traction_old = Mat<D, D>::Zero(); ///< see ContactState
  bool has_springs = true;                    ///< false: traction_old is zero
  Vec<D> rest =
      Vec<D>::Zero(); ///< what that has of ContactState::spring_points
  /// Traction that replaces the multiplier's unfelt part in the law, less that
  /// part
  Mat<D, D> kept = Mat<D, D>::Zero();
  bool has_kept = false; ///< false: kept is zero
  FrictionLaw friction;
  double elastic_slip = 0.0;    ///< of the law. Length
  bool has_coefficient = false; ///< a field in place of the law's number
  Vec<D> coefficient = Vec<D>::Zero();
};

/// @brief Taylor coefficients of geometry in the columns of
/// TaylorFacet<D>::NodeMatrix, of fields in columns: value and derivatives by
/// xi.
///
/// Second derivatives of geometry and derivatives of fields are set where they
/// are asked for.
template <int D>
struct TaylorData
{
  using Taylor = typename TaylorFacet<D>::NodeMatrix;
  // Coefficients that are never set are multiplied by zeros
  Taylor slave = Taylor::Zero();
  Taylor master = Taylor::Zero();    ///< around the point that is hit
  Taylor reference = Taylor::Zero(); ///< undeformed slave; moving segments only
  Mat<D, D> lam = Mat<D, D>::Zero(); ///< traction; rows as components
  Vec<D> gamma = Vec<D>::Zero();
  Vec<D> offset = Vec<D>::Zero(); ///< length
  double touch = 0.0;             ///< see PointState, length
  Measure measure = Measure::reference;
  bool frame_of_target = false; ///< see ContactState::has_frame_of_target
  bool has_arm = true;          ///< see HitPoint
  bool slave_bends = true;      ///< false: tangents are the same at all points
  bool master_bends = true;
  FrictionData<D> history;
  /// Unfelt parts of the multiplier at its nodes, if anything is kept
  std::array<Mat<D, D>, 4> unfelt;
  TwoFrames<D> slave_frames;  ///< the old ones with friction only
  TwoFrames<D> master_frames; ///< those of the point that is hit
  Spin<D> spin;
};

/// @brief Curvature of a facet by its Taylor coefficients.
template <int D>
[[nodiscard]] Curvature<D>
curvature_of(const typename TaylorFacet<D>::NodeMatrix& taylor,
             const Frame<D>& frame, const Mat<D, D - 1>& dual)
{
  return curvature_from<D>(taylor.template rightCols < D == 2 ? 1 : 3 > (),
                           frame, dual);
}
} // namespace raymortar
