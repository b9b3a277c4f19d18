#include <pybind11/native_enum.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <chrono>
#include <string_view>
#include <vector>

#include "arrays.hpp"
#include "bindings.hpp"
#include "sdnn/core/detail/interruption.hpp"
#include "sdnn/core/elementary.hpp"
#include "sdnn/core/instruction_set.hpp"
#include "sdnn/core/random.hpp"

namespace py = pybind11;
using namespace sdnn;

namespace {

/// The thread in which Python handles signals.
unsigned long main_thread = 0;

/// Checks for signals in long computations, as Python itself does only between its instructions:
/// runs the handlers of signals that have arrived, and throws what a handler raises, such as
/// KeyboardInterrupt for Ctrl-C. Without `at_once` it does so at most every 50 ms, which is chosen.
void check_signals(bool at_once) {
  using Clock = std::chrono::steady_clock;
  constexpr std::chrono::milliseconds kInterval{50};
  thread_local Clock::time_point due{};
  if (PyThread_get_thread_ident() != main_thread) return;
  const Clock::time_point now = Clock::now();
  if (now < due && !at_once) return;
  due = now + kInterval;
  const py::gil_scoped_acquire locked;
  if (PyErr_CheckSignals() != 0) throw py::error_already_set();
}

void bind_interruption() {
  const auto thread = py::module_::import("threading").attr("main_thread")();
  main_thread = thread.attr("ident").cast<unsigned long>();
  core::interruption_check() = &check_signals;
}

void bind_instruction_set(py::module_& module) {
  module.def(
      "instruction_set", [] { return core::name_of(core::instruction_set()); },
      "The instruction set in use");
  module.def(
      "available_instruction_sets",
      [] {
        std::vector<std::string_view> names;
        for (const auto level : core::kInstructionSets) {
          if (core::offers(level)) names.push_back(core::name_of(level));
        }
        return names;
      },
      "The instruction sets that this machine offers, in rising order");
  module.def("set_instruction_set", &core::set_instruction_set, py::arg("name"),
             "Forces an instruction set, for the whole process");
}

void bind_random(py::module_& module) {
  py::native_enum<core::Stream>(module, "Stream", "enum.Enum", "What a random number is for")
      .value("code_books", core::Stream::code_books)
      .value("permutations", core::Stream::permutations)
      .value("weights", core::Stream::weights)
      .value("ties", core::Stream::ties)
      .value("exploration", core::Stream::exploration)
      .value("sensor_noise", core::Stream::sensor_noise)
      .value("evaluation_ties", core::Stream::evaluation_ties)
      .value("evaluation_sensor_noise", core::Stream::evaluation_sensor_noise)
      .finalize();
}

void bind_elementary(py::module_& module) {
  module.def(
      "sin_cos",
      [](const bindings::ArrayArgument<double>& x) {
        const auto in = bindings::flat(x);
        const std::vector<py::ssize_t> shape(x.shape(), x.shape() + x.ndim());
        py::array_t<double> sin(shape), cos(shape);
        double *sin_out = sin.mutable_data(), *cos_out = cos.mutable_data();
        for (std::size_t i = 0; i < in.size(); ++i) {
          const core::SinCos at = core::sin_cos(in[i]);
          sin_out[i] = at.sin;
          cos_out[i] = at.cos;
        }
        return py::make_tuple(sin, cos);
      },
      py::arg("x"), "(sin x, cos x), item by item");
  module.def("exp", py::vectorize([](double x) { return core::exp(x); }), py::arg("x"));
  module.def("log", py::vectorize([](double x) { return core::log(x); }), py::arg("x"));
  module.def("power", py::vectorize([](double x, double y) { return core::power(x, y); }),
             py::arg("base"), py::arg("exponent"));
  module.def("atan2", py::vectorize([](double y, double x) { return core::atan2(y, x); }),
             py::arg("y"), py::arg("x"));
  module.def("normal_quantile", py::vectorize([](double p) { return core::normal_quantile(p); }),
             py::arg("p"));
}

}  // namespace

void bind_core(py::module_& module) {
  bind_interruption();
  bind_instruction_set(module);
  bind_random(module);
  bind_elementary(module);
}
