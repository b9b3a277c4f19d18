/// The fields of configurations. A configuration lists each field once, in its `fields()`: name,
/// member, documentation and bounds. Checks, files, bindings and the command line follow from it.
#pragma once

#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <limits>
#include <optional>
#include <ostream>
#include <sstream>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <utility>

#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/detail/floating_point.hpp"

namespace sdnn::core {

/// Bounds of a field's numbers, which are finite: [low, high] or, with `excludes_low`, (low, high].
struct Bounds {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool excludes_low = false;
};

constexpr Bounds at_least(double low) noexcept { return {.low = low}; }
constexpr Bounds above(double low) noexcept { return {.low = low, .excludes_low = true}; }
/// Bounds [low, high].
constexpr Bounds within(double low, double high) noexcept { return {.low = low, .high = high}; }
/// Bounds (low, high].
constexpr Bounds above_up_to(double low, double high) noexcept {
  return {.low = low, .high = high, .excludes_low = true};
}

/// An enumeration for which `words_of(value)` returns the names of all values, in their order.
template <class Enum>
concept HasWords = std::is_enum_v<Enum> && requires(Enum value) {
  { words_of(value)[0] } -> std::convertible_to<std::string_view>;
};

/// A member of a configuration.
template <class Config, class Value>
struct ConfigField {
  const char* name;
  Value Config::* member;
  const char* doc;
  Bounds bounds;

  constexpr const Value& of(const Config& config) const noexcept { return config.*member; }
  constexpr Value& of(Config& config) const noexcept { return config.*member; }
};

/// A member of a part, `outer`, of a configuration.
template <class Config, class Inner, class Value>
struct NestedField {
  const char* name;
  Inner Config::* outer;
  Value Inner::* member;
  const char* doc;
  Bounds bounds;

  constexpr const Value& of(const Config& config) const noexcept { return config.*outer.*member; }
  constexpr Value& of(Config& config) const noexcept { return config.*outer.*member; }
};

template <class Config, class Value>
constexpr ConfigField<Config, Value> field(const char* name, Value Config::* member,
                                           const char* doc, Bounds bounds = {}) noexcept {
  return {name, member, doc, bounds};
}

/// The type of a field's values.
template <class Field, class Config>
using FieldValue =
    std::remove_cvref_t<decltype(std::declval<const Field&>().of(std::declval<const Config&>()))>;

/// Returns the fields of a part of a configuration as fields of the whole.
template <class Config, class Inner>
constexpr auto nested_fields(Inner Config::* member) noexcept {
  return std::apply(
      [member]<class... Value>(const ConfigField<Inner, Value>&... field) {
        return std::tuple(NestedField<Config, Inner, Value>{field.name, member, field.member,
                                                            field.doc, field.bounds}...);
      },
      Inner::fields());
}

/// Describes bounds: "in [0, 1]".
inline std::string words_of(const Bounds& bounds, bool is_whole) {
  std::ostringstream text;
  const auto write = [&text](double number) -> std::ostream& {
    if (number == std::floor(number) && std::abs(number) < 1e15) {
      return text << static_cast<long long>(number);  // 10000000 instead of 1e+07
    }
    return text << number;
  };
  if (std::isfinite(bounds.high)) {
    text << (bounds.excludes_low ? "in (" : "in [");
    write(bounds.low) << ", ";
    write(bounds.high) << ']';
  } else if (!std::isfinite(bounds.low)) {
    text << "finite";
  } else if (bounds.excludes_low) {
    text << "a finite number greater than ";
    write(bounds.low);
  } else {
    text << (is_whole ? "at least " : "finite and at least ");
    write(bounds.low);
  }
  return text.str();
}

/// Throws ArgumentError unless the value, or each item of a list, is within its bounds.
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
