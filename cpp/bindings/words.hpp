/// Texts of Python, as which C++ enumerations with words appear: InitialWeights::uniform is
/// "uniform".
#pragma once

#include <pybind11/pybind11.h>

#include <algorithm>
#include <cstddef>
#include <string>
#include <string_view>
#include <type_traits>

#include "sdnn/core/config_fields.hpp"

namespace sdnn::bindings {

/// Returns a Python text in UTF-8, or an empty text if it cannot be encoded: a command's arguments
/// may contain any bytes, which Python keeps as unpaired surrogates.
inline std::string_view text_of(pybind11::handle text) {
  Py_ssize_t size = 0;
  const char* const data = PyUnicode_AsUTF8AndSize(text.ptr(), &size);
  if (data != nullptr) return {data, static_cast<std::size_t>(size)};
  PyErr_Clear();
  return {};
}

/// Returns a Python text in UTF-8, with escapes for characters that cannot be encoded.
inline std::string escaped_text_of(pybind11::handle text) {
  return pybind11::str(text).attr("encode")("utf-8", "backslashreplace").cast<std::string>();
}

}  // namespace sdnn::bindings

namespace pybind11::detail {

template <class Enum>
struct type_caster_enum_type_enabled<Enum, std::enable_if_t<sdnn::core::HasWords<Enum>>>
    : std::false_type {};

template <class Enum>
class type_caster<Enum, std::enable_if_t<sdnn::core::HasWords<Enum>>> {
 public:
  PYBIND11_TYPE_CASTER(Enum, const_name("str"));

  bool load(handle source, bool) {
    if (!isinstance<str>(source)) return false;
    const auto words = words_of(Enum{});
    const auto found = std::ranges::find(words, sdnn::bindings::text_of(source));
    value = static_cast<Enum>(found - words.begin());
    return found != words.end();
  }

  static handle cast(Enum value, return_value_policy, handle) {
    const std::string_view word = words_of(value).at(static_cast<std::size_t>(value));
    return str(word.data(), word.size()).release();
  }
};

}  // namespace pybind11::detail
