/// The check of a configuration against the bounds of its fields.
#pragma once

#include <cmath>
#include <optional>
#include <ostream>
#include <sstream>
#include <string>
#include <tuple>
#include <type_traits>

#include "sdnn/core/config_fields.hpp"
#include "sdnn/core/detail/check.hpp"

namespace sdnn::core {

/// Describes bounds: "in [0, 1]".
inline std::string words_of(const Bounds& bounds, bool is_whole) {
  std::ostringstream words;
  const auto write = [&words](double number) -> std::ostream& {
    if (number == std::floor(number) && std::abs(number) < 1e15) {
      return words << static_cast<long long>(number);
    }
    return words << number;
  };
  if (std::isfinite(bounds.high)) {
    words << (bounds.excludes_low ? "in (" : "in [");
    write(bounds.low) << ", ";
    write(bounds.high) << ']';
  } else if (!std::isfinite(bounds.low)) {
    words << "finite";
  } else if (bounds.excludes_low) {
    words << "a finite number greater than ";
    write(bounds.low);
  } else {
    words << (is_whole ? "at least " : "finite and at least ");
    write(bounds.low);
  }
  return words.str();
}

template <class Value>
void check_bounds(const char* name, const Value& value, const Bounds& bounds) {
  if constexpr (std::is_same_v<Value, bool> || std::is_enum_v<Value>) {
    return;
  } else if constexpr (std::is_arithmetic_v<Value>) {
    const double number = static_cast<double>(value);
    const bool is_above = bounds.excludes_low ? number > bounds.low : number >= bounds.low;
    if (std::isfinite(number) && is_above && number <= bounds.high) return;
    require(false, name, words_of(bounds, std::is_integral_v<Value>), value);
  } else if constexpr (requires { value.has_value(); }) {
    if (value) check_bounds(name, *value, bounds);
  } else {
    // The type is named because the items of a std::vector<bool> are proxies.
    for (const typename Value::value_type& item : value) check_bounds(name, item, bounds);
  }
}

/// Throws ArgumentError naming the first field that is out of its bounds.
template <class Config>
void check_fields(const Config& config) {
  std::apply(
      [&config](const auto&... field) {
        (check_bounds(field.name, field.of(config), field.bounds), ...);
      },
      Config::fields());
}

}  // namespace sdnn::core
