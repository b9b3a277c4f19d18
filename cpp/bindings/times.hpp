/// Measured times as an array.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <cstdint>

#include "objects.hpp"
#include "tools/stopwatch.hpp"

namespace sdnn::bindings {

/// The times that `measure` of an object returns, int64 nanoseconds (n,); it runs without the GIL.
template <class Object, class Measure>
pybind11::array_t<std::int64_t> times_of(Object& object, const Measure& measure) {
  tools::Times times;
  {
    const WithoutGIL unlocked(object);
    times = measure();
  }
  return pybind11::array_t<std::int64_t>(static_cast<pybind11::ssize_t>(times.size()),
                                         times.data());
}

}  // namespace sdnn::bindings
