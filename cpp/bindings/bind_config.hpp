/// Makes the Python class of a configuration from the list of its fields. It is frozen, checks its
/// keyword arguments, and has `fields`, from which options, schemas and documentation are
/// generated.
#pragma once

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <vector>

#include "objects.hpp"
#include "sdnn/core/config_fields.hpp"
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

/// Describes a type of values as a Python type hint ("int | None"), or else for an error message
/// ("a whole number, or None").
template <class Value>
std::string words_of_type(bool is_hint) {
  if constexpr (kIsOptional<Value>) {
    return words_of_type<typename Value::value_type>(is_hint) + (is_hint ? " | None" : ", or None");
  } else if constexpr (kIsList<Value>) {
    const std::string item = words_of_type<typename Value::value_type>(is_hint);
    return is_hint ? "tuple[" + item + ", ...]" : "a sequence, each " + item;
  } else if constexpr (core::HasWords<Value>) {
    std::string words;
    for (const auto word : words_of(Value{})) {
      words += (words.empty() ? "'" : ", '") + std::string(word) + "'";
    }
    return is_hint ? "typing.Literal[" + words + "]" : "one of " + words;
  } else if constexpr (std::is_same_v<Value, bool>) {
    return is_hint ? "bool" : "True or False";
  } else if constexpr (std::integral<Value>) {
    return is_hint ? "int" : "a whole number";
  } else {
    return is_hint ? "float" : "a number";
  }
}

/// The error for an argument of a wrong type. Python raises a TypeError whose attribute `argument`
/// has its name.
class ArgumentTypeError : public core::ArgumentError {
 public:
  using NamedError::NamedError;
};

/// Returns a short representation of a Python object, for a message.
inline std::string shown(pybind11::handle value) {
  return pybind11::module_::import("sdnn.support.arguments")
      .attr("shown")(value)
      .cast<std::string>();
}

/// Whether an object is True or False, of Python or NumPy.
inline bool is_truth(pybind11::handle value) {
  namespace py = pybind11;
  if (PyBool_Check(value.ptr())) return true;
  const py::object dtype = py::getattr(value, "dtype", py::none());
  return py::getattr(dtype, "kind", py::none()).equal(py::str("b")) &&
         !PySequence_Check(value.ptr());
}

struct Field;

/// A type of values of fields: how it is described, converted to Python and read from Python.
/// `value` is the address of a value of the type.
struct ValueType {
  std::string (*words)(bool is_hint);
  bool has_bounds;
  bool is_whole;
  pybind11::object (*to_python)(const void* value);
  bool (*read)(pybind11::handle source, void* value, const Field& field);
};

/// A field of a configuration object, with the address of its value. It does not depend on the type
/// of the configuration, so that the functions below are compiled once for each type of values, and
/// not for every field of every configuration, which would take long.
struct Field {
  const char* name;
  const char* doc;
  core::Bounds bounds;
  const ValueType* type;
  void* value;
};

