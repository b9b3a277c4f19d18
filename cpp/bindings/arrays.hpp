/// Between NumPy arrays and spans: views in, copies out.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace sdnn::bindings {

/// An argument that becomes a C-contiguous array of `T`, converted if need be.
template <class T>
using ArrayArgument = pybind11::array_t<T, pybind11::array::c_style | pybind11::array::forcecast>;

/// The items of an array, whatever its shape.
template <class T>
std::span<const T> flat(const ArrayArgument<T>& array) {
  return {array.data(), static_cast<std::size_t>(array.size())};
}

/// The items of a one-dimensional array. Throws std::invalid_argument naming the argument.
template <class T>
std::span<const T> vector(const ArrayArgument<T>& array, const char* name) {
  if (array.ndim() != 1) {
    throw std::invalid_argument(std::string(name) + " must have one dimension, got " +
                                std::to_string(array.ndim()));
  }
  return flat(array);
}

}  // namespace sdnn::bindings
