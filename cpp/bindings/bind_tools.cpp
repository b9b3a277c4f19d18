#include <pybind11/numpy.h>
#include <pybind11/typing.h>

#include "bind_config.hpp"
#include "bindings.hpp"
#include "sdnn/agents/fuzzy_q_learning.hpp"
#include "sdnn/agents/q_lambda.hpp"
#include "sdnn/agents/q_learning.hpp"
#include "sdnn/approximators/fuzzy_rules.hpp"
#include "sdnn/approximators/linear_sdnn.hpp"
#include "sdnn/approximators/rbf_network.hpp"
#include "sdnn/approximators/sdnn_c.hpp"
#include "times.hpp"
#include "tools/agent_steps.hpp"
#include "tools/decisions.hpp"
#include "tools/network_parts.hpp"
#include "tools/plain_rbf_network.hpp"
#include "tools/trial.hpp"
#include "tools/yardsticks.hpp"

namespace py = pybind11;
using namespace sdnn;
using agents::FuzzyQLearning;
using agents::FuzzyQLearningConfig;
using agents::QLearning;
using agents::QLearningConfig;
using approximators::FuzzyRules;
using approximators::FuzzyRulesConfig;
using approximators::RBFNetwork;
using approximators::RBFNetworkConfig;
using approximators::SDNNC;
using approximators::SDNNCConfig;
using environments::AcrobotConfig;
using environments::GoalScheduleConfig;
using environments::SensorConfig;
using tools::AcrobotTrial;
using tools::PlainRBFNetwork;
using tools::ProtocolConfig;

