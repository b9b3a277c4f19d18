#include <pybind11/functional.h>
#include <pybind11/numpy.h>
#include <pybind11/stl.h>
#include <pybind11/typing.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "arrays.hpp"
#include "bind_config.hpp"
#include "bindings.hpp"
#include "sdnn/agents/controller.hpp"
#include "sdnn/agents/fixed_rate.hpp"
#include "sdnn/agents/fuzzy_q_learning.hpp"
#include "sdnn/agents/observation_scale.hpp"
#include "sdnn/agents/presets.hpp"
#include "sdnn/agents/q_lambda.hpp"
#include "sdnn/agents/q_learning.hpp"
#include "sdnn/agents/vector_fuzzy_q_learning.hpp"
#include "sdnn/approximators/decoupled.hpp"
#include "sdnn/approximators/fuzzy_rules.hpp"
#include "sdnn/approximators/linear_sdnn.hpp"
#include "sdnn/approximators/rbf_network.hpp"
#include "sdnn/approximators/sdnn_c.hpp"
#include "states.hpp"
#include "workspaces.hpp"

namespace py = pybind11;
using namespace sdnn;
using agents::FuzzyQLearning;
using agents::FuzzyQLearningConfig;
using agents::QLambda;
using agents::QLambdaConfig;
using agents::QLearningConfig;
using agents::VectorFuzzyQLearning;
using approximators::FuzzyRules;
using approximators::FuzzyRulesConfig;
using approximators::LinearSDNN;
using approximators::LinearSDNNConfig;
using approximators::RBFNetwork;
using approximators::RBFNetworkConfig;
using approximators::SDNNC;
using approximators::SDNNCConfig;
using bindings::ArrayArgument;

