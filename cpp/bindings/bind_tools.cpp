#include <pybind11/numpy.h>
#include <pybind11/stl.h>
#include <pybind11/typing.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <variant>
#include <vector>

#include "agents.hpp"
#include "arrays.hpp"
#include "bind_config.hpp"
#include "bindings.hpp"
#include "sdnn/agents/any_agent.hpp"
#include "sdnn/agents/q_learning.hpp"
#include "sdnn/approximators/rbf_network.hpp"
#include "sdnn/approximators/sdnn_c.hpp"
#include "tools/plain_rbf_network.hpp"
#include "tools/timings.hpp"
#include "tools/trial.hpp"
#include "tools/yardsticks.hpp"

namespace py = pybind11;
using namespace sdnn;
using agents::QLearning;
using agents::QLearningConfig;
using approximators::RBFNetworkConfig;
using approximators::SDNNC;
using bindings::ArrayArgument;
using environments::AcrobotConfig;
using environments::GoalScheduleConfig;
using environments::SensorConfig;
using tools::BareAgent;
using tools::PlainRBFNetwork;
using tools::ProtocolConfig;

using Trial = tools::AcrobotTrial<BareAgent>;
using PlainRBFAgent = QLearning<PlainRBFNetwork>;

template <>
constexpr bool sdnn::bindings::kIsComposed<Trial> = false;
template <>
constexpr bool sdnn::bindings::kIsComposed<PlainRBFAgent> = false;

