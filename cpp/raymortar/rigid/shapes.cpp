#include "raymortar/rigid/shapes.h"
#include "raymortar/rigid/crossings.h"
#include "raymortar/rigid/roots.h"
#include <Eigen/Geometry>
#include <cmath>

namespace raymortar
{
namespace
{
/// Unit normal out of the solid, and its derivative along the surface
struct SurfaceAt
{
  Vec<3> normal;
  Mat<3, 3> bend;
};

Mat<3, 3> dyad(const Vec<3>& a) { return a * a.transpose(); }

/// Crossings of a line whose value a g^2 + 2 b g + c is negative inside.
/// @param[in] counts Whether a root is one of the solid
template <class Counts>
Crossings quadratic_crossings(double a, double b, double c, Counts&& counts)
{
  Crossings found;
  const double discriminant = b * b - a * c;
  if (not(discriminant > 0.0))
    return found;
  const double root = std::sqrt(discriminant);
  // The derivative at the falling root is -2 root. Each root is computed by the
  // formula that loses no digits
  const double sum = b + std::copysign(root, b);
  const double large =
      a == 0.0 ? std::numeric_limits<double>::infinity() : -sum / a;
  const double small = -c / sum;
  const double entry = std::signbit(b) ? small : large;
  const double exit = std::signbit(b) ? large : small;
  if (std::isfinite(entry) and counts(entry))
    found.add(entry, true);
  if (std::isfinite(exit) and counts(exit))
    found.add(exit, false);
  return found;
}

struct Plane
{
  Vec<3> point, normal;

  [[nodiscard]] Crossings crossings(const ToolRay& ray) const
  {
    Crossings found;
    const double slope = ray.n.dot(normal);
    if (slope != 0.0)
      found.add((point - ray.x).dot(normal) / slope, slope < 0.0);
    return found;
  }
  [[nodiscard]] SurfaceAt at(const Vec<3>&) const
  {
    return {normal, Mat<3, 3>::Zero()};
  }
  [[nodiscard]] double distance(const Vec<3>& x) const
  {
    return (x - point).dot(normal);
  }
};

struct Sphere
{
  Vec<3> centre;
  double radius;

  [[nodiscard]] Crossings crossings(const ToolRay& ray) const
  {
    const Vec<3> r = ray.x - centre;
    const double distance = r.norm();
    return quadratic_crossings(1.0, r.dot(ray.n),
                               (distance - radius) * (distance + radius),
                               [](double) { return true; });
  }
  [[nodiscard]] SurfaceAt at(const Vec<3>& x) const
  {
    const Vec<3> n = (x - centre).normalized();
    return {n, (Mat<3, 3>::Identity() - dyad(n)) / radius};
  }
  [[nodiscard]] double distance(const Vec<3>& x) const
  {
    return (x - centre).norm() - radius;
  }
};

struct Cylinder
{
  Vec<3> point, axis;
  double radius;

  [[nodiscard]] Vec<3> across(const Vec<3>& v) const
  {
    return v - axis.dot(v) * axis;
  }
  [[nodiscard]] Crossings crossings(const ToolRay& ray) const
  {
    const Vec<3> r = across(ray.x - point), n = across(ray.n);
    const double distance = r.norm();
    return quadratic_crossings(n.squaredNorm(), r.dot(n),
                               (distance - radius) * (distance + radius),
                               [](double) { return true; });
  }
  [[nodiscard]] SurfaceAt at(const Vec<3>& x) const
  {
    const Vec<3> n = across(x - point).normalized();
    return {n, (Mat<3, 3>::Identity() - dyad(n) - dyad(axis)) / radius};
  }
  [[nodiscard]] double distance(const Vec<3>& x) const
  {
    return across(x - point).norm() - radius;
  }
};

struct Cone
{
  Vec<3> tip, axis;
  double sine, cosine; ///< of the half angle

  [[nodiscard]] Crossings crossings(const ToolRay& ray) const
  {
    const Vec<3> r = ray.x - tip;
    const double h = r.dot(axis), k = ray.n.dot(axis);
    const Vec<3> across = r - h * axis, n = ray.n - k * axis;
    const double cc = cosine * cosine, ss = sine * sine;
    // The other half of the double cone is none of the solid
    return quadratic_crossings(cc * n.squaredNorm() - ss * k * k,
                               cc * across.dot(n) - ss * h * k,
                               (cosine * across.norm() - sine * h) *
                                   (cosine * across.norm() + sine * h),
                               [&](double g) { return h + g * k > 0.0; });
  }
  [[nodiscard]] SurfaceAt at(const Vec<3>& x) const
  {
    const Vec<3> r = x - tip;
    const Vec<3> across = r - r.dot(axis) * axis;
    const double distance = across.norm();
    const Vec<3> out = across / distance;
    return {cosine * out - sine * axis,
            cosine / distance * dyad(axis.cross(out))};
  }
  /// To the flank's extension where the tip is nearest
  [[nodiscard]] double distance(const Vec<3>& x) const
  {
    const Vec<3> r = x - tip;
    const double h = r.dot(axis);
    return cosine * (r - h * axis).norm() - sine * h;
  }
};

struct Torus
{
  Vec<3> centre, axis;
  double major, minor;