namespace {

/// Binds the members that all agents have.
template <class Agent>
void def_agent(py::class_<Agent>& agent) {
  using Action = decltype(std::declval<Agent&>().act({}));
  agent
      .def(
          "set_n_environments",
          [](Agent& self, std::size_t n) {
            bindings::wait_for_readers(self);
            self.set_n_environments(n);
          },
          py::arg("n"))
      .def_property_readonly("n_environments", &Agent::n_environments)
      .def(
          "begin_episode",
          [](Agent& self, std::size_t environment) {
            bindings::wait_for_readers(self);
            self.begin_episode(environment);
          },
          py::arg("environment") = 0)
      .def(
          "act",
          [](Agent& self, const ArrayArgument<double>& state, bool explore,
             std::size_t environment) {
            return self.act(bindings::vector(state, "state"), explore, environment);
          },
          py::arg("state"), py::arg("explore") = true, py::arg("environment") = 0)
      .def(
          "learn",
          [](Agent& self, const ArrayArgument<double>& state, const Action& action, double reward,
             const ArrayArgument<double>& next_state, bool terminated, std::size_t environment) {
            bindings::wait_for_readers(self);
            self.learn(bindings::vector(state, "state"), action, reward,
                       bindings::vector(next_state, "next_state"), terminated, environment);
          },
          py::arg("state"), py::arg("action"), py::arg("reward"), py::arg("next_state"),
          py::arg("terminated"), py::arg("environment") = 0);
  bindings::def_state(agent);
}

/// The approximator of a dimension of the action. Throws std::invalid_argument if there is none.
template <class Agent>
auto& approximator_of(Agent& agent, std::size_t dimension) {
  core::require(dimension < agent.n_dimensions(), "dimension",
                "less than " + std::to_string(agent.n_dimensions()), dimension);
  if constexpr (std::remove_const_t<Agent>::kDecoupled) {
    return agent.action_value().part(dimension);
  } else {
    return agent.action_value();
  }
}

/// Values of all actions of a dimension, by which greedy actions are chosen. Other threads run
/// meanwhile, and may read the same agent.
template <class Agent>
py::array_t<double> q_values(const Agent& agent, const ArrayArgument<double>& state,
                             std::size_t dimension) {
  const auto& network = approximator_of(agent, dimension);
  const auto at = bindings::copied(bindings::vector(state, "state"));
  py::array_t<double> out(static_cast<py::ssize_t>(network.n_actions()));
  const std::span row(out.mutable_data(), network.n_actions());
  const bindings::WithoutGIL unlocked(agent, network);
  auto& workspace = bindings::workspace_of(network);
  if constexpr (requires { network.averaged_values(at, workspace, row); }) {
    network.averaged_values(at, workspace, row);
  } else {
    network.values(at, workspace, row);
  }
  return out;
}

/// Binds the members of agents that learn by Q-learning.
template <class Agent, class QValues>
void def_q_learning(py::class_<Agent>& agent, const QValues& q_values) {
  agent.def("set_progress", &Agent::set_progress, py::arg("progress"))
      .def("set_learning_rate", &Agent::set_learning_rate, py::arg("rate"))
      .def("set_epsilon", &Agent::set_epsilon, py::arg("epsilon"))
      .def_property_readonly("progress", &Agent::progress)
      .def_property_readonly("learning_rate", &Agent::learning_rate)
      .def_property_readonly("epsilon", &Agent::epsilon)
      .def("q_values", q_values, py::arg("state"), py::arg("dimension") = 0,
           "Q(state, a) of a dimension's actions, as greedy actions follow it; shapes (n_inputs,) "
           "-> "
           "(n_actions,)");
  def_agent(agent);
}

py::array_t<double> q_values_of_readout(const QLambda& agent, const ArrayArgument<double>& state,
                                        std::size_t dimension) {
  const LinearSDNN& readout = agent.action_value();
  core::require(dimension < readout.n_dimensions(), "dimension",
                "less than " + std::to_string(readout.n_dimensions()), dimension);
  const auto at = bindings::copied(bindings::vector(state, "state"));
  py::array_t<double> out(static_cast<py::ssize_t>(readout.n_actions(dimension)));
  const std::span row(out.mutable_data(), readout.n_actions(dimension));
  const bindings::WithoutGIL unlocked(agent, readout);
  readout.values(at, bindings::workspace_of(readout), row, dimension, true);
  return out;
}

/// Binds the members of agents that learn by fuzzy rules.
template <class Agent>
void def_fuzzy(py::class_<Agent>& agent) {
  agent.def("last_action", &Agent::last_action, py::arg("environment") = 0)
      .def(
          "value",
          [](const Agent& self, const ArrayArgument<double>& state) {
            const auto at = bindings::copied(bindings::vector(state, "state"));
            const bindings::WithoutGIL unlocked(self);
            auto workspace = self.workspace();
            return self.value(at, workspace);
          },
          py::arg("state"), "V(state)");
  def_agent(agent);
}

/// Binds Q-learning with an approximator.
template <class Config, class Approximator, class Make>
py::class_<agents::QLearning<Approximator>> bind_q_learning(py::module_& module, const char* name,
                                                            const char* doc, const Make& make) {
  using Agent = agents::QLearning<Approximator>;
  py::class_<Agent> agent(module, name, doc);
  agent
      .def(py::init([make](const Config& approximator, const QLearningConfig& learning,
                           std::uint64_t seed) {
             return Agent(make(approximator, seed), learning, seed);
           }),
           py::kw_only(), py::arg("approximator"), py::arg("learning"), py::arg("seed"))
      .def_property_readonly(
          "action_value", [](Agent& self) -> Approximator& { return self.action_value(); },
          py::return_value_policy::reference_internal);
  def_q_learning(agent, &q_values<Agent>);
  return agent;
}

/// Binds Q-learning with an approximator for each dimension of the action.
template <class Config, class Approximator, class Make>
void bind_decoupled_q_learning(py::module_& module, const char* name, const char* doc,
                               const Make& make) {
  using Agent = agents::QLearning<approximators::Decoupled<Approximator>>;
  py::class_<Agent> agent(module, name, doc);
  agent
      .def(py::init([make](const Config& approximator, const std::vector<int>& n_actions,
                           const QLearningConfig& learning, std::uint64_t seed) {
             return Agent(approximators::make_decoupled(approximator, n_actions, seed, make),
                          learning, seed);
           }),
           py::kw_only(), py::arg("approximator"), py::arg("n_actions"), py::arg("learning"),
           py::arg("seed"))
      .def(
          "action_value",
          [](Agent& self, std::size_t dimension) -> Approximator& {
            return approximator_of(self, dimension);
          },
          py::arg("dimension"), py::return_value_policy::reference_internal);
  def_q_learning(agent, &q_values<Agent>);
}

}  // namespace

