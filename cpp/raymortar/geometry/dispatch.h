// From the run-time description of a facet to its compile-time type.
#pragma once

#include "raymortar/core/error.h"
#include "raymortar/geometry/reference.h"

namespace raymortar
{
/// @brief Call `fn(FacetType<S, P, K>{})` for the shape and degrees of `s`.
/// @param[in] s Anything with members shape, degree, node_degree
template <class Description, class Fn>
decltype(auto) with_facet_type(const Description& s, Fn&& fn)
{
  const auto with_degrees = [&]<Shape S>() -> decltype(auto)
  {
    if (s.degree == 1 and s.node_degree == 1)
      return fn(FacetType<S, 1, 1>{});
    if (s.degree == 1 and s.node_degree == 2)
      return fn(FacetType<S, 1, 2>{});
    if (s.degree == 2 and s.node_degree == 2)
      return fn(FacetType<S, 2, 2>{});
    throw Error("facets have displacement degree " + std::to_string(s.degree) +
                " and node degree " + std::to_string(s.node_degree) +
                "; supported are 1 and 2, node degree not below");
  };
  switch (s.shape)
  {
  case Shape::interval:
    return with_degrees.template operator()<Shape::interval>();
  case Shape::triangle:
    return with_degrees.template operator()<Shape::triangle>();
  case Shape::quadrilateral:
    return with_degrees.template operator()<Shape::quadrilateral>();
  }
  throw Error("unknown facet shape");
}
} // namespace raymortar
