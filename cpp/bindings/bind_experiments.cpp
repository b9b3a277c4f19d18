#include <pybind11/numpy.h>
#include <pybind11/typing.h>

#include "bind_config.hpp"
#include "bindings.hpp"
#include "sdnn/agents/fuzzy_q_learning.hpp"
#include "sdnn/agents/q_learning.hpp"
#include "sdnn/approximators/fuzzy_rules.hpp"
#include "sdnn/approximators/rbf_network.hpp"
#include "sdnn/approximators/sdnn_c.hpp"
#include "sdnn/experiments/trial.hpp"

namespace py = pybind11;
using namespace sdnn;
using agents::FuzzyQLearning;
using agents::QLearning;
using approximators::FuzzyRules;
using approximators::RBFNetwork;
using approximators::SDNNC;
using environments::AcrobotConfig;
using environments::GoalScheduleConfig;
using environments::SensorConfig;
using experiments::ProtocolConfig;

namespace {

template <class Value, class Trial, class Read>
py::array_t<Value> column(const Trial& trial, Read read) {
  py::array_t<Value> out(static_cast<py::ssize_t>(trial.rows().size()));
  Value* item = out.mutable_data();
  for (const auto& row : trial.rows()) *item++ = read(row);
  return out;
}

template <class Trial>
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

using SDNNTrial = experiments::AcrobotTrial<QLearning<SDNNC>>;

py::typing::Dict<py::str, py::int_> memory_counts(const SDNNTrial& trial) {
  const auto& counts = trial.agent().action_value().memory().counts();
  py::typing::Dict<py::str, py::int_> out;
  out["full"] = counts.full;
  out["neighbour"] = counts.neighbour;
  out["columns"] = counts.columns;
  return out;
}

/// What the trials of all agents have in common.
template <class Trial>
void def_trial(py::class_<Trial> trial) {
  trial.def_property_readonly("episode", &Trial::episode)
      .def_property_readonly("finished", &Trial::finished)
      .def_property_readonly("n_decisions", &Trial::n_decisions)
      .def(
          "advance", [](Trial& self, int n_episodes) { self.advance(n_episodes); },
          py::arg("n_episodes"), py::call_guard<py::gil_scoped_release>(),
          "Runs up to n more learning episodes")
      .def("test_rows", &test_rows<Trial>, "Columns of the test episodes so far");
}

}  // namespace

void bind_experiments(py::module_& module) {
  bindings::bind_config<ProtocolConfig>(module, "ProtocolConfig", "How long a trial is");

  def_trial(
      py::class_<SDNNTrial>(module, "AcrobotTrial", "SDNN-C learns the acrobot swing-up")
          .def(py::init([](const approximators::SDNNCConfig& approximator,
                           const agents::QLearningConfig& learning, const AcrobotConfig& acrobot,
                           const GoalScheduleConfig& goal, const SensorConfig& sensors,
                           const ProtocolConfig& protocol, std::uint64_t seed) {
                 return SDNNTrial({SDNNC(approximator, seed), learning, seed}, acrobot, goal,
                                  sensors, protocol, seed);
               }),
               py::kw_only(), py::arg("approximator"), py::arg("learning"), py::arg("acrobot"),
               py::arg("goal"), py::arg("sensors"), py::arg("protocol"), py::arg("seed"))
          .def("memory_counts", &memory_counts,
               "How potentials came about so far: full passes, from neighbours, columns added"));

  using FuzzyTrial = experiments::AcrobotTrial<FuzzyQLearning>;
  def_trial(py::class_<FuzzyTrial>(module, "FuzzyAcrobotTrial",
                                   "Fuzzy Q-learning learns the acrobot swing-up")
                .def(py::init([](const approximators::FuzzyRulesConfig& approximator,
                                 const agents::FuzzyQLearningConfig& learning,
                                 const AcrobotConfig& acrobot, const GoalScheduleConfig& goal,
                                 const SensorConfig& sensors, const ProtocolConfig& protocol,
                                 std::uint64_t seed) {
                       return FuzzyTrial({FuzzyRules(approximator), learning, seed}, acrobot, goal,
                                         sensors, protocol, seed);
                     }),
                     py::kw_only(), py::arg("approximator"), py::arg("learning"),
                     py::arg("acrobot"), py::arg("goal"), py::arg("sensors"), py::arg("protocol"),
                     py::arg("seed")));

  using RBFTrial = experiments::AcrobotTrial<QLearning<RBFNetwork>>;
  def_trial(
      py::class_<RBFTrial>(module, "RBFAcrobotTrial",
                           "Q-learning with an RBF network learns the acrobot swing-up")
          .def(py::init([](const approximators::RBFNetworkConfig& approximator,
                           const agents::QLearningConfig& learning, const AcrobotConfig& acrobot,
                           const GoalScheduleConfig& goal, const SensorConfig& sensors,
                           const ProtocolConfig& protocol, std::uint64_t seed) {
                 return RBFTrial({RBFNetwork(approximator), learning, seed}, acrobot, goal, sensors,
                                 protocol, seed);
               }),
               py::kw_only(), py::arg("approximator"), py::arg("learning"), py::arg("acrobot"),
               py::arg("goal"), py::arg("sensors"), py::arg("protocol"), py::arg("seed")));
}
