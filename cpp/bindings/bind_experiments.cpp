#include <pybind11/numpy.h>
#include <pybind11/typing.h>

#include "bindings.hpp"
#include "sdnn/approximators/dynamic_sdnn_c.hpp"
#include "sdnn/experiments/trial.hpp"

namespace py = pybind11;
using namespace sdnn;
using approximators::DynamicSdnnC;
using experiments::ProtocolConfig;
using Trial = experiments::AcrobotTrial<DynamicSdnnC>;

namespace {

template <class Value, class Read>
py::array_t<Value> column(const Trial& trial, Read read) {
  py::array_t<Value> out(static_cast<py::ssize_t>(trial.rows().size()));
  Value* item = out.mutable_data();
  for (const auto& row : trial.rows()) *item++ = read(row);
  return out;
}

py::typing::Dict<py::str, py::array> test_rows(const Trial& trial) {
  using experiments::TestRow;
  py::typing::Dict<py::str, py::array> rows;
  rows["episode"] = column<std::int32_t>(trial, [](const TestRow& row) { return row.episode; });
  rows["steps"] = column<std::int32_t>(trial, [](const TestRow& row) { return row.steps; });
  rows["episode_return"] =
      column<double>(trial, [](const TestRow& row) { return row.episode_return; });
  rows["solved"] = column<bool>(trial, [](const TestRow& row) { return row.solved; });
  return rows;
}

py::dict memory_counts(const Trial& trial) {
  return trial.agent().action_value().visit([](const auto& network) {
    const auto& counts = network.memory().counts();
    py::dict out;
    out["full"] = counts.full;
    out["neighbour"] = counts.neighbour;
    out["columns"] = counts.columns;
    return out;
  });
}

}  // namespace

void bind_experiments(py::module_& module) {
  const ProtocolConfig defaults;
  py::class_<ProtocolConfig>(module, "ProtocolConfig", "How long a trial is")
      .def(py::init([](int n_learning_episodes, int test_interval) {
             return ProtocolConfig{n_learning_episodes, test_interval};
           }),
           py::kw_only(), py::arg("n_learning_episodes") = defaults.n_learning_episodes,
           py::arg("test_interval") = defaults.test_interval)
      .def_readonly("n_learning_episodes", &ProtocolConfig::n_learning_episodes)
      .def_readonly("test_interval", &ProtocolConfig::test_interval);

  py::class_<Trial>(module, "AcrobotTrial", "SDNN-C learns the acrobot swing-up")
      .def(py::init([](const approximators::SdnnCConfig& network,
                       const agents::QLearningConfig& learning,
                       const environments::AcrobotConfig& acrobot,
                       const environments::GoalScheduleConfig& goal,
                       const environments::SensorConfig& sensors, const ProtocolConfig& protocol,
                       std::uint64_t seed) {
             return Trial(
                 agents::QLearning<DynamicSdnnC>(DynamicSdnnC(network, seed), learning, seed),
                 acrobot, goal, sensors, protocol, seed);
           }),
           py::kw_only(), py::arg("network"), py::arg("learning"), py::arg("acrobot"),
           py::arg("goal"), py::arg("sensors"), py::arg("protocol"), py::arg("seed"))
      .def_property_readonly("episode", &Trial::episode)
      .def_property_readonly("finished", &Trial::finished)
      .def_property_readonly("n_decisions", &Trial::n_decisions)
      .def("advance", [](Trial& trial, int n_episodes) { trial.advance(n_episodes); },
           py::arg("n_episodes"), py::call_guard<py::gil_scoped_release>(),
           "Runs up to n more learning episodes")
      .def("memory_counts", &memory_counts,
           "How potentials came about so far: full passes, derived from neighbours, columns added")
      .def("test_rows", &test_rows, "Columns of the test episodes so far");
}
