/// A configuration's Python class, from the list of its fields.
#pragma once

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <string>
#include <tuple>

#include "objects.hpp"
#include "sdnn/core/config_fields.hpp"

namespace sdnn::bindings {

template <class Config, class... Field>
void def_fields(pybind11::class_<Config>& type, const Field&... field) {
  namespace py = pybind11;
  const Config defaults;
  type.def(py::init([field...](const core::FieldValue<Field, Config>&... value) {
             Config config;
             ((field.of(config) = value), ...);
             return config;
           }),
           py::kw_only(), (py::arg(field.name) = field.of(defaults))...);
  (type.def_property_readonly(field.name, [field](const Config& self) { return field.of(self); }),
   ...);
  type.def("__repr__", [field...](const py::object& self) {
    const auto& config = self.cast<const Config&>();
    std::string text;
    ((text += (text.empty() ? "" : ", ") + std::string(field.name) + "=" +
              std::string(py::repr(py::cast(field.of(config))))),
     ...);
    return py::cast<std::string>(py::type::of(self).attr("__name__")) + "(" + text + ")";
  });
}

/// Binds a configuration: keyword arguments with the core's defaults, properties, ==, repr.
template <class Config>
pybind11::class_<Config> bind_config(pybind11::module_& module, const char* name, const char* doc) {
  pybind11::class_<Config> type(module, name, doc);
  std::apply([&type](const auto&... field) { def_fields(type, field...); }, Config::fields());
  type.def("__eq__", [](const Config& self, const pybind11::object& other) {
    return pybind11::isinstance<Config>(other) && self == other.cast<const Config&>();
  });
  return type;
}

}  // namespace sdnn::bindings
