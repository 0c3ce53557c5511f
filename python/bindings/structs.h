// Plain structs of the library: options as classes with keywords, counts as
// dictionaries. Each name is written once.
#pragma once

#include "arrays.h"

namespace raymortar::bindings
{
/// How an argument is taken: lists of numbers as arrays
template <class T>
struct Argument
{
  using type = T;
  static T take(T value) { return value; }
};

template <class T>
requires std::is_arithmetic_v<T>
struct Argument<std::vector<T>>
{
  using type = Array<T>;
  static std::vector<T> take(const type& value) { return to_vector(value); }
};

/// A field of a struct, or of one that it is derived from
template <class Owner, class T>
struct Field
{
  const char* name;
  T Owner::*member;
};
template <class Owner, class T>
Field(const char*, T Owner::*) -> Field<Owner, T>;

/// A class whose constructor takes all the fields by name
template <class Struct, class... Owner, class... T>
py::class_<Struct> bind_options(py::module_& m, const char* name,
                                Field<Owner, T>... fields)
{
  return py::class_<Struct>(m, name).def(
      py::init(
          [fields...](typename Argument<T>::type... values)
          {
            Struct made;
            ((made.*(fields.member) = Argument<T>::take(std::move(values))),
             ...);
            return made;
          }),
      py::kw_only(), py::arg(fields.name)...);
}

/// Names and values of a struct with for_each_field
template <class Struct>
py::dict to_dict(const Struct& values)
{
  py::dict d;
  for_each_field(values,
                 [&](const char* name, auto value) { d[name] = value; });
  return d;
}
} // namespace raymortar::bindings