void bind_agents(py::module_& module) {
  bindings::bind_config<agents::EpsilonGreedyConfig>(
      module, "EpsilonGreedyConfig",
      "The parameters of the policy; the defaults are the paper's (section 4.2).");
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
  const auto def_schedule = []<class Config>(py::class_<Config> config) {
    config.def("learning_rate_at", &agents::learning_rate_at<Config>, py::arg("progress"))
        .def("epsilon_at", &agents::epsilon_at<Config>, py::arg("progress"));
  };
  def_schedule(bindings::bind_config<QLearningConfig>(
      module, "QLearningConfig",
      "The parameters of Q-learning; the defaults are the paper's (section 4.2)."));
  def_schedule(bindings::bind_config<QLambdaConfig>(
      module, "QLambdaConfig",
      "The parameters of Q(lambda) and Sarsa(lambda) with a linear readout of the SDNN code."));
  bindings::bind_config<FuzzyQLearningConfig>(
      module, "FuzzyQLearningConfig",
      "The parameters of fuzzy Q-learning; the defaults are the paper's (section 4.3).");

  module.def(
      "presets",
      [] {
        py::typing::Dict<py::str, py::typing::Tuple<py::str, SDNNCConfig, QLearningConfig>> found;
        for (const auto& [name, title, preset] : agents::presets(SDNNCConfig{}.n_inputs)) {
          found[name] = py::make_tuple(title, preset.approximator, preset.learning);
        }
        return found;
      },
      "Named settings of Q-learning with SDNN-C: titles, settings of approximator and learning");
  module.def(
      "q_lambda_presets",
      [] {
        py::typing::Dict<py::str, py::typing::Tuple<py::str, LinearSDNNConfig, QLambdaConfig>>
            found;
        for (const auto& [name, title, preset] :
             agents::q_lambda_presets(LinearSDNNConfig{}.n_inputs)) {
          found[name] = py::make_tuple(title, preset.approximator, preset.learning);
        }
        return found;
      },
      "The presets of Q(lambda), by name");

  py::class_<agents::FixedRate>(module, "FixedRate", "Waits for ticks at a fixed rate")
      .def(py::init<double, agents::FixedRate::Clock, agents::FixedRate::Sleep>(), py::arg("hz"),
           py::arg("clock"), py::arg("sleep"))
      .def("wait", &agents::FixedRate::wait, "Waits for the next tick and returns its number")
      .def_property_readonly("hz", &agents::FixedRate::hz)
      .def_property_readonly("n_misses", &agents::FixedRate::n_misses)
      .def_property_readonly("n_skipped", &agents::FixedRate::n_skipped)
      .def_property_readonly("worst_lateness", &agents::FixedRate::worst_lateness);

  module.def("seed_of_dimension", &approximators::seed_of_dimension, py::arg("seed"), py::arg("d"),
             "The seed of the network of a dimension of the action");

  using SDNNAgent = agents::QLearning<SDNNC>;
  const auto make_sdnn = [](const SDNNCConfig& config, std::uint64_t seed) {
    return SDNNC(config, seed);
  };
  bind_q_learning<SDNNCConfig, SDNNC>(module, "SDNNQLearning", "Q-learning with SDNN-C", make_sdnn)
      .def(py::init([](const SDNNCConfig& approximator, const QLearningConfig& learning,
                       std::uint64_t seed, const std::vector<ArrayArgument<std::int8_t>>& tables) {
             return SDNNAgent(SDNNC(approximator, bindings::tables_of(tables), seed), learning,
                              seed);
           }),
           py::kw_only(), py::arg("approximator"), py::arg("learning"), py::arg("seed"),
           py::arg("tables"), "With the patterns of each input: (n_bins, m) of -1, +1");
  bind_decoupled_q_learning<SDNNCConfig, SDNNC>(
      module, "DecoupledSDNNQLearning", "Q-learning with an SDNN-C per dimension", make_sdnn);
  const auto make_rbf = [](const RBFNetworkConfig& config, std::uint64_t) {
    return RBFNetwork(config);
  };
  bind_q_learning<RBFNetworkConfig, RBFNetwork>(module, "RBFQLearning",
                                                "Q-learning with an RBF network", make_rbf);
  bind_decoupled_q_learning<RBFNetworkConfig, RBFNetwork>(
      module, "DecoupledRBFQLearning", "Q-learning with an RBF network per dimension", make_rbf);
  py::class_<FuzzyQLearning> fuzzy_agent(module, "FuzzyQLearning",
                                         "Fuzzy Q-learning; actions are numbers in [-1, 1]");
  fuzzy_agent
      .def(py::init([](const FuzzyRulesConfig& approximator, const FuzzyQLearningConfig& learning,
                       std::uint64_t seed) {
             return FuzzyQLearning(FuzzyRules(approximator), learning, seed);
           }),
           py::kw_only(), py::arg("approximator"), py::arg("learning"), py::arg("seed"))
      .def_property_readonly(
          "rules", [](FuzzyQLearning& agent) -> FuzzyRules& { return agent.rules(); },
          py::return_value_policy::reference_internal);
  def_fuzzy(fuzzy_agent);
  py::class_<VectorFuzzyQLearning> vector_fuzzy_agent(
      module, "VectorFuzzyQLearning", "Fuzzy Q-learning with rules for each dimension");
  vector_fuzzy_agent
      .def(py::init([](const FuzzyRulesConfig& approximator, std::size_t n_dimensions,
                       const FuzzyQLearningConfig& learning, std::uint64_t seed) {
             return VectorFuzzyQLearning(approximator, n_dimensions, learning, seed);
           }),
           py::kw_only(), py::arg("approximator"), py::arg("n_dimensions"), py::arg("learning"),
           py::arg("seed"))
      .def(
          "part",
          [](VectorFuzzyQLearning& agent, std::size_t dimension) -> FuzzyQLearning& {
            core::require(dimension < agent.n_dimensions(), "dimension",
                          "less than " + std::to_string(agent.n_dimensions()), dimension);
            return agent.part(dimension);
          },
          py::arg("dimension"), py::return_value_policy::reference_internal);
  def_fuzzy(vector_fuzzy_agent);
  py::class_<QLambda> q_lambda(module, "QLambda",
                               "Q(lambda) with a linear readout of the SDNN code");
  q_lambda
      .def(py::init([](const LinearSDNNConfig& approximator,
                       const std::vector<std::size_t>& n_actions, const QLambdaConfig& learning,
                       std::uint64_t seed, const std::vector<ArrayArgument<std::int8_t>>& tables) {
             return QLambda(tables.empty() ? LinearSDNN(approximator, n_actions, seed)
                                           : LinearSDNN(approximator, n_actions,
                                                        bindings::tables_of(tables), seed),
                            learning, seed);
           }),
           py::kw_only(), py::arg("approximator"), py::arg("n_actions"), py::arg("learning"),
           py::arg("seed"), py::arg("tables") = std::vector<ArrayArgument<std::int8_t>>())
      .def_property_readonly(
          "action_value", [](QLambda& self) -> LinearSDNN& { return self.action_value(); },
          py::return_value_policy::reference_internal)
      .def_property_readonly("final_epsilon", &QLambda::final_epsilon, "Where epsilon goes")
      .def_property_readonly("n_learned", &QLambda::n_learned, "Transitions that were learned");
  def_q_learning(q_lambda, &q_values_of_readout);
}
