/// Conversions between an object's state and a dictionary of NumPy arrays.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <string>
#include <utility>

#include "objects.hpp"
#include "sdnn/core/state.hpp"
#include "words.hpp"

namespace sdnn::bindings {

/// Copies a state to a dictionary of arrays.
inline pybind11::dict arrays_of(const core::State& state) {
  pybind11::dict arrays;
  for (const auto& [name, tensor] : state) {
    pybind11::array array(pybind11::dtype(core::facts_of(tensor.type).dtype), tensor.shape);
    if (!tensor.bytes.empty()) {
      std::memcpy(array.mutable_data(), tensor.bytes.data(), tensor.bytes.size());
    }
    arrays[pybind11::str(name)] = std::move(array);
  }
  return arrays;
}

/// Copies a dictionary of arrays to a state. Throws std::invalid_argument naming an array of a type
/// that no tensor has.
inline core::State state_from(const pybind11::dict& arrays) {
  core::State state;
  for (const auto& [key, value] : arrays) {
    const auto name = escaped_text_of(key);
    const auto array =
        pybind11::array::ensure(value, pybind11::array::c_style);  // its type is not converted
    core::Tensor tensor;
    const auto found = std::ranges::find_if(core::kTensorTypes, [&array](const auto& known) {
      return array && array.dtype().equal(pybind11::dtype(known.dtype));
    });
    if (found == core::kTensorTypes.end()) {
      throw std::invalid_argument("state: " + name + " must be an array of whole or real numbers");
    }
    tensor.type = static_cast<core::TensorType>(found - core::kTensorTypes.begin());
    tensor.shape.assign(array.shape(), array.shape() + array.ndim());
    const auto* const bytes = static_cast<const std::byte*>(array.data());
    tensor.bytes.assign(bytes, bytes + array.nbytes());
    state.insert_or_assign(name, std::move(tensor));
  }
  return state;
}

/// Binds an object's state: `state()` and `restore(state)`.
template <class Object, class... Options>
void def_state(pybind11::class_<Object, Options...>& type) {
  type.def(
          "state", [](const Object& self) { return arrays_of(core::state_of(self)); },
          "What it remembers: arrays by name")
      .def(
          "restore",
          [](Object& self, const pybind11::dict& state) {
            core::State read = state_from(state);
            wait_for_readers(self);
            core::restore(self, read);
          },
          pybind11::arg("state"),
          "Take what `state` of one with the same settings gave; on an error nothing changes");
}

}  // namespace sdnn::bindings