namespace {

template <class Agent>
void def_time_agent_steps(py::module_& module) {
  module.def(
      "time_agent_steps",
      [](Agent& agent, int n_repetitions, std::uint64_t seed) {
        return bindings::times_of(
            agent, [&] { return tools::time_agent_steps(agent, n_repetitions, seed); });
      },
      py::arg("agent"), py::arg("n_repetitions"), py::arg("seed"),
      "The agent learns and acts at random states; nanoseconds per step: (n_repetitions,)");
}

template <class Value, class Trial, class Read>
py::array_t<Value> column(const Trial& trial, Read read) {
  py::array_t<Value> out(static_cast<py::ssize_t>(trial.rows().size()));
  Value* item = out.mutable_data();
  for (const auto& row : trial.rows()) *item++ = read(row);
  return out;
}

template <class Trial>
py::typing::Dict<py::str, py::array> test_rows(const Trial& trial) {
  using tools::TestRow;
  py::typing::Dict<py::str, py::array> rows;
  rows["episode"] = column<std::int32_t>(trial, [](const TestRow& row) { return row.episode; });
  rows["steps"] = column<std::int32_t>(trial, [](const TestRow& row) { return row.steps; });
  rows["episode_return"] =
      column<double>(trial, [](const TestRow& row) { return row.episode_return; });
  rows["solved"] = column<bool>(trial, [](const TestRow& row) { return row.solved; });
  return rows;
}

using SDNNTrial = AcrobotTrial<QLearning<SDNNC>>;

py::typing::Dict<py::str, py::int_> cache_counts(const SDNNTrial& trial) {
  const auto& counts = trial.agent().own_workspace().approximator.cache().counts();
  py::typing::Dict<py::str, py::int_> out;
  out["full"] = counts.full;
  out["neighbour"] = counts.neighbour;
  out["columns"] = counts.columns;
  return out;
}

/// A trial of the agent that `make_agent` makes of approximator, learning and seed; with it the
/// time of such an agent's steps.
template <class Agent, class Approximator, class Learning>
py::class_<AcrobotTrial<Agent>> def_trial(py::module_& module, const char* name, const char* doc,
                                          Agent (*make_agent)(const Approximator&, const Learning&,
                                                              std::uint64_t)) {
  using Trial = AcrobotTrial<Agent>;
  def_time_agent_steps<Agent>(module);
  py::class_<Trial> trial(module, name, doc);
  trial
      .def(py::init([make_agent](const Approximator& approximator, const Learning& learning,
                                 const AcrobotConfig& acrobot, const GoalScheduleConfig& goal,
                                 const SensorConfig& sensors, const ProtocolConfig& protocol,
                                 std::uint64_t seed) {
             return Trial(make_agent(approximator, learning, seed), acrobot, goal, sensors,
                          protocol, seed);
           }),
           py::kw_only(), py::arg("approximator"), py::arg("learning"), py::arg("acrobot"),
           py::arg("goal"), py::arg("sensors"), py::arg("protocol"), py::arg("seed"))
      .def_property_readonly("episode", &Trial::episode)
      .def_property_readonly("finished", &Trial::finished)
      .def_property_readonly("n_decisions", &Trial::n_decisions)
      .def_property_readonly(
          "agent", [](Trial& self) -> Agent& { return self.agent(); },
          py::return_value_policy::reference_internal,
          "The agent at work: asking for values changes nothing that follows")
      .def(
          "advance",
          [](Trial& self, int n_episodes) {
            const bindings::WithoutGIL unlocked(self);
            self.advance(n_episodes);
          },
          py::arg("n_episodes"), "Runs up to n more learning episodes")
      .def_static(
          "advance_together",
          [](const py::typing::Tuple<Trial, py::ellipsis>& trials, int n_decisions) {
            std::vector<Trial*> all;
            for (const py::handle trial : trials) {
              if (!py::isinstance<Trial>(trial)) {
                const py::str given(py::type::handle_of(trial).attr("__name__"));
                throw py::type_error("trials must all have the class of the method, got " +
                                     std::string(given));
              }
              all.push_back(&trial.cast<Trial&>());
            }
            const bindings::WithoutGIL unlocked(all);
            Trial::advance_together(all, n_decisions);
          },
          py::arg("trials"), py::arg("n_decisions"),
          "Lets each of several trials make n more decisions, or come to its end")
      .def("test_rows", &test_rows<Trial>, "Columns of the test episodes so far");
  return trial;
}

/// An agent of an approximator that is made of its configuration alone.
template <class Agent, class Approximator, class Config, class Learning>
Agent agent_with(const Config& approximator, const Learning& learning, std::uint64_t seed) {
  return {Approximator(approximator), learning, seed};
}

QLearning<SDNNC> sdnn_agent(const SDNNCConfig& approximator, const QLearningConfig& learning,
                            std::uint64_t seed) {
  return {SDNNC(approximator, seed), learning, seed};
}

agents::QLambda q_lambda_agent(const approximators::LinearSDNNConfig& approximator,
                               const agents::QLambdaConfig& learning, std::uint64_t seed) {
  const std::size_t n_actions[] = {static_cast<std::size_t>(approximator.n_actions)};
  return {approximators::LinearSDNN(approximator, n_actions, seed), learning, seed};
}

void bind_trials(py::module_& module) {
  bindings::bind_config<ProtocolConfig>(
      module, "ProtocolConfig",
      "Learning protocol of a trial; the defaults are the paper's (section 4.2).");

  def_trial(module, "AcrobotTrial", "SDNN-C learns the acrobot swing-up", &sdnn_agent)
      .def("cache_counts", &cache_counts,
           "How potentials came about so far: full passes, from neighbours, columns added");
  def_trial(module, "FuzzyAcrobotTrial", "Fuzzy Q-learning learns the acrobot swing-up",
            &agent_with<FuzzyQLearning, FuzzyRules, FuzzyRulesConfig, FuzzyQLearningConfig>);
  def_trial(module, "RBFAcrobotTrial", "Q-learning with an RBF network learns the acrobot swing-up",
            &agent_with<QLearning<RBFNetwork>, RBFNetwork, RBFNetworkConfig, QLearningConfig>);

  def_trial(module, "LinearAcrobotTrial",
            "Q(lambda) with a linear readout of the SDNN code learns the acrobot swing-up",
            &q_lambda_agent);

  using PlainRBFAgent = QLearning<PlainRBFNetwork>;
  py::class_<PlainRBFAgent>(module, "PlainRBFQLearning",
                            "Q-learning with an RBF network evaluated without its product "
                            "structure; only to be timed")
      .def(py::init(&agent_with<PlainRBFAgent, PlainRBFNetwork, RBFNetworkConfig, QLearningConfig>),
           py::kw_only(), py::arg("approximator"), py::arg("learning"), py::arg("seed"))
      .def_property_readonly(
          "action_value", [](const PlainRBFAgent& agent) { return agent.action_value().network(); },
          "A copy of the network behind it");
  def_time_agent_steps<PlainRBFAgent>(module);
}

void bind_times(py::module_& module) {
  py::class_<tools::DenseProduct>(module, "DenseProduct", "A dense float32 matrix-vector product")
      .def(py::init<std::size_t, std::size_t, std::uint64_t>(), py::arg("n_rows"),
           py::arg("n_columns"), py::arg("seed"))
      .def(
          "run",
          [](tools::DenseProduct& product, int n) {
            return bindings::times_of(product, [&] { return product.run(n); });
          },
          py::arg("n_repetitions"), "Nanoseconds per product: (n_repetitions,)");
  py::class_<tools::NetworkParts>(module, "NetworkParts", "The network's parts of a decision")
      .def(py::init([](const SDNNTrial& trial, std::uint64_t seed) {
             return tools::NetworkParts(trial.agent().action_value(), seed);
           }),
           py::arg("trial"), py::arg("seed"), "Times a copy of the trial's network")
      .def(py::init<SDNNC, std::uint64_t>(), py::arg("network"), py::arg("seed"),
           "Times a copy of the network")
      .def(
          "time_values",
          [](tools::NetworkParts& parts, int n) {
            return bindings::times_of(parts, [&] { return parts.time_values(n); });
          },
          py::arg("n_repetitions"), "All values at a new state: nanoseconds (n_repetitions,)")
      .def(
          "time_remembered_values",
          [](tools::NetworkParts& parts, int n) {
            return bindings::times_of(parts, [&] { return parts.time_remembered_values(n); });
          },
          py::arg("n_repetitions"), "All values at the same state again")
      .def(
          "time_corrections",
          [](tools::NetworkParts& parts, int n, int n_corrected) {
            return bindings::times_of(parts,
                                      [&] { return parts.time_corrections(n, n_corrected); });
          },
          py::arg("n_repetitions"), py::arg("n_corrected"), "Learning steps")
      .def(
          "time_selections",
          [](tools::NetworkParts& parts, int n, int n_selections, int n_selected) {
            return bindings::times_of(
                parts, [&] { return parts.time_selections(n, n_selections, n_selected); });
          },
          py::arg("n_repetitions"), py::arg("n_selections"), py::arg("n_selected"),
          "n_selections selections of units per repetition");
  py::class_<tools::AcrobotDecisions>(module, "AcrobotDecisions",
                                      "The acrobot under random torques")
      .def(py::init<const environments::AcrobotConfig&, std::uint64_t>(), py::arg("config"),
           py::arg("seed"))
      .def_property_readonly("n_integration_steps", &tools::AcrobotDecisions::n_integration_steps)
      .def(
          "run",
          [](tools::AcrobotDecisions& acrobot, int n) {
            return bindings::times_of(acrobot, [&] { return acrobot.run(n); });
          },
          py::arg("n_repetitions"), "Nanoseconds per decision: (n_repetitions,)");
  module.def(
      "time_decisions",
      [](SDNNTrial& trial, int n_episodes) {
        return bindings::times_of(trial, [&] { return tools::time_decisions(trial, n_episodes); });
      },
      py::arg("trial"), py::arg("n_episodes"),
      "Advances a trial; nanoseconds of every decision in it");
}

}  // namespace

void bind_tools(py::module_& module) {
  bind_trials(module);
  bind_times(module);
}
