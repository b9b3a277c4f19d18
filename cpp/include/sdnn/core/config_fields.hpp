/// The named members of a configuration: listed once, read by whoever needs all of them.
#pragma once

#include <tuple>
#include <type_traits>
#include <utility>

#include "sdnn/core/detail/floating_point.hpp"

namespace sdnn::core {

/// A member of a configuration and its name.
template <class Config, class Value>
struct ConfigField {
  const char* name;
  Value Config::* member;

  constexpr const Value& of(const Config& config) const noexcept { return config.*member; }
  constexpr Value& of(Config& config) const noexcept { return config.*member; }
};

/// A member of a configuration that is itself a member of a larger one.
template <class Config, class Inner, class Value>
struct NestedField {
  const char* name;
  Inner Config::* outer;
  Value Inner::* member;

  constexpr const Value& of(const Config& config) const noexcept { return config.*outer.*member; }
  constexpr Value& of(Config& config) const noexcept { return config.*outer.*member; }
};

/// The field called `name`.
template <class Config, class Value>
constexpr ConfigField<Config, Value> field(const char* name, Value Config::* member) noexcept {
  return {name, member};
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
        return std::tuple(NestedField<Config, Inner, Value>{field.name, member, field.member}...);
      },
      Inner::fields());
}

}  // namespace sdnn::core
