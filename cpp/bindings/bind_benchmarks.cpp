#include <pybind11/pybind11.h>

#include "bindings.hpp"
#include "sdnn/agents/q_learning.hpp"
#include "sdnn/approximators/sdnn_c.hpp"
#include "sdnn/benchmarks/decisions.hpp"
#include "sdnn/benchmarks/network_parts.hpp"
#include "sdnn/benchmarks/yardsticks.hpp"
#include "sdnn/experiments/trial.hpp"
#include "times.hpp"

namespace py = pybind11;
using namespace sdnn;
using benchmarks::AcrobotDecisions;
using benchmarks::BufferRead;
using benchmarks::DenseProduct;
using benchmarks::NetworkParts;
using bindings::times_of;
using Trial = experiments::AcrobotTrial<agents::QLearning<approximators::SDNNC>>;

void bind_benchmarks(py::module_& module) {
  py::class_<BufferRead>(module, "BufferRead", "Reads a buffer from front to back")
      .def(py::init<std::size_t>(), py::arg("n_bytes"))
      .def_property_readonly("n_bytes", &BufferRead::n_bytes)
      .def(
          "run",
          [](const BufferRead& buffer, int n) {
            return times_of(buffer, [&] { return buffer.run(n); });
          },
          py::arg("n_repetitions"), "Nanoseconds per reading: (n_repetitions,)");
  py::class_<DenseProduct>(module, "DenseProduct", "A dense float32 matrix-vector product")
      .def(py::init<std::size_t, std::size_t, std::uint64_t>(), py::arg("n_rows"),
           py::arg("n_columns"), py::arg("seed"))
      .def(
          "run",
          [](DenseProduct& product, int n) {
            return times_of(product, [&] { return product.run(n); });
          },
          py::arg("n_repetitions"), "Nanoseconds per product: (n_repetitions,)");
  py::class_<NetworkParts>(module, "NetworkParts", "The network's parts of a decision")
      .def(py::init([](const Trial& trial, std::uint64_t seed) {
             return NetworkParts(trial.agent().action_value(), seed);
           }),
           py::arg("trial"), py::arg("seed"), "Times a copy of the trial's network")
      .def(py::init<approximators::SDNNC, std::uint64_t>(), py::arg("network"), py::arg("seed"),
           "Times a copy of the network")
      .def(
          "time_values",
          [](NetworkParts& parts, int n) {
            return times_of(parts, [&] { return parts.time_values(n); });
          },
          py::arg("n_repetitions"), "All values at a new state: nanoseconds (n_repetitions,)")
      .def(
          "time_remembered_values",
          [](NetworkParts& parts, int n) {
            return times_of(parts, [&] { return parts.time_remembered_values(n); });
          },
          py::arg("n_repetitions"), "All values at the same state again")
      .def(
          "time_corrections",
          [](NetworkParts& parts, int n, int n_corrected) {
            return times_of(parts, [&] { return parts.time_corrections(n, n_corrected); });
          },
          py::arg("n_repetitions"), py::arg("n_corrected"), "Learning steps")
      .def(
          "time_selections",
          [](NetworkParts& parts, int n, int n_selections, int n_selected) {
            return times_of(parts,
                            [&] { return parts.time_selections(n, n_selections, n_selected); });
          },
          py::arg("n_repetitions"), py::arg("n_selections"), py::arg("n_selected"),
          "n_selections selections of units per repetition")
      .def_property_readonly("weight_bytes", &NetworkParts::weight_bytes)
      .def("mean_bytes_of_pass", &NetworkParts::mean_bytes_of_pass, py::arg("n_states"));
  py::class_<AcrobotDecisions>(module, "AcrobotDecisions", "The acrobot under random torques")
      .def(py::init<const environments::AcrobotConfig&, std::uint64_t>(), py::arg("config"),
           py::arg("seed"))
      .def_property_readonly("n_integration_steps", &AcrobotDecisions::n_integration_steps)
      .def(
          "run",
          [](AcrobotDecisions& acrobot, int n) {
            return times_of(acrobot, [&] { return acrobot.run(n); });
          },
          py::arg("n_repetitions"), "Nanoseconds per decision: (n_repetitions,)");
  module.def(
      "time_decisions",
      [](Trial& trial, int n_episodes) {
        return times_of(trial, [&] { return benchmarks::time_decisions(trial, n_episodes); });
      },
      py::arg("trial"), py::arg("n_episodes"),
      "Advances a trial; nanoseconds of every decision in it");
}
