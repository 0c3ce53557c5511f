// Facet types that typed tests run over, and random facets of them.
#pragma once

#include "raymortar/geometry/frame.h"
#include <array>
#include <gtest/gtest.h>
#include <random>

namespace raymortar::test
{
using Interval1 = FacetType<Shape::interval, 1, 1>;
using Interval2 = FacetType<Shape::interval, 2, 2>;
using Triangle1 = FacetType<Shape::triangle, 1, 1>;
using Triangle2 = FacetType<Shape::triangle, 2, 2>;
using Quad1 = FacetType<Shape::quadrilateral, 1, 1>;
using Quad2 = FacetType<Shape::quadrilateral, 2, 2>;

using AllFacets =
    testing::Types<Interval1, Interval2, Triangle1, Triangle2, Quad1, Quad2>;

inline constexpr std::array all_shapes = {Shape::interval, Shape::triangle,
                                          Shape::quadrilateral};

template <int N>
Vec<N> random_vector(std::mt19937& random, double size)
{
  std::uniform_real_distribution<double> component(-size, size);
  Vec<N> x;
  for (int i = 0; i < N; ++i)
    x[i] = component(random);
  return x;
}

/// Set each entry of a matrix at random. Eigen's own setRandom hangs on which
/// tests have run before
template <class Matrix>
void fill_random(std::mt19937& random, Matrix& matrix, double size)
{
  std::uniform_real_distribution<double> entry(-size, size);
  for (auto k = 0; k < matrix.size(); ++k)
    matrix.data()[k] = entry(random);
}

/// Reference points as nodes in the plane of the first axes, each moved at
/// random: `amount` 0 gives the flat facet with normal -y in 2D, +z in 3D
template <class F>
typename F::NodeMatrix random_nodes(std::mt19937& random, double amount)
{
  typename F::NodeMatrix nodes = F::NodeMatrix::Zero();
  for (int a = 0; a < F::nodes; ++a)
  {
    const auto& point = F::Node::points[static_cast<std::size_t>(a)];
    nodes.col(a).template head<F::tdim>() = typename F::RefPoint(point.data());
    nodes.col(a) += random_vector<F::gdim>(random, amount);
  }
  return nodes;
}

/// Inside the reference facet
template <class F>
typename F::RefPoint random_inside(std::mt19937& random)
{
  std::uniform_real_distribution<double> unit(0, 1);
  typename F::RefPoint xi;
  for (int i = 0; i < F::tdim; ++i)
    xi[i] = unit(random);
  if (F::shape == Shape::triangle and xi.sum() > 1)
    xi = F::RefPoint::Ones() - xi;
  return xi;
}
} // namespace raymortar::test
