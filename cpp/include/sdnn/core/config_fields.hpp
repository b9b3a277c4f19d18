/// The fields of a configuration, with name, member, documentation and bounds. Each is listed once,
/// for checks, files and the bindings, and through these for the command line.
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

/// The finite numbers that a field may have, from `low` to `high`.
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

/// An enumeration whose values have names: `words_of(value)` returns them in the order of values.
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

/// A member of a configuration that is itself a member of a larger one.
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

/// The field called `name`. `doc` describes it in the documentation.
template <class Config, class Value>
constexpr ConfigField<Config, Value> field(const char* name, Value Config::* member,
                                           const char* doc, Bounds bounds = {}) noexcept {
  return {name, member, doc, bounds};
}

/// The type of a field's values.
template <class Field, class Config>
using FieldValue =
    std::remove_cvref_t<decltype(std::declval<const Field&>().of(std::declval<const Config&>()))>;

/// The fields of `member`, as fields of the configuration that it is a part of.
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
