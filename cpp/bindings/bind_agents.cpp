#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include "arrays.hpp"
#include "bindings.hpp"
#include "sdnn/agents/q_learning.hpp"
#include "sdnn/approximators/dynamic_sdnn_c.hpp"

namespace py = pybind11;
using namespace sdnn;
using agents::QLearningConfig;
using approximators::DynamicSdnnC;
using bindings::ArrayArgument;
using Agent = agents::QLearning<DynamicSdnnC>;

void bind_agents(py::module_& module) {
  const QLearningConfig defaults;
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

  py::class_<Agent>(module, "SdnnQLearning", "Q-learning with SDNN-C")
      .def(py::init([](const approximators::SdnnCConfig& network, const QLearningConfig& learning,
                       std::uint64_t seed) {
             return Agent(DynamicSdnnC(network, seed), learning, seed);
           }),
           py::kw_only(), py::arg("network"), py::arg("learning"), py::arg("seed"))
      .def_property_readonly(
          "network", [](Agent& agent) -> DynamicSdnnC& { return agent.action_value(); },
          py::return_value_policy::reference_internal)
      .def("begin_episode", &Agent::begin_episode)
      .def("act",
           [](Agent& agent, const ArrayArgument<double>& state, bool explore) {
             return agent.act(bindings::vector(state, "state"), explore);
           },
           py::arg("state"), py::arg("explore") = true)
      .def("learn",
           [](Agent& agent, const ArrayArgument<double>& state, std::size_t action, double reward,
              const ArrayArgument<double>& next_state, bool terminated) {
             agent.learn(bindings::vector(state, "state"), action, reward,
                         bindings::vector(next_state, "next_state"), terminated);
           },
           py::arg("state"), py::arg("action"), py::arg("reward"), py::arg("next_state"),
           py::arg("terminated"));
}
