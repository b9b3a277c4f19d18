// The extension's table of contents: one line per room, floor by floor.
#include "bindings.hpp"

PYBIND11_MODULE(_core, module) {
  module.doc() = "The compiled core of sdnn; use it through the package's rooms.";
  module.attr("__version__") = SDNN_VERSION;
  bind_core(module);
  bind_coding(module);
  bind_approximators(module);
  bind_environments(module);
  bind_estimators(module);
  bind_agents(module);
  bind_experiments(module);
  bind_benchmarks(module);
}
