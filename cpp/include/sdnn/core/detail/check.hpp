/// Argument checks for public functions: messages name the argument, the expected and the given
/// value.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>

#include "sdnn/core/detail/floating_point.hpp"
#include "sdnn/core/errors.hpp"

namespace sdnn::core {

/// Throws ArgumentError "<name> must be <expected>, got <value>" unless `valid`.
template <class Value>
void require(bool valid, std::string_view name, std::string_view expected, const Value& value) {
  if (valid) return;
  std::ostringstream message;
  message << name << " must be " << expected << ", got " << value;
  fail(ArgumentError(std::string(name), message.str()));
}

/// Throws std::invalid_argument unless low <= value <= high; NaN is outside every range.
template <class Value>
void require_in_range(std::string_view name, Value value, std::type_identity_t<Value> low,
                      std::type_identity_t<Value> high) {
  if (value >= low && value <= high) return;
  std::ostringstream expected;
  expected << "in [" << low << ", " << high << "]";
  require(false, name, expected.str(), value);
}

/// Throws std::invalid_argument unless `value` is greater than `other`.
template <class Value>
void require_greater(std::string_view name, Value value, std::string_view other_name,
                     std::type_identity_t<Value> other) {
  if (value > other) return;
  std::ostringstream expected;
  expected << "greater than " << other_name << " = " << other;
  require(false, name, expected.str(), value);
}

/// Throws std::invalid_argument unless `value` is a finite number.
inline void require_finite(std::string_view name, double value) {
  require(std::isfinite(value), name, "finite", value);
}

/// Whether all numbers are finite.
inline bool are_finite(std::span<const double> values) noexcept {
  return std::ranges::all_of(values, [](double x) { return std::isfinite(x); });
}

/// Throws std::invalid_argument unless there are as many items, "values", as expected. Only the
/// text of an error allocates, here and below.
inline void require_size(std::string_view name, std::size_t size, std::size_t expected,
                         const char* items = "values") {
  if (size != expected) require(false, name, std::to_string(expected) + ' ' + items, size);
}

/// Throws std::invalid_argument unless an index is below a number.
inline void require_below(std::string_view name, std::size_t index, std::size_t end) {
  if (index >= end) require(false, name, "less than " + std::to_string(end), index);
}

/// Throws std::invalid_argument unless `values` are `size` numbers in [0, 1].
inline void require_unit_values(std::string_view name, std::span<const double> values,
                                std::size_t size) {
  require_size(name, values.size(), size);
  for (std::size_t i = 0; i < size; ++i) {
    if (values[i] >= 0.0 && values[i] <= 1.0) continue;
    require_in_range(std::string(name) + '[' + std::to_string(i) + ']', values[i], 0.0, 1.0);
  }
}

}  // namespace sdnn::core
