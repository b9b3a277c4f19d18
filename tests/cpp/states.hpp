/// Changes of states, and objects that must refuse them.
#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "sdnn/core/state.hpp"

namespace sdnn::testing {

inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// A tensor of one dimension.
template <class T>
core::Tensor tensor_of(const std::vector<T>& values) {
  core::Tensor tensor{core::tensor_type<T>(), {values.size()}, {}};
  const auto bytes = std::as_bytes(std::span(values));
  tensor.bytes.assign(bytes.begin(), bytes.end());
  return tensor;
}

/// Number `i` of a tensor.
template <class T>
T number_of(const core::State& state, const std::string& name, std::size_t i = 0) {
  T value{};
  std::memcpy(&value, state.at(name).bytes.data() + i * sizeof(T), sizeof(T));
  return value;
}

/// The state with another number `i` in a tensor.
template <class T>
core::State with_number(core::State state, const std::string& name, T value, std::size_t i = 0) {
  core::Tensor& tensor = state.at(name);
  EXPECT_EQ(tensor.type, core::tensor_type<T>()) << name;
  std::memcpy(tensor.bytes.data() + i * sizeof(T), &value, sizeof(T));
  return state;
}

/// Expects that the object refuses the state, with a message that begins with `message`, and has
/// not changed.
template <class Object>
void expect_refused(Object& object, const core::State& bad, const std::string& message) {
  const core::State before = core::state_of(object);
  try {
    core::restore(object, bad);
    ADD_FAILURE() << "taken: " << message;
  } catch (const std::invalid_argument& error) {
    EXPECT_EQ(std::string(error.what()).substr(0, message.size()), message);
  }
  EXPECT_EQ(core::state_of(object), before) << message;
}

/// Expects that an object refuses its state with any one tensor missing, of another type, of
/// another shape or cut, and with one more.
template <class Object>
void expect_damaged_states_refused(Object& object) {
  const core::State good = core::state_of(object);
  for (const auto& [name, tensor] : good) {
    core::State bad = good;
    bad.erase(name);
    expect_refused(object, bad, "state: " + name + " must be there");
    bad = good;
    bad[name].type =
        tensor.type == core::TensorType::f32 ? core::TensorType::i32 : core::TensorType::f32;
    expect_refused(object, bad, "state: " + name + " must be " + core::facts_of(tensor.type).name);
    bad = good;
    bad[name].shape.push_back(1);
    expect_refused(object, bad, "state: " + name + " must be of ");
    bad[name] = tensor;
    bad[name].bytes.push_back(std::byte{0});
    expect_refused(object, bad, "state: " + name + " must be as large as its shape");
    bad[name] = tensor;
    bad[name].shape.assign(9, SIZE_MAX / 16 + 1);  // the product leaves the range of numbers
    expect_refused(object, bad, "state: " + name + " must be as large as its shape");
  }
  core::State more = good;
  more["stranger"] = tensor_of<double>({1.0});
  expect_refused(object, more, "state: stranger must not be there");
  core::restore(object, good);
  EXPECT_EQ(core::state_of(object), good);
}

}  // namespace sdnn::testing