  [[nodiscard]] Crossings crossings(const ToolRay& ray) const
  {
    // (|y|^2 + R^2 - r^2)^2 = 4 R^2 |y across the axis|^2, in units of R and
    // from the foot of the centre on the line, so that coefficients are of one
    // size
    const double foot = (centre - ray.x).dot(ray.n);
    const Vec<3> y = (ray.x + foot * ray.n - centre) / major;
    const double h = y.dot(axis), k = ray.n.dot(axis);
    const double c = y.squaredNorm() + 1.0 - std::pow(minor / major, 2);
    const Polynomial<4> q{c * c - 4.0 * (y.squaredNorm() - h * h), 8.0 * h * k,
                          2.0 * c - 4.0 * (1.0 - k * k), 0.0, 1.0};
    Crossings found;
    const auto roots = sign_changes<4>(q);
    for (int i = 0; i < roots.size; ++i)
      found.add(foot + major * roots.at[i].place, not roots.at[i].rises);
    return found;
  }
  [[nodiscard]] SurfaceAt at(const Vec<3>& x) const
  {
    const Vec<3> r = x - centre;
    const Vec<3> across = r - r.dot(axis) * axis;
    const double distance = across.norm();
    const Vec<3> out = across / distance;
    const Vec<3> n = (r - major * out).normalized();
    const Mat<3, 3> around = dyad(axis.cross(out));
    return {n, (Mat<3, 3>::Identity() - dyad(n) - around) / minor +
                   n.dot(out) / distance * around};
  }
  [[nodiscard]] double distance(const Vec<3>& x) const
  {
    const Vec<3> r = x - centre;
    const double h = r.dot(axis);
    return std::hypot((r - h * axis).norm() - major, h) - minor;
  }
};

template <class S>
class ClosedForm final : public Tool
{
public:
  ClosedForm(S shape, Solid solid) : _shape(shape), _hollow(solid.hollow) {}

  void cast(std::span<const ToolRay> rays,
            std::span<ToolHit> hits) const override
  {
    for (std::size_t k = 0; k < rays.size(); ++k)
      hits[k] = hit(rays[k]);
  }

  [[nodiscard]] double distance(const Vec<3>& x) const override
  {
    return _hollow ? -_shape.distance(x) : _shape.distance(x);
  }

private:
  [[nodiscard]] ToolHit hit(const ToolRay& ray) const
  {
    const Crossings line = _shape.crossings(ray);
    const auto g = _hollow ? line.turned_inside_out().entry() : line.entry();
    if (not g)
      return {};
    const SurfaceAt s = _shape.at(ray.x + *g * ray.n);
    const double sign = _hollow ? -1.0 : 1.0;
    return {s.normal.allFinite(), *g, sign * s.normal, sign * s.bend,
            std::is_same_v<S, Plane>};
  }

  S _shape;
  bool _hollow;
};

template <class S>
std::shared_ptr<const Tool> closed_form(const S& shape, Solid solid)
{
  return std::make_shared<ClosedForm<S>>(shape, solid);
}
} // namespace

std::shared_ptr<const Tool> make_plane(const Vec<3>& point,
                                       const Vec<3>& normal)
{
  return closed_form(Plane{point, normal.normalized()}, {});
}

std::shared_ptr<const Tool> make_sphere(const Vec<3>& centre, double radius,
                                        Solid solid)
{
  return closed_form(Sphere{centre, radius}, solid);
}

std::shared_ptr<const Tool> make_cylinder(const Vec<3>& point,
                                          const Vec<3>& axis, double radius,
                                          Solid solid)
{
  return closed_form(Cylinder{point, axis.normalized(), radius}, solid);
}

std::shared_ptr<const Tool> make_cone(const Vec<3>& tip, const Vec<3>& axis,
                                      double half_angle, Solid solid)
{
  return closed_form(
      Cone{tip, axis.normalized(), std::sin(half_angle), std::cos(half_angle)},
      solid);
}

std::shared_ptr<const Tool> make_torus(const Vec<3>& centre, const Vec<3>& axis,
                                       double major, double minor, Solid solid)
{
  return closed_form(Torus{centre, axis.normalized(), major, minor}, solid);
}
} // namespace raymortar
