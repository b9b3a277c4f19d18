#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <utility>

#include "arrays.hpp"
#include "bind_config.hpp"
#include "bindings.hpp"
#include "sdnn/agents/fuzzy_q_learning.hpp"
#include "sdnn/agents/q_learning.hpp"
#include "sdnn/approximators/dynamic_sdnn_c.hpp"
#include "sdnn/approximators/fuzzy_rules.hpp"
#include "sdnn/approximators/rbf_network.hpp"

namespace py = pybind11;
using namespace sdnn;
using agents::FuzzyQLearning;
using agents::FuzzyQLearningConfig;
using agents::QLearningConfig;
using approximators::DynamicSDNNC;
using approximators::FuzzyRules;
using approximators::RBFNetwork;
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

  bindings::bind_config<FuzzyQLearningConfig>(module, "FuzzyQLearningConfig", "The parameters of fuzzy Q-learning");

  using SDNNAgent = agents::QLearning<DynamicSDNNC>;
  def_agent(py::class_<SDNNAgent>(module, "SDNNQLearning", "Q-learning with SDNN-C")
                .def(py::init([](const approximators::SDNNCConfig& network,
                                 const QLearningConfig& learning, std::uint64_t seed) {
                       return SDNNAgent(DynamicSDNNC(network, seed), learning, seed);
                     }),
                     py::kw_only(), py::arg("network"), py::arg("learning"), py::arg("seed"))
                .def_property_readonly(
                    "network",
                    [](SDNNAgent& agent) -> DynamicSDNNC& { return agent.action_value(); },
                    py::return_value_policy::reference_internal));

  using RBFAgent = agents::QLearning<RBFNetwork>;
  def_agent(py::class_<RBFAgent>(module, "RBFQLearning", "Q-learning with an RBF network")
                .def(py::init([](const approximators::RBFNetworkConfig& network,
                                 const QLearningConfig& learning, std::uint64_t seed) {
                       return RBFAgent(RBFNetwork(network), learning, seed);
                     }),
                     py::kw_only(), py::arg("network"), py::arg("learning"), py::arg("seed"))
                .def_property_readonly(
                    "network", [](RBFAgent& agent) -> RBFNetwork& { return agent.action_value(); },
                    py::return_value_policy::reference_internal));

  def_agent(py::class_<FuzzyQLearning>(module, "FuzzyQLearning",
                                       "Fuzzy Q-learning; actions are numbers in [-1, 1]")
                .def(py::init([](const approximators::FuzzyRulesConfig& rules,
                                 const FuzzyQLearningConfig& learning, std::uint64_t seed) {
                       return FuzzyQLearning(FuzzyRules(rules), learning, seed);
                     }),
                     py::kw_only(), py::arg("rules"), py::arg("learning"), py::arg("seed"))
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