/// Reads a Python integer, or NumPy's. Returns false for other objects; throws if it is too large.
template <std::integral Number>
bool read_whole(pybind11::handle source, Number& value, const Field& field) {
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

/// Reads a Python object into a field's value. Returns false for an object of the wrong type: True
/// is no number, and 1.0 is no integer. Throws ArgumentError for an unknown word or too large a
/// number.
template <class Value>
bool read_value(pybind11::handle source, Value& value, const Field& field) {
  namespace py = pybind11;
  if constexpr (kIsOptional<Value>) {
    value.reset();
    return source.is_none() || read_value(source, value.emplace(), field);
  } else if constexpr (kIsList<Value>) {
    const bool is_text = py::isinstance<py::str>(source) || py::isinstance<py::bytes>(source);
    if (is_text || PySequence_Check(source.ptr()) == 0) return false;
    value.clear();
    for (const py::handle item : source) {
      typename Value::value_type element{};
      if (!read_value(item, element, field)) return false;
      value.push_back(element);
    }
    return true;
  } else if constexpr (core::HasWords<Value>) {
    py::detail::make_caster<Value> word;
    if (!word.load(source, false)) {
      core::require(false, field.name, words_of_type<Value>(false), shown(source));
    }
    value = word;
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

/// Converts a value to Python. Lists become tuples, so that configurations can be hashed.
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

template <class Value>
inline constexpr ValueType kValueType{
    .words = &words_of_type<Value>,
    .has_bounds = !std::is_same_v<Value, bool> && !core::HasWords<Value>,
    .is_whole = std::integral<Value>,
    .to_python = [](const void* value) -> pybind11::object {
      return python_value(*static_cast<const Value*>(value));
    },
    .read =
        [](pybind11::handle source, void* value, const Field& field) {
          return read_value(source, *static_cast<Value*>(value), field);
        },
};

/// Lists the fields of a configuration. Their values may be written only if `config` refers to an
/// object that is not const.
template <class Config>
auto fields_of(const Config& config) {
  const auto erased = [&config](const auto& field) {
    using Value = core::FieldValue<std::remove_cvref_t<decltype(field)>, Config>;
    return Field{field.name, field.doc, field.bounds, &kValueType<Value>,
                 const_cast<Value*>(&field.of(config))};
  };
  return std::apply([&](const auto&... field) { return std::array{erased(field)...}; },
                    Config::fields());
}

inline pybind11::object python_value_of(const Field& field) {
  return field.type->to_python(field.value);
}

inline pybind11::dict dictionary_of(std::span<const Field> fields) {
  pybind11::dict values;
  for (const Field& field : fields) values[field.name] = python_value_of(field);
  return values;
}

/// Changes the values of fields. Throws ArgumentTypeError for an unknown name or a value of another
/// type, ArgumentError for an unknown word.
inline void change(std::span<const Field> fields, const pybind11::kwargs& changes) {
  namespace py = pybind11;
  std::size_t n_known = 0;
  for (const Field& field : fields) {
    if (!changes.contains(field.name)) continue;
    ++n_known;
    const py::object source = changes[field.name];
    if (field.type->read(source, field.value, field)) continue;
    throw ArgumentTypeError(field.name, std::string(field.name) + " must be " +
                                            field.type->words(false) + ", got " + shown(source));
  }
  if (n_known == changes.size()) return;
  const py::dict known = dictionary_of(fields);
  for (const auto& [name, value] : changes) {
    if (known.contains(name)) continue;
    const auto word = escaped_text_of(name);
    throw ArgumentTypeError(word, word + " is not a field: they are " +
                                      py::str(", ").attr("join")(known).cast<std::string>());
  }
}

/// Returns the configuration with other values of some fields. Throws ArgumentTypeError for an
/// unknown name or a value of another type, ArgumentError for a value out of its bounds.
template <class Config>
Config changed(Config config, const pybind11::kwargs& changes) {
  change(fields_of(config), changes);
  core::check_fields(config);
  return config;
}

/// Describes each field by (name, type hint, default, documentation, low, high, whether low itself
/// is excluded).
inline pybind11::tuple described_fields(std::span<const Field> fields) {
  pybind11::tuple described(fields.size());
  for (std::size_t i = 0; i < fields.size(); ++i) {
    const Field& field = fields[i];
    described[i] =
        pybind11::make_tuple(field.name, field.type->words(true), python_value_of(field), field.doc,
                             field.bounds.low, field.bounds.high, field.bounds.excludes_low);
  }
  return described;
}

/// Makes a docstring in numpydoc's form.
inline std::string docstring(const char* doc, std::span<const Field> fields) {
  std::string text = std::string(doc) + "\n\nParameters\n----------\n";
  for (const Field& field : fields) {
    std::string hint = field.type->words(true);
    if (hint.starts_with("typing.Literal[")) hint = '{' + hint.substr(15, hint.size() - 16) + '}';
    text += std::string(field.name) + " : " + hint + "\n    " + field.doc;
    if (field.type->has_bounds) {
      const std::string bounds = core::words_of(field.bounds, field.type->is_whole);
      if (bounds != "finite") text += " Must be " + bounds + '.';
    }
    text += '\n';
  }
  return text +
         "\nRaises\n------\nTypeError, ValueError\n    For a value of another type or out of its"
         " bounds; ``argument`` is its name.\n";
}

/// Lists all fields as a text such as "n_inputs=4, n_sets=9".
inline std::string listed(std::span<const Field> fields) {
  std::string values;
  for (const Field& field : fields) {
    values += (values.empty() ? "" : ", ") + std::string(field.name) + "=" +
              std::string(pybind11::repr(python_value_of(field)));
  }
  return values;
}

/// Binds a configuration as a frozen Python class, and returns the class.
template <class Config>
pybind11::class_<Config> bind_config(pybind11::module_& module, const char* name, const char* doc) {
  namespace py = pybind11;
  const Config defaults;
  const auto fields = fields_of(defaults);
  bindings::Class<Config> type(module, name, docstring(doc, fields).c_str());
  type.def(py::init([](const py::kwargs& values) { return changed(Config{}, values); }));
  for (std::size_t i = 0; i < fields.size(); ++i) {
    type.def_property_readonly(
        fields[i].name, [i](const Config& self) { return python_value_of(fields_of(self)[i]); },
        fields[i].doc);
  }
  type.attr("fields") = described_fields(fields);
  const auto replace = [](const Config& self, const py::kwargs& changes) {
    return changed(self, changes);
  };
  type.def("replace", replace, "Return a copy with other values of some fields.");
  type.def("__replace__", replace);
  type.def("__repr__", [](const py::object& self) {
    return py::cast<std::string>(py::type::of(self).attr("__name__")) + "(" +
           listed(fields_of(self.cast<const Config&>())) + ")";
  });
  type.def("__eq__", [](const Config& self, const py::object& other) {
    return py::isinstance<Config>(other) && self == other.cast<const Config&>();
  });
  type.def("__hash__", [](const Config& self) {
    return py::hash(py::tuple(dictionary_of(fields_of(self)).attr("values")()));
  });
  type.def("__reduce__", [](const py::object& self) {
    const auto values = dictionary_of(fields_of(self.cast<const Config&>()));
    const auto partial = py::module_::import("functools").attr("partial");
    return py::make_tuple(partial(py::type::of(self), **values), py::tuple());
  });
  return type;
}

}  // namespace sdnn::bindings
