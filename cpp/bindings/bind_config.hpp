/// A configuration's Python class, from the list of its fields: frozen, with keyword arguments that
/// are checked, and `fields`, from which options, schemas and documentation are made.
#pragma once

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <cmath>
#include <concepts>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <vector>

#include "objects.hpp"
#include "sdnn/core/config_fields.hpp"
#include "sdnn/core/detail/check_fields.hpp"
#include "words.hpp"

namespace sdnn::bindings {

template <class Value>
inline constexpr bool kIsOptional = false;
template <class Value>
inline constexpr bool kIsOptional<std::optional<Value>> = true;
template <class Value>
inline constexpr bool kIsList = false;
template <class Value>
inline constexpr bool kIsList<std::vector<Value>> = true;

/// A type in the words of Python's type hints.
template <class Value>
std::string hint_of() {
  if constexpr (kIsOptional<Value>) {
    return hint_of<typename Value::value_type>() + " | None";
  } else if constexpr (kIsList<Value>) {
    return "tuple[" + hint_of<typename Value::value_type>() + ", ...]";
  } else if constexpr (core::HasWords<Value>) {
    std::string words;
    for (const auto word : words_of(Value{})) {
      words += (words.empty() ? "'" : ", '") + std::string(word) + "'";
    }
    return "typing.Literal[" + words + "]";
  } else if constexpr (std::is_same_v<Value, bool>) {
    return "bool";
  } else if constexpr (std::integral<Value>) {
    return "int";
  } else {
    return "float";
  }
}

/// What a value must be, for a reader.
template <class Value>
std::string expected_words() {
  if constexpr (kIsOptional<Value>) {
    return expected_words<typename Value::value_type>() + ", or None";
  } else if constexpr (kIsList<Value>) {
    return "a sequence, each " + expected_words<typename Value::value_type>();
  } else if constexpr (core::HasWords<Value>) {
    std::string words = "one of ";
    for (const auto word : words_of(Value{})) {
      words += (words.back() == ' ' ? "'" : ", '") + std::string(word) + "'";
    }
    return words;
  } else if constexpr (std::is_same_v<Value, bool>) {
    return "True or False";
  } else if constexpr (std::integral<Value>) {
    return "a whole number";
  } else {
    return "a number";
  }
}

/// An argument is of another type. Python gets a TypeError with the attribute `argument`.
class ArgumentTypeError : public core::ArgumentError {
 public:
  using ArgumentError::ArgumentError;
};

/// The representation of any value, for a message.
inline std::string shown(pybind11::handle value) {
  return pybind11::module_::import("sdnn.arguments").attr("shown")(value).cast<std::string>();
}

/// Whether it is True or False, of Python or NumPy.
inline bool is_truth(pybind11::handle value) {
  namespace py = pybind11;
  if (PyBool_Check(value.ptr())) return true;
  const py::object dtype = py::getattr(value, "dtype", py::none());
  return py::getattr(dtype, "kind", py::none()).equal(py::str("b")) &&
         !PySequence_Check(value.ptr());
}

struct FieldInfo {
  const char* name;
  core::Bounds bounds;
};

/// Reads a Python value; false if it is of another type. True is no number, and 1.0 no whole one.
template <class Value>
bool read_value(pybind11::handle source, Value& value, const FieldInfo& field);

template <std::integral Number>
bool read_whole(pybind11::handle source, Number& value, const FieldInfo& field) {
  namespace py = pybind11;
  if (is_truth(source) || PyIndex_Check(source.ptr()) == 0) return false;
  const auto number = py::reinterpret_steal<py::object>(PyNumber_Index(source.ptr()));
  if (!number) {
    PyErr_Clear();
    return false;
  }
  try {
    value = number.cast<Number>();
  } catch (const py::cast_error&) {  // too large for the core
    core::Bounds bounds = field.bounds;
    if (!std::isfinite(bounds.low))
      bounds.low = static_cast<double>(std::numeric_limits<Number>::min());
    if (!std::isfinite(bounds.high))
      bounds.high = static_cast<double>(std::numeric_limits<Number>::max());
    core::require(false, field.name, core::words_of(bounds, true), shown(source));
  }
  return true;
}

template <class Value>
bool read_value(pybind11::handle source, Value& value, const FieldInfo& field) {
  namespace py = pybind11;
  if constexpr (kIsOptional<Value>) {
    value.reset();
    return source.is_none() || read_value(source, value.emplace(), field);
  } else if constexpr (kIsList<Value>) {
    const bool is_text = py::isinstance<py::str>(source) || py::isinstance<py::bytes>(source);
    if (is_text || PySequence_Check(source.ptr()) == 0) return false;
    value.clear();
    for (const py::handle item : source) {
      typename Value::value_type one{};
      if (!read_value(item, one, field)) return false;
      value.push_back(one);
    }
    return true;
  } else if constexpr (core::HasWords<Value>) {
    const auto words = words_of(Value{});
    const auto found = py::isinstance<py::str>(source)
                           ? std::ranges::find(words, source.cast<std::string_view>())
                           : words.end();
    if (found == words.end()) {
      core::require(false, field.name, expected_words<Value>(), shown(source));
    }
    value = static_cast<Value>(found - words.begin());
    return true;
  } else if constexpr (std::is_same_v<Value, bool>) {
    if (!is_truth(source)) return false;
    value = py::bool_(py::reinterpret_borrow<py::object>(source));
    return true;
  } else if constexpr (std::integral<Value>) {
    return read_whole(source, value, field);
  } else {
    if (is_truth(source)) return false;
    value = PyFloat_AsDouble(source.ptr());
    if (value != -1.0 || PyErr_Occurred() == nullptr) return true;
    const bool is_large = PyErr_ExceptionMatches(PyExc_OverflowError) != 0;
    PyErr_Clear();
    if (is_large) {
      core::require(false, field.name, core::words_of(field.bounds, false), shown(source));
    }
    return false;
  }
}

/// A value as Python has it: lists as tuples, which have a hash.
template <class Value>
pybind11::object python_value(const Value& value) {
  if constexpr (kIsList<Value>) {
    pybind11::tuple items(value.size());
    for (std::size_t i = 0; i < value.size(); ++i) {
      items[i] = python_value<typename Value::value_type>(value[i]);
    }
    return items;
  } else {
    return pybind11::cast(value);
  }
}

template <class Config>
pybind11::dict dictionary_of(const Config& config) {
  pybind11::dict values;
  std::apply(
      [&](const auto&... field) { ((values[field.name] = python_value(field.of(config))), ...); },
      Config::fields());
  return values;
}

/// The configuration with other values of some fields. Throws ArgumentTypeError for a value of
/// another type, ArgumentError for one out of its bounds, pybind11::type_error for unknown names.
template <class Config>
Config changed(Config config, const pybind11::kwargs& changes) {
  namespace py = pybind11;
  std::size_t n_known = 0;
  const auto read = [&](const auto& field) {
    if (!changes.contains(field.name)) return;
    ++n_known;
    using Value = core::FieldValue<std::remove_cvref_t<decltype(field)>, Config>;
    const py::object source = changes[field.name];
    if (read_value(source, field.of(config), FieldInfo{field.name, field.bounds})) return;
    throw ArgumentTypeError(field.name, std::string(field.name) + " must be " +
                                            expected_words<Value>() + ", got " + shown(source));
  };
  std::apply([&](const auto&... field) { (read(field), ...); }, Config::fields());
  if (n_known < changes.size()) {
    const py::dict known = dictionary_of(config);
    for (const auto& [name, value] : changes) {
      if (known.contains(name)) continue;
      const auto word = name.template cast<std::string>();
      throw ArgumentTypeError(word, word + " is not a field: they are " +
                                        py::str(", ").attr("join")(known).cast<std::string>());
    }
  }
  core::check_fields(config);
  return config;
}

/// (name, type hint, default, documentation, low, high, whether low itself is excluded) of each.
template <class Config>
pybind11::tuple described_fields() {
  namespace py = pybind11;
  const Config defaults;
  return std::apply(
      [&](const auto&... field) {
        return py::make_tuple(py::make_tuple(
            field.name, hint_of<core::FieldValue<std::remove_cvref_t<decltype(field)>, Config>>(),
            python_value(field.of(defaults)), field.doc, field.bounds.low, field.bounds.high,
            field.bounds.excludes_low)...);
      },
      Config::fields());
}

/// A docstring in numpydoc's form.
template <class Config>
std::string docstring(const char* doc) {
  std::string text = std::string(doc) + "\n\nParameters\n----------\n";
  const auto add = [&text](const auto& field) {
    using Value = core::FieldValue<std::remove_cvref_t<decltype(field)>, Config>;
    std::string hint = hint_of<Value>();
    if (hint.starts_with("typing.Literal[")) hint = '{' + hint.substr(15, hint.size() - 16) + '}';
    text += std::string(field.name) + " : " + hint + "\n    " + field.doc;
    if constexpr (!std::is_same_v<Value, bool> && !core::HasWords<Value>) {
      const std::string bounds = core::words_of(field.bounds, std::integral<Value>);
      if (bounds != "finite") text += " Must be " + bounds + '.';
    }
    text += '\n';
  };
  std::apply([&](const auto&... field) { (add(field), ...); }, Config::fields());
  return text +
         "\nRaises\n------\nTypeError, ValueError\n    For a value of another type or out of its"
         " bounds; ``argument`` is its name.\n";
}

/// Binds a configuration.
template <class Config>
pybind11::class_<Config> bind_config(pybind11::module_& module, const char* name, const char* doc) {
  namespace py = pybind11;
  const std::string text = docstring<Config>(doc);
  py::class_<Config> type(module, name, text.c_str());
  type.def(py::init([](const py::kwargs& values) { return changed(Config{}, values); }));
  std::apply(
      [&type](const auto&... field) {
        (type.def_property_readonly(
             field.name, [field](const Config& self) { return python_value(field.of(self)); },
             field.doc),
         ...);
      },
      Config::fields());
  type.attr("fields") = described_fields<Config>();
  const auto replace = [](const Config& self, const py::kwargs& changes) {
    return changed(self, changes);
  };
  type.def("replace", replace, "Return a copy with other values of some fields.");
  type.def("__replace__", replace);
  type.def("__repr__", [](const py::object& self) {
    std::string values;
    for (const auto& [key, value] : dictionary_of(self.cast<const Config&>())) {
      values += (values.empty() ? "" : ", ") + key.template cast<std::string>() + "=" +
                std::string(pybind11::repr(value));
    }
    return py::cast<std::string>(py::type::of(self).attr("__name__")) + "(" + values + ")";
  });
  type.def("__eq__", [](const Config& self, const py::object& other) {
    return py::isinstance<Config>(other) && self == other.cast<const Config&>();
  });
  type.def("__hash__", [](const Config& self) {
    return py::hash(py::tuple(dictionary_of(self).attr("values")()));
  });
  type.def(
      py::pickle([](const Config& self) { return dictionary_of(self); },
                 [](const py::dict& values) { return changed(Config{}, py::kwargs(values)); }));
  return type;
}

}  // namespace sdnn::bindings