namespace {

/// Calls `measure`, which times calls of an object, without the GIL. Returns nanoseconds, shape
/// (n,).
template <class Object, class Measure>
py::array_t<std::int64_t> times_of(Object& object, const Measure& measure) {
  tools::Times times;
  {
    const bindings::WithoutGIL unlocked(object);
    times = measure();
  }
  return bindings::array_of<std::int64_t>(times);
}

/// Binds tools::time_agent_steps for a class of agents.
template <class Agent>
void def_time_agent_steps(py::module_& module) {
  module.def(
      "time_agent_steps",
      [](Agent& agent, int n_repetitions, std::uint64_t seed) {
        return times_of(agent, [&] { return tools::time_agent_steps(agent, n_repetitions, seed); });
      },
      py::arg("agent"), py::arg("n_repetitions"), py::arg("seed"),
      "The agent learns and acts at random states; nanoseconds per step: (n_repetitions,)");
}

/// Makes an array of read(row), for all rows of a trial.
template <class Value, class Read>
py::array_t<Value> column(const Trial& trial, Read read) {
  return bindings::filled<Value>({trial.rows().size()}, [&](auto out) {
    std::ranges::transform(trial.rows(), out.begin(), read);
  });
}

/// Returns the rows of a trial's test episodes, as a dictionary of columns.
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

/// Returns how often the SDNN-C of a trial has computed potentials in full and from a neighbour,
/// and how many columns it has added; see ActivationCache::Counts.
py::typing::Dict<py::str, py::int_> cache_counts(const Trial& trial) {
  const auto* const agent = std::get_if<QLearning<SDNNC>>(&trial.agent().agent());
  if (agent == nullptr) throw std::invalid_argument("trial must be one of SDNN-C");
  const auto& counts = agent->agent_workspace().networks.front().cache().counts();
  py::typing::Dict<py::str, py::int_> out;
  out["full"] = counts.full;
  out["neighbour"] = counts.neighbour;
  out["columns"] = counts.columns;
  return out;
}

void bind_bare_agent(py::module_& module) {
  bindings::Class<BareAgent>(
      module, "BareAgent",
      "An agent of any kind without a task: states in [0, 1], actions as indices "
      "or, of fuzzy rules, numbers in [-1, 1]")
      .def(py::init([](const agents::AnyApproximatorConfig& approximator,
                       const agents::AnyLearningConfig& learning, std::uint64_t seed,
                       const std::vector<std::size_t>& n_actions) {
             if (n_actions.empty()) return BareAgent(approximator, learning, seed);
             return BareAgent(approximator, learning, n_actions, seed);
           }),
           py::kw_only(), py::arg("approximator"), py::arg("learning"), py::arg("seed"),
           py::arg("n_actions") = std::vector<std::size_t>())
      .def_property_readonly(
          "networks",
          [](py::object& self) {
            return bindings::networks_of(self.cast<BareAgent&>().agent(), self);
          },
          "Networks or rules of each dimension, or the readout of all")
      .def("begin_episode", &BareAgent::begin_episode)
      .def(
          "act",
          [](BareAgent& self, const ArrayArgument<double>& state, bool explore) {
            const auto action = self.act(bindings::vector(state, "state"), explore);
            return std::vector<double>(action.begin(), action.end());
          },
          py::arg("state"), py::arg("explore") = true)
      .def(
          "learn",
          [](BareAgent& self, const ArrayArgument<double>& state,
             const ArrayArgument<double>& action, double reward,
             const ArrayArgument<double>& next_state, bool terminated, double dt) {
            self.learn(bindings::vector(state, "state"), bindings::vector(action, "action"), reward,
                       bindings::vector(next_state, "next_state"), terminated, dt);
          },
          py::arg("state"), py::arg("action"), py::arg("reward"), py::arg("next_state"),
          py::arg("terminated"), py::arg("dt") = 1.0);
}

void bind_trial(py::module_& module) {
  bindings::Class<Trial>(module, "AcrobotTrial", "An agent learns the acrobot swing-up")
      .def(py::init([](const agents::AnyApproximatorConfig& approximator,
                       const agents::AnyLearningConfig& learning, const AcrobotConfig& acrobot,
                       const GoalScheduleConfig& goal, const SensorConfig& sensors,
                       const ProtocolConfig& protocol, std::uint64_t seed) {
             return Trial(BareAgent(approximator, learning, seed), acrobot, goal, sensors, protocol,
                          seed);
           }),
           py::kw_only(), py::arg("approximator"), py::arg("learning"), py::arg("acrobot"),
           py::arg("goal"), py::arg("sensors"), py::arg("protocol"), py::arg("seed"))
      .def_property_readonly("episode", &Trial::episode)
      .def_property_readonly("finished", &Trial::finished)
      .def_property_readonly("n_decisions", &Trial::n_decisions)
      .def_property_readonly(
          "agent", [](Trial& self) -> BareAgent& { return self.agent(); },
          py::return_value_policy::reference_internal,
          "The agent at work: asking for values changes nothing that follows")
      .def(
          "advance",
          [](Trial& self, int n_episodes) {
            const auto parts = bindings::memory_of_parts(self.agent().agent());
            const bindings::WithoutGIL unlocked(self, parts);
            self.advance(n_episodes);
          },
          py::arg("n_episodes"), "Runs up to n more learning episodes")
      .def_static(
          "advance_together",
          [](const py::typing::Tuple<Trial, py::ellipsis>& trials, int n_decisions) {
            std::vector<Trial*> all;
            std::vector<std::span<std::byte>> parts;
            for (const py::handle trial : trials) {
              if (!py::isinstance<Trial>(trial)) throw py::type_error("trials must be trials");
              all.push_back(&trial.cast<Trial&>());
              parts.push_back(bindings::memory_of_parts(all.back()->agent().agent()));
            }
            const bindings::WithoutGIL unlocked(all, parts);
            Trial::advance_together(all, n_decisions);
          },
          py::arg("trials"), py::arg("n_decisions"),
          "Lets each of several trials make n more decisions, or come to its end")
      .def("test_rows", &test_rows, "Columns of the test episodes so far")
      .def("cache_counts", &cache_counts,
           "Potentials so far, by their origin: full passes, from neighbours, columns added");
}

void bind_trials(py::module_& module) {
  bindings::bind_config<ProtocolConfig>(
      module, "ProtocolConfig",
      "Learning protocol of a trial; the defaults are the paper's (section 4.2).");

  bind_bare_agent(module);
  bind_trial(module);
  def_time_agent_steps<BareAgent>(module);

  bindings::Class<PlainRBFAgent>(module, "PlainRBFQLearning",
                                 "Q-learning with an RBF network evaluated without its product "
                                 "structure; only to be timed")
      .def(py::init([](const RBFNetworkConfig& approximator, const QLearningConfig& learning,
                       std::uint64_t seed) {
             return PlainRBFAgent(PlainRBFNetwork(approximator), learning, seed);
           }),
           py::kw_only(), py::arg("approximator"), py::arg("learning"), py::arg("seed"))
      .def_property_readonly(
          "network", [](const PlainRBFAgent& agent) { return agent.networks().front().network(); },
          "A copy of the network behind it");
  def_time_agent_steps<PlainRBFAgent>(module);
}

/// Binds a member function that times `n_repetitions` of something.
template <class Object, class... Arguments, class... Extra>
void def_times(py::class_<Object>& type, const char* name,
               tools::Times (Object::*measure)(Arguments...), const Extra&... extra) {
  type.def(
      name,
      [measure](Object& object, Arguments... arguments) {
        return times_of(object, [&] { return (object.*measure)(arguments...); });
      },
      py::arg("n_repetitions"), extra...);
}

void bind_times(py::module_& module) {
  using tools::AcrobotDecisions, tools::DenseProduct, tools::NetworkParts;
  bindings::Class<DenseProduct> product(module, "DenseProduct",
                                        "A dense float32 matrix-vector product");
  product.def(py::init<std::size_t, std::size_t, std::uint64_t>(), py::arg("n_rows"),
              py::arg("n_columns"), py::arg("seed"));
  def_times(product, "run", &DenseProduct::run, "Nanoseconds per product: (n_repetitions,)");

  bindings::Class<NetworkParts> parts(module, "NetworkParts", "The network's parts of a decision");
  parts.def(py::init<SDNNC, std::uint64_t>(), py::arg("network"), py::arg("seed"),
            "Times a copy of the network");
  def_times(parts, "time_values", &NetworkParts::time_values,
            "All values at a new state: nanoseconds (n_repetitions,)");
  def_times(parts, "time_remembered_values", &NetworkParts::time_remembered_values,
            "All values at the same state again");
  def_times(parts, "time_corrections", &NetworkParts::time_corrections, py::arg("n_corrected"),
            "Learning steps");
  def_times(parts, "time_selections", &NetworkParts::time_selections, py::arg("n_selections"),
            py::arg("n_selected"), "n_selections selections of units per repetition");

  bindings::Class<AcrobotDecisions> acrobot(module, "AcrobotDecisions",
                                            "The acrobot under random torques");
  acrobot
      .def(py::init<const environments::AcrobotConfig&, std::uint64_t>(), py::arg("config"),
           py::arg("seed"))
      .def_property_readonly("n_integration_steps", &AcrobotDecisions::n_integration_steps);
  def_times(acrobot, "run", &AcrobotDecisions::run, "Nanoseconds per decision: (n_repetitions,)");
  module.def(
      "time_decisions",
      [](Trial& trial, int n_episodes) {
        return times_of(trial, [&] { return tools::time_decisions(trial, n_episodes); });
      },
      py::arg("trial"), py::arg("n_episodes"),
      "Advances a trial; nanoseconds of every decision in it");
}

}  // namespace

void bind_tools(py::module_& module) {
  bind_trials(module);
  bind_times(module);
}
