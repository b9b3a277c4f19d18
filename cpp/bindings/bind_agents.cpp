#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <cstdint>
#include <utility>
#include <vector>

#include "arrays.hpp"
#include "bind_config.hpp"
#include "bindings.hpp"
#include "sdnn/agents/fuzzy_q_learning.hpp"
#include "sdnn/agents/presets.hpp"
#include "sdnn/agents/q_learning.hpp"
#include "sdnn/approximators/fuzzy_rules.hpp"
#include "sdnn/approximators/rbf_network.hpp"
#include "sdnn/approximators/sdnn_c.hpp"

namespace py = pybind11;
using namespace sdnn;
using agents::FuzzyQLearning;
using agents::FuzzyQLearningConfig;
using agents::QLearningConfig;
using approximators::FuzzyRules;
using approximators::FuzzyRulesConfig;
using approximators::RBFNetwork;
using approximators::RBFNetworkConfig;
using approximators::SDNNC;
using approximators::SDNNCConfig;
using bindings::ArrayArgument;

namespace {

/// What all agents have in common.
template <class Agent>
void def_agent(py::class_<Agent> agent) {
  using Action = decltype(std::declval<Agent&>().act({}));
  agent.def("begin_episode", &Agent::begin_episode)
      .def(
          "act",
          [](Agent& self, const ArrayArgument<double>& state, bool explore) {
            return self.act(bindings::vector(state, "state"), explore);
          },
          py::arg("state"), py::arg("explore") = true)
      .def(
          "learn",
          [](Agent& self, const ArrayArgument<double>& state, Action action, double reward,
             const ArrayArgument<double>& next_state, bool terminated) {
            self.learn(bindings::vector(state, "state"), action, reward,
                       bindings::vector(next_state, "next_state"), terminated);
          },
          py::arg("state"), py::arg("action"), py::arg("reward"), py::arg("next_state"),
          py::arg("terminated"));
}

/// Q-learning with an approximator that `make(approximator, seed)` makes of its configuration.
template <class Config, class Approximator, class Make>
void def_q_learning(py::class_<agents::QLearning<Approximator>> agent, Make make) {
  using Agent = agents::QLearning<Approximator>;
  agent
      .def(py::init([make](const Config& approximator, const QLearningConfig& learning,
                           std::uint64_t seed) {
             return Agent(make(approximator, seed), learning, seed);
           }),
           py::kw_only(), py::arg("approximator"), py::arg("learning"), py::arg("seed"))
      .def_property_readonly(
          "action_value", [](Agent& self) -> Approximator& { return self.action_value(); },
          py::return_value_policy::reference_internal);
  def_agent(agent);
}

}  // namespace

void bind_agents(py::module_& module) {
  py::enum_<agents::TieRule>(module, "TieRule", "Which of several best actions is taken")
      .value("uniform", agents::TieRule::uniform)
      .value("lowest", agents::TieRule::lowest)
      .value("middle", agents::TieRule::middle);
  bindings::bind_config<agents::EpsilonGreedyConfig>(module, "EpsilonGreedyConfig",
                                                     "The policy's parameters");
  py::class_<agents::EpsilonGreedy>(module, "EpsilonGreedy", "The policy, over rows of values")
      .def(py::init<const agents::EpsilonGreedyConfig&, std::uint64_t>(), py::arg("config"),
           py::arg("seed"))
      .def(
          "select",
          [](agents::EpsilonGreedy& policy, const ArrayArgument<double>& values, int step,
             bool explore) {
            return policy.select(bindings::vector(values, "values"), step, explore);
          },
          py::arg("values"), py::arg("step"), py::arg("explore") = true);
  bindings::bind_config<QLearningConfig>(module, "QLearningConfig", "The parameters of Q-learning");
  bindings::bind_config<FuzzyQLearningConfig>(module, "FuzzyQLearningConfig",
                                              "The parameters of fuzzy Q-learning");

  const auto parts = [](agents::Preset preset) {
    return std::pair(std::move(preset.approximator), preset.learning);
  };
  module.def(
      "paper_preset", [parts](int n_inputs) { return parts(agents::paper_preset(n_inputs)); },
      py::arg("n_inputs"), "Settings of approximator and learning, as in the paper");
  module.def(
      "robust_preset", [parts](int n_inputs) { return parts(agents::robust_preset(n_inputs)); },
      py::arg("n_inputs"), "Settings of approximator and learning, as recommended");

  using SDNNAgent = agents::QLearning<SDNNC>;
  py::class_<SDNNAgent> sdnn_agent(module, "SDNNQLearning", "Q-learning with SDNN-C");
  def_q_learning<SDNNCConfig>(sdnn_agent, [](const SDNNCConfig& config, std::uint64_t seed) {
    return SDNNC(config, seed);
  });
  sdnn_agent.def(
      py::init([](const SDNNCConfig& approximator, const QLearningConfig& learning,
                  std::uint64_t seed, const std::vector<ArrayArgument<std::int8_t>>& tables) {
        return SDNNAgent(SDNNC(approximator, bindings::tables_of(tables), seed), learning, seed);
      }),
      py::kw_only(), py::arg("approximator"), py::arg("learning"), py::arg("seed"),
      py::arg("tables"), "With the patterns of each input: (n_bins, m) of -1, +1");
  def_q_learning<RBFNetworkConfig>(
      py::class_<agents::QLearning<RBFNetwork>>(module, "RBFQLearning",
                                                "Q-learning with an RBF network"),
      [](const RBFNetworkConfig& config, std::uint64_t) { return RBFNetwork(config); });
  def_agent(py::class_<FuzzyQLearning>(module, "FuzzyQLearning",
                                       "Fuzzy Q-learning; actions are numbers in [-1, 1]")
                .def(py::init([](const FuzzyRulesConfig& approximator,
                                 const FuzzyQLearningConfig& learning, std::uint64_t seed) {
                       return FuzzyQLearning(FuzzyRules(approximator), learning, seed);
                     }),
                     py::kw_only(), py::arg("approximator"), py::arg("learning"), py::arg("seed"))
                .def_property_readonly(
                    "rules", [](FuzzyQLearning& agent) -> FuzzyRules& { return agent.rules(); },
                    py::return_value_policy::reference_internal)
                .def(
                    "value",
                    [](FuzzyQLearning& agent, const ArrayArgument<double>& state) {
                      return agent.value(bindings::vector(state, "state"));
                    },
                    py::arg("state"), "V(state)"));
}
