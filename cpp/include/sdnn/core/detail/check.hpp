/// Argument checks: messages name the argument, what was expected, and the value.
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

/// Throws std::invalid_argument unless `size` is `expected`, a number of `items`. Like the checks
/// below, which every step of an agent calls, it allocates memory for errors only.
inline void require_size(std::string_view name, std::size_t size, std::size_t expected,
                         const char* items = "values") {
  if (size != expected) require(false, name, std::to_string(expected) + ' ' + items, size);
}

/// Throws std::invalid_argument unless index < end.
inline void require_below(std::string_view name, std::size_t index, std::size_t end) {
  if (index >= end) require(false, name, "less than " + std::to_string(end), index);
}

constexpr bool is_unit_value(double value) noexcept { return value >= 0.0 && value <= 1.0; }
/// Whether all numbers are in [0, 1].
inline bool are_unit_values(std::span<const double> values) noexcept {
  return std::ranges::all_of(values, is_unit_value);
}
/// Throws std::invalid_argument unless `values` are `size` numbers in [0, 1].
inline void require_unit_values(std::string_view name, std::span<const double> values,
                                std::size_t size) {
  require_size(name, values.size(), size);
  for (std::size_t i = 0; i < size; ++i) {
    if (is_unit_value(values[i])) continue;
    require_in_range(std::string(name) + '[' + std::to_string(i) + ']', values[i], 0.0, 1.0);
  }
}

}  // namespace sdnn::core
