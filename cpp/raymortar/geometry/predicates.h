// Every tolerance of the library. All are relative: the caller multiplies by a
// length or area of the facet at hand, so results do not depend on the unit.
#pragma once

namespace raymortar::tolerance
{
/// Surfaces face each other when n_s . n_m < -facing. Above it the projection
/// of the master is too thin: the ray parameter would lose half its digits.
inline constexpr double facing = 1e-3;

/// Clip vertices closer than this times the slave diameter are one vertex
inline constexpr double merge = 2e-15;

/// A part of a farther layer that sticks out by less than this times the extent
/// is not cut off. Larger than `merge`: an edge between two vertices this close
/// has a direction made of rounding errors, and its line would cut anywhere
inline constexpr double cut = 1e-13;

/// A 2x2 determinant larger than this times the sum of its two products is
/// taken as computed. Its sign is exact from 3.3e-16 on (Shewchuk 1997,
/// (3 + 16 u) u with u = 2^-53); a million times that keeps six digits of the
/// value, by which crossings of nearly parallel edges find their place
inline constexpr double orientation = 3.3306690738754716e-10;

/// Ears of a polygon with less than this share of its area are integrated on
/// their own (tiles.h). Far above what positions change by in the last
/// iterations of a solve, far below what vertices of other origin are apart
inline constexpr double ear = 1e-3;

/// A segment below this share of the slave facet's area is dropped
inline constexpr double segment_area = 1e-14;

/// Segments that add up to more than the slave facet by this share overlap
inline constexpr double overlap = 1e-9;

/// Uncovered share of a slave facet below which it counts as covered
inline constexpr double coverage = 1e-11;

/// Ray Newton stops after a step below this in reference coordinates: it
/// converges quadratically, so the remaining error is a rounding error
inline constexpr double ray_step = 1e-8;

/// |n . n_m| below this: the ray runs along the facet
inline constexpr double parallel = 1e-10;

/// A hit may lie this far outside the reference facet and still be on it
inline constexpr double ray_outside = 1e-9;

/// A true break may lie this far from where the clip of the flat patches had
/// it, in reference coordinates: a few times what curvature and warping do
inline constexpr double break_move = 0.1;

/// Newton for a true break that goes this far is given up
inline constexpr double astray = 0.5;

/// Sine of the angle below which edges count as running along each other: where
/// rims of slave and master coincide they cross anywhere
inline constexpr double along = 1e-2;

/// lam . n + gamma g below this times gamma times the facet diameter counts
/// as contact: bodies that touch exactly must not open by a rounding error. So
/// does a tangential trial traction beyond its bound by that much count as
/// stick
inline constexpr double touch = 1e-11;

/// A facet with |m| below this times diameter^(d-1) has no normal
inline constexpr double degenerate = 1e-12;
} // namespace raymortar::tolerance
