#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <utility>

#include "arrays.hpp"
#include "bindings.hpp"
#include "sdnn/agents/fuzzy_q_learning.hpp"
#include "sdnn/agents/q_learning.hpp"
#include "sdnn/approximators/dynamic_sdnn_c.hpp"
#include "sdnn/approximators/fuzzy_rules.hpp"
#include "sdnn/approximators/rbf_network.hpp"

namespace py = pybind11;
using namespace sdnn;
using agents::QLearningConfig;
using approximators::DynamicSdnnC;
using bindings::ArrayArgument;
using agents::FuzzyQLearning;
using agents::FuzzyQLearningConfig;
using approximators::FuzzyRules;
using approximators::RbfNetwork;

namespace {

/// What all agents have in common.
template <class Agent>
void def_agent(py::class_<Agent> agent) {
  using Action = decltype(std::declval<Agent&>().act({}));
  agent.def("begin_episode", &Agent::begin_episode)
      .def("act",
           [](Agent& self, const ArrayArgument<double>& state, bool explore) {
             return self.act(bindings::vector(state, "state"), explore);
           },
           py::arg("state"), py::arg("explore") = true)
      .def("learn",
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
  const QLearningConfig defaults;
  const FuzzyQLearningConfig fuzzy;
  py::enum_<agents::TieRule>(module, "TieRule", "Which of several best actions is taken")
      .value("uniform", agents::TieRule::uniform)
      .value("lowest", agents::TieRule::lowest)
      .value("middle", agents::TieRule::middle);
  py::class_<agents::EpsilonGreedy>(module, "EpsilonGreedy", "The policy, over rows of values")
      .def(py::init([](double epsilon, int n_greedy_steps, agents::TieRule tie_rule,
                       std::uint64_t seed) {
             return agents::EpsilonGreedy({epsilon, n_greedy_steps, tie_rule}, seed);
           }),
           py::kw_only(), py::arg("epsilon") = defaults.policy.epsilon,
           py::arg("n_greedy_steps") = defaults.policy.n_greedy_steps,
           py::arg("tie_rule") = defaults.policy.tie_rule, py::arg("seed"))
      .def("select",
           [](agents::EpsilonGreedy& policy, const ArrayArgument<double>& values, int step,
              bool explore) {
             return policy.select(bindings::vector(values, "values"), step, explore);
           },
           py::arg("values"), py::arg("step"), py::arg("explore") = true);
  py::class_<QLearningConfig>(module, "QLearningConfig", "The parameters of Q-learning")
      .def(py::init([](double learning_rate, double discount, double epsilon, int n_greedy_steps,
                       agents::TieRule tie_rule) {
             return QLearningConfig{learning_rate, discount, {epsilon, n_greedy_steps, tie_rule}};
           }),
           py::kw_only(), py::arg("learning_rate") = defaults.learning_rate,
           py::arg("discount") = defaults.discount, py::arg("epsilon") = defaults.policy.epsilon,
           py::arg("n_greedy_steps") = defaults.policy.n_greedy_steps,
           py::arg("tie_rule") = defaults.policy.tie_rule)
      .def_readonly("learning_rate", &QLearningConfig::learning_rate)
      .def_readonly("discount", &QLearningConfig::discount)
      .def_property_readonly("epsilon",
                             [](const QLearningConfig& config) { return config.policy.epsilon; })
      .def_property_readonly(
          "n_greedy_steps",
          [](const QLearningConfig& config) { return config.policy.n_greedy_steps; })
      .def_property_readonly("tie_rule",
                             [](const QLearningConfig& config) { return config.policy.tie_rule; });

  py::class_<FuzzyQLearningConfig>(module, "FuzzyQLearningConfig",
                                   "The parameters of fuzzy Q-learning")
      .def(py::init([](double learning_coefficient, double discount, double trace_decay,
                       double epsilon, int n_greedy_steps, agents::TieRule tie_rule) {
             return FuzzyQLearningConfig{learning_coefficient, discount, trace_decay,
                                         {epsilon, n_greedy_steps, tie_rule}};
           }),
           py::kw_only(), py::arg("learning_coefficient") = fuzzy.learning_coefficient,
           py::arg("discount") = fuzzy.discount, py::arg("trace_decay") = fuzzy.trace_decay,
           py::arg("epsilon") = fuzzy.policy.epsilon,
           py::arg("n_greedy_steps") = fuzzy.policy.n_greedy_steps,
           py::arg("tie_rule") = fuzzy.policy.tie_rule)
      .def_readonly("learning_coefficient", &FuzzyQLearningConfig::learning_coefficient)
      .def_readonly("discount", &FuzzyQLearningConfig::discount)
      .def_readonly("trace_decay", &FuzzyQLearningConfig::trace_decay)
      .def_property_readonly(
          "epsilon", [](const FuzzyQLearningConfig& config) { return config.policy.epsilon; })
      .def_property_readonly(
          "n_greedy_steps",
          [](const FuzzyQLearningConfig& config) { return config.policy.n_greedy_steps; })
      .def_property_readonly(
          "tie_rule", [](const FuzzyQLearningConfig& config) { return config.policy.tie_rule; });

  using SdnnAgent = agents::QLearning<DynamicSdnnC>;
  def_agent(py::class_<SdnnAgent>(module, "SdnnQLearning", "Q-learning with SDNN-C")
                .def(py::init([](const approximators::SdnnCConfig& network,
                                 const QLearningConfig& learning, std::uint64_t seed) {
                       return SdnnAgent(DynamicSdnnC(network, seed), learning, seed);
                     }),
                     py::kw_only(), py::arg("network"), py::arg("learning"), py::arg("seed"))
                .def_property_readonly(
                    "network",
                    [](SdnnAgent& agent) -> DynamicSdnnC& { return agent.action_value(); },
                    py::return_value_policy::reference_internal));

  using RbfAgent = agents::QLearning<RbfNetwork>;
  def_agent(py::class_<RbfAgent>(module, "RbfQLearning", "Q-learning with an RBF network")
                .def(py::init([](const approximators::RbfNetworkConfig& network,
                                 const QLearningConfig& learning, std::uint64_t seed) {
                       return RbfAgent(RbfNetwork(network), learning, seed);
                     }),
                     py::kw_only(), py::arg("network"), py::arg("learning"), py::arg("seed"))
                .def_property_readonly(
                    "network", [](RbfAgent& agent) -> RbfNetwork& { return agent.action_value(); },
                    py::return_value_policy::reference_internal));

  def_agent(
      py::class_<FuzzyQLearning>(module, "FuzzyQLearning",
                                 "Fuzzy Q-learning; actions are numbers in [-1, 1]")
          .def(py::init([](const approximators::FuzzyRulesConfig& rules,
                           const FuzzyQLearningConfig& learning, std::uint64_t seed) {
                 return FuzzyQLearning(FuzzyRules(rules), learning, seed);
               }),
               py::kw_only(), py::arg("rules"), py::arg("learning"), py::arg("seed"))
          .def_property_readonly(
              "rules",
              [](FuzzyQLearning& agent) -> FuzzyRules& { return agent.rules(); },
              py::return_value_policy::reference_internal)
          .def("value",
               [](FuzzyQLearning& agent, const ArrayArgument<double>& state) {
                 return agent.value(bindings::vector(state, "state"));
               },
               py::arg("state"), "V(state)"));
}
