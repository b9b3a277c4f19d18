#include <pybind11/pybind11.h>

#include "bindings.hpp"
#include "sdnn/core/instruction_set.hpp"

namespace py = pybind11;
using namespace sdnn;

void bind_core(py::module_& module) {
  module.def(
      "instruction_set", [] { return core::name_of(core::instruction_set()); },
      "The instruction set in use");
  module.def(
      "best_instruction_set", [] { return core::name_of(core::best_instruction_set()); },
      "The best instruction set that this machine offers");
  module.def("set_instruction_set", &core::set_instruction_set, py::arg("name"),
             "Forces an instruction set, for the whole process");
}
