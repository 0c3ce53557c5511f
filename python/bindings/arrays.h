// NumPy arrays to and from the library's plain arrays. Copies: set-up data is
// small next to the solve, and nobody else's lifetime is involved.
#pragma once

#include <Eigen/Core>
#include <cstring>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <span>
#include <vector>

namespace raymortar::bindings
{
namespace py = pybind11;

template <class T>
using Array = py::array_t<T, py::array::c_style | py::array::forcecast>;

template <class T>
std::vector<T> to_vector(const Array<T>& a)
{
  return {a.data(), a.data() + a.size()};
}

template <class T>
std::span<const T> to_span(const Array<T>& a)
{
  return {a.data(), static_cast<std::size_t>(a.size())};
}

/// Array of the given shape holding a copy of the data
template <class T>
py::array_t<T> to_array(const std::vector<T>& v,
                        std::vector<py::ssize_t> shape = {})
{
  if (shape.empty())
    shape = {static_cast<py::ssize_t>(v.size())};
  py::array_t<T> a(shape);
  std::memcpy(a.mutable_data(), v.data(), v.size() * sizeof(T));
  return a;
}

/// (n, width) array of the first components of small vectors
template <class V>
py::array_t<double> points_to_array(const std::vector<V>& points, int width)
{
  py::array_t<double> a({static_cast<py::ssize_t>(points.size()),
                         static_cast<py::ssize_t>(width)});
  double* out = a.mutable_data();
  for (const V& p : points)
    for (int i = 0; i < width; ++i)
      *out++ = p[i];
  return a;
}

/// Enumerators as int8
template <class E>
py::array_t<std::int8_t> enums_to_array(const std::vector<E>& v)
{
  py::array_t<std::int8_t> a(static_cast<py::ssize_t>(v.size()));
  std::int8_t* out = a.mutable_data();
  for (const E e : v)
    *out++ = static_cast<std::int8_t>(e);
  return a;
}
} // namespace raymortar::bindings
