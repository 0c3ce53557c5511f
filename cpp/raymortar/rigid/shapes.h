// Tools of closed form. In 2D their section with the plane z = 0 counts.
#pragma once

#include "raymortar/target/tool.h"

namespace raymortar
{
/// @brief What a solid shape is made of, or with `hollow` what is around it.
/// Points and radii are lengths, axes need not be of length 1, angles are in
/// radians.
struct Solid
{
  bool hollow = false;
};

/// @param[in] normal Out of the half-space that is solid
[[nodiscard]] std::shared_ptr<const Tool> make_plane(const Vec<3>& point,
                                                     const Vec<3>& normal);
[[nodiscard]] std::shared_ptr<const Tool>
make_sphere(const Vec<3>& centre, double radius, Solid solid);
/// Without ends
[[nodiscard]] std::shared_ptr<const Tool> make_cylinder(const Vec<3>& point,
                                                        const Vec<3>& axis,
                                                        double radius,
                                                        Solid solid);
/// @param[in] axis From the tip into the cone, which has no other end
[[nodiscard]] std::shared_ptr<const Tool> make_cone(const Vec<3>& tip,
                                                    const Vec<3>& axis,
                                                    double half_angle,
                                                    Solid solid);
/// @param[in] major Of the circle around the axis that the tube follows
/// @param[in] minor Of the tube
[[nodiscard]] std::shared_ptr<const Tool> make_torus(const Vec<3>& centre,
                                                     const Vec<3>& axis,
                                                     double major, double minor,
                                                     Solid solid);
} // namespace raymortar
