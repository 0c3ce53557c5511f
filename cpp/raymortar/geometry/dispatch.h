// From the run-time description of a facet to its compile-time type.
#pragma once

#include "raymortar/core/error.h"
#include "raymortar/geometry/reference.h"

namespace raymortar
{
/// @brief Call `fn.template operator()<S>()` for a shape.
template <class Fn>
decltype(auto) with_shape(Shape shape, Fn&& fn)
{
  switch (shape)
  {
  case Shape::interval:
    return fn.template operator()<Shape::interval>();
  case Shape::triangle:
    return fn.template operator()<Shape::triangle>();
  case Shape::quadrilateral:
    return fn.template operator()<Shape::quadrilateral>();
  }
  throw Error("unknown facet shape");
}

/// @brief Call `fn(FacetType<S, P, K>{})` for the shape and degrees of `s`.
/// @param[in] s Anything with members shape, degree, node_degree
template <class Description, class Fn>
decltype(auto) with_facet_type(const Description& s, Fn&& fn)
{
  return with_shape(s.shape,
                    [&]<Shape S>() -> decltype(auto)
                    {
                      if (s.degree == 1 and s.node_degree == 1)
                        return fn(FacetType<S, 1, 1>{});
                      if (s.degree == 1 and s.node_degree == 2)
                        return fn(FacetType<S, 1, 2>{});
                      if (s.degree == 2 and s.node_degree == 2)
                        return fn(FacetType<S, 2, 2>{});
                      throw Error(
                          "facets have displacement degree " +
                          std::to_string(s.degree) + " and node degree " +
                          std::to_string(s.node_degree) +
                          "; supported are 1 and 2, node degree not below");
                    });
}

/// @brief Call `fn(FacetType<S, K, K>{})` for shape and node degree of `s`:
/// where displacements do not count.
template <class Description, class Fn>
decltype(auto) with_geometry(const Description& s, Fn&& fn)
{
  return with_shape(s.shape,
                    [&]<Shape S>() -> decltype(auto)
                    {
                      if (s.node_degree == 1)
                        return fn(FacetType<S, 1, 1>{});
                      return fn(FacetType<S, 2, 2>{});
                    });
}

/// @brief The same where the dimension of the space is known.
template <int D, class Description, class Fn>
decltype(auto) with_geometry_in(const Description& s, Fn&& fn)
{
  const auto with_degree = [&]<Shape S>() -> decltype(auto)
  {
    if (s.node_degree == 1)
      return fn(FacetType<S, 1, 1>{});
    return fn(FacetType<S, 2, 2>{});
  };
  if constexpr (D == 2)
    return with_degree.template operator()<Shape::interval>();
  else if (s.shape == Shape::triangle)
    return with_degree.template operator()<Shape::triangle>();
  else
    return with_degree.template operator()<Shape::quadrilateral>();
}

/// @brief Call `fn(S{}, M{})` for the geometry of the facets of two surfaces of
/// one space: their shapes and degrees may differ.
template <class Slave, class Master, class Fn>
decltype(auto) with_geometries(const Slave& slave, const Master& master,
                               Fn&& fn)
{
  return with_geometry(
      slave,
      [&]<class S>(S of) -> decltype(auto)
      {
        return with_geometry_in<S::gdim>(
            master, [&](auto to) -> decltype(auto) { return fn(of, to); });
      });
}
} // namespace raymortar
