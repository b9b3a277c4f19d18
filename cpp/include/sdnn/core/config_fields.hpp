/// The fields of a configuration, with name, member, documentation and bounds. Each is listed once,
/// for checks, files and the bindings, and through these for the command line.
#pragma once

#include <array>
#include <concepts>
#include <cstddef>
#include <limits>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <utility>

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

/// An enumeration with words: `words_of(value)` beside it gives them in the order of its values.
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

}  // namespace sdnn::core
