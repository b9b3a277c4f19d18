#include <pybind11/functional.h>
#include <pybind11/stl.h>
#include <pybind11/typing.h>

#include <array>
#include <cstddef>

#include "bind_config.hpp"
#include "bindings.hpp"
#include "sdnn/agents/actor_critic_config.hpp"
#include "sdnn/agents/fixed_rate.hpp"
#include "sdnn/agents/fuzzy_q_learning_config.hpp"
#include "sdnn/agents/observation_config.hpp"
#include "sdnn/agents/presets.hpp"
#include "sdnn/agents/q_lambda_config.hpp"
#include "sdnn/agents/q_learning_config.hpp"
#include "sdnn/agents/schedule_config.hpp"
#include "sdnn/approximators/linear_sdnn_config.hpp"
#include "sdnn/approximators/sdnn_c_config.hpp"

namespace py = pybind11;
using namespace sdnn;
using agents::FuzzyQLearningConfig;
using agents::QLambdaConfig;
using agents::QLearningConfig;
using approximators::LinearSDNNConfig;
using approximators::SDNNCConfig;

namespace {

/// Returns presets as a dictionary: name to (title, settings of the approximator, of learning, of
/// observations).
template <class Approximator, class Learning, std::size_t N>
auto by_name(
    const std::array<agents::Named<agents::Settings<Approximator, Learning>>, N>& presets) {
  py::typing::Dict<py::str,
                   py::typing::Tuple<py::str, Approximator, Learning, agents::ObservationConfig>>
      named;
  for (const auto& [name, title, preset] : presets) {
    named[name] = py::make_tuple(title, preset.approximator, preset.learning, preset.observation);
  }
  return named;
}

}  // namespace

void bind_agents(py::module_& module) {
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
  bindings::bind_config<agents::ActorCriticConfig>(
      module, "ActorCriticConfig", "The parameters of the actor-critic, linear in the SDNN code.");
  bindings::bind_config<FuzzyQLearningConfig>(
      module, "FuzzyQLearningConfig",
      "The parameters of fuzzy Q-learning; the defaults are the paper's (section 4.3).");

  bindings::bind_config<agents::ObservationConfig>(module, "ObservationConfig",
                                                   "The observed variables of a task.");
  module.def(
      "presets", [] { return by_name(agents::presets(SDNNCConfig{}.n_inputs)); },
      "Named settings of Q-learning with SDNN-C: titles, settings of approximator, learning and "
      "observations");
  module.def(
      "q_lambda_presets",
      [] { return by_name(agents::q_lambda_presets(LinearSDNNConfig{}.n_inputs)); },
      "The presets of Q(lambda), by name");
  module.def(
      "actor_critic_presets",
      [] { return by_name(agents::actor_critic_presets(LinearSDNNConfig{}.n_inputs)); },
      "The presets of the actor-critic, by name");

  bindings::Class<agents::FixedRate>(module, "FixedRate", "Waits for ticks at a fixed rate")
      .def(py::init<double, agents::FixedRate::Clock, agents::FixedRate::Sleep>(), py::arg("hz"),
           py::arg("clock"), py::arg("sleep"))
      .def("wait", &agents::FixedRate::wait, "Waits for the next tick and returns its number")
      .def_property_readonly("hz", &agents::FixedRate::hz)
      .def_property_readonly("n_misses", &agents::FixedRate::n_misses)
      .def_property_readonly("n_skipped", &agents::FixedRate::n_skipped)
      .def_property_readonly("worst_lateness", &agents::FixedRate::worst_lateness);
}
