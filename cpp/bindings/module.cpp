// The extension's table of contents: one line per room, floor by floor.
#include <string>

#include "bindings.hpp"

namespace {

/// What compiled the extension.
std::string compiler() {
#if defined(_MSC_VER)
  return "MSVC " + std::to_string(_MSC_FULL_VER);
#elif defined(__clang__)
  return __VERSION__;  // begins with its name
#else
  return std::string("GCC ").append(__VERSION__);
#endif
}

}  // namespace

PYBIND11_MODULE(_core, module) {
  module.doc() = "The compiled core of sdnn; use it through the package's rooms.";
  module.attr("__version__") = SDNN_VERSION;
  module.attr("compiler") = compiler();
  sdnn::bindings::refuse_bare_objects();
  bind_core(module);
  bind_coding(module);
  bind_approximators(module);
  bind_environments(module);
  bind_estimators(module);
  bind_agents(module);
  bind_experiments(module);
  bind_benchmarks(module);
}
