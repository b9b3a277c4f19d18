// The extension module, which binds one package after the other, from the lowest layer up.
#include <pybind11/pybind11.h>

#include <exception>
#include <string>

#include "bind_config.hpp"
#include "bindings.hpp"

namespace {

/// Returns the name and version of the compiler.
std::string compiler() {
#if defined(_MSC_VER)
  return "MSVC " + std::to_string(_MSC_FULL_VER);
#elif defined(__clang__)
  return __VERSION__;  // begins with its name
#else
  return std::string("GCC ").append(__VERSION__);
#endif
}

/// Raises a Python error of this type whose attribute `argument` names the bad argument.
void set_error(PyObject* kind, const auto& error) {
  namespace py = pybind11;
  py::object raised = py::handle(kind)(error.what());
  raised.attr("argument") = error.name();
  PyErr_SetObject(kind, raised.ptr());
}

/// Translates errors about an argument into Python's, with the argument's name as the attribute
/// `argument`.
void translate(std::exception_ptr error) {
  if (!error) return;
  try {
    std::rethrow_exception(error);
  } catch (const sdnn::bindings::ArgumentTypeError& e) {
    set_error(PyExc_TypeError, e);
  } catch (const sdnn::core::ArgumentError& e) {
    set_error(PyExc_ValueError, e);
  } catch (const sdnn::core::SizeError& e) {
    set_error(PyExc_ValueError, e);
  }
}

}  // namespace

// The module does not declare mod_gil_not_used, because objects.hpp relies on the GIL.
PYBIND11_MODULE(_core, module) {
  module.doc() = "The compiled core of sdnn; use it through the packages above it.";
  module.attr("__version__") = SDNN_VERSION;
  module.attr("compiler") = compiler();
  pybind11::register_exception_translator(&translate);
  sdnn::bindings::refuse_pickling();
  bind_core(module);
  bind_coding(module);
  bind_approximators(module);
  bind_environments(module);
  bind_estimators(module);
  bind_experts(module);
  bind_agents(module);
  bind_controller(module);
  bind_tools(module);
}
