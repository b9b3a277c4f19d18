#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <numeric>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "action_rows.hpp"
#include "agents.hpp"
#include "arrays.hpp"
#include "bind_config.hpp"
#include "bindings.hpp"
#include "sdnn/agents/action_mask.hpp"
#include "sdnn/agents/any_agent.hpp"
#include "sdnn/agents/controller.hpp"
#include "sdnn/agents/controller_config.hpp"
#include "sdnn/agents/observations.hpp"
#include "states.hpp"
#include "workspaces.hpp"

namespace py = pybind11;
using namespace sdnn;
using agents::Controller;
using agents::ControllerConfig;
using bindings::array_of;
using bindings::ArrayArgument;

namespace {

/// Describes where an input of a state comes from: its kind, and the numbers that belong to it, the
/// variable and, for an angle of two variables, the other one, or a symbol's number.
std::pair<std::string, std::vector<std::size_t>> described(const agents::ObservedInput& input) {
  switch (input.kind) {
    case agents::ObservedKind::variable:
      return {"variable", {input.first}};
    case agents::ObservedKind::angle:
      return {"angle", {input.first, input.second}};
    case agents::ObservedKind::circular:
      return {"circular", {input.first}};
    case agents::ObservedKind::symbol:
      return {"symbol", {input.first, input.second}};
  }
  return {};
}

/// Whether other threads could run Python while the calling thread works without the GIL.
bool has_other_threads() {
  return PyThreadState_Next(PyInterpreterState_ThreadHead(PyInterpreterState_Get())) != nullptr;
}

/// Waits until pending changes of a controller, or of its networks, are done. Call it before
/// anything is read: the controller may be in its warm-up afterwards.
void wait_for_changes(Controller& controller) {
  if (controller.is_warming_up()) return;  // there are no networks yet, and nothing reads them
  bindings::wait_for_changes(controller, bindings::memory_of_parts(controller.agent()));
}

/// Calls `read`, which reads the controller, while other threads run and may read it, too.
template <class Read>
void read_without_gil(Controller& controller, const Read& read) {
  const std::span<const std::byte> parts = bindings::memory_of_parts(controller.agent());
  const bindings::WithoutGIL unlocked(std::as_const(controller), parts);
  read();
}

void require_warm(const Controller& controller) {
  if (controller.is_warming_up()) throw std::runtime_error("agent is still warming up");
}

/// Returns the greedy action after the warm-up, without the GIL: other threads may read the same
/// controller meanwhile.
std::span<const double> best_action(Controller& controller, std::span<const double> observation,
                                    std::size_t environment, agents::ActionMask mask) {
  const Controller& read = controller;
  const auto state = bindings::copied(controller.prepare(observation, environment));
  auto& workspace = bindings::workspace_of(read);
  read_without_gil(controller, [&] { read.read(state, workspace); });
  return controller.best_of(workspace, environment, mask);  // draws random numbers: with the GIL
}

/// Returns the values of all actions of a dimension; other threads may read meanwhile, as in
/// best_action.
py::array_t<double> values(Controller& controller, const ArrayArgument<double>& observation,
                           std::size_t dimension) {
  wait_for_changes(controller);
  require_warm(controller);
  core::require_below("dimension", dimension, controller.n_dimensions());
  const auto variables = bindings::copied(bindings::flat(observation));
  auto& workspace = bindings::workspace_of(std::as_const(controller));
  std::span<const double> row;
  const auto read = [&] { row = controller.values(variables, workspace, dimension); };
  if (controller.history().is_none()) {
    read_without_gil(controller, read);
  } else {
    read();  // with the GIL, as other threads may change the memory of episodes
  }
  return array_of(row);
}

/// The allowed actions, 1 or 0 for each; None allows all.
using MaskArgument = std::optional<ArrayArgument<std::uint8_t>>;

agents::ActionMask mask_of(const MaskArgument& mask) {
  return mask ? bindings::flat(*mask) : agents::ActionMask();
}
/// Returns the row of `masks` for an environment; without masks, the mask that allows all.
agents::ActionMask mask_of(const MaskArgument& masks, const char* name, std::size_t environment) {
  if (!masks) return {};
  const auto rows = bindings::matrix(*masks, name);
  const auto n = static_cast<std::size_t>(masks->shape(1));
  core::require(environment < static_cast<std::size_t>(masks->shape(0)), name,
                "a row for each environment", masks->shape(0));
  return rows.subspan(n * environment, n);
}

/// Row i of an array with `n_columns` columns. Throws std::invalid_argument if there is no row i.
std::span<const double> row(const ArrayArgument<double>& rows, const char* name,
                            std::size_t n_columns, std::size_t i) {
  const auto numbers = bindings::flat(rows);
  if (i >= numbers.size() / n_columns) {  // tested first: making the message allocates
    core::require(false, name, std::to_string(n_columns) + " numbers for each environment",
                  numbers.size());
  }
  return numbers.subspan(n_columns * i, n_columns);
}

/// Learns the steps of the listed environments in order: at most `most`, and none after the first
/// that ends an episode. After every step but such a last one, progress becomes (`n_steps` + number
/// of learned steps) / `goal`, if there is a goal. Returns the number of learned steps. If a step
/// cannot be learned, its error is thrown if it is the first; otherwise learning stops before it.
std::size_t learn_each(Controller& controller, const ArrayArgument<double>& observations,
                       const py::object& actions, const py::list& rewards,
                       const ArrayArgument<double>& next_observations, const py::list& terminated,
                       const py::list& truncated, const py::list& environments, std::size_t most,
                       std::size_t n_steps, std::optional<double> goal,
                       const MaskArgument& next_masks, const std::optional<py::list>& dts) {
  bindings::wait_for_readers(controller);
  const std::size_t n = controller.n_variables();
  const std::size_t n_environments = std::min(
      {rewards.size(), terminated.size(), truncated.size(), dts ? dts->size() : rewards.size()});
  const bindings::ActionRows rows(actions, controller.n_dimensions());
  std::vector<double> action;
  std::size_t n_learned = 0;
  bool is_over = false;
  while (n_learned < std::min(most, environments.size()) && !is_over) {
    const auto i = environments[n_learned].cast<std::size_t>();
    core::require(i < n_environments, "environments", "those of rewards and ends", i);
    const auto reward = rewards[i].cast<double>();
    const auto ends = terminated[i].cast<bool>();
    const double dt = dts ? (*dts)[i].cast<double>() : 1.0;
    is_over = ends || truncated[i].cast<bool>();
    rows.read(i, action);
    try {
      controller.learn(row(observations, "observations", n, i), action, reward,
                       row(next_observations, "next_observations", n, i), ends, i,
                       mask_of(next_masks, "next_masks", i), dt);
    } catch (const std::logic_error&) {
      if (n_learned == 0) throw;
      break;
    } catch (const std::overflow_error&) {
      if (n_learned == 0) throw;
      break;
    }
    ++n_learned;
    if (goal && !is_over) {
      controller.set_progress(static_cast<double>(n_steps + n_learned) / *goal);
    }
  }
  return n_learned;
}

/// Whether an object is an array of numbers whose shape is `n_before` dimensions followed by
/// `shape`.
bool is_array_of(py::handle object, py::ssize_t n_before, const std::vector<py::ssize_t>& shape) {
  if (!Py_IS_TYPE(object.ptr(), py::detail::npy_api::get().PyArray_Type_)) return false;
  const auto array = py::reinterpret_borrow<py::array>(object);
  return array.ndim() == static_cast<py::ssize_t>(shape.size()) + n_before &&
         std::equal(shape.begin(), shape.end(), array.shape() + n_before) &&
         std::string_view("fiub").find(array.dtype().kind()) != std::string_view::npos;
}

/// Copies the numbers of an array to `to`, and returns the end of the copies. Arrays of float32, as
/// most environments have, need no intermediate array.
double* copy_numbers(py::handle object, double* to) {
  const auto array = py::reinterpret_borrow<py::array>(object);
  const py::dtype type = array.dtype();
  const bool is_float = type.num() == py::dtype::num_of<float>() && type.byteorder() == '=';
  if (is_float && (array.flags() & py::array::c_style) != 0) {
    return std::copy_n(static_cast<const float*>(array.data()), array.size(), to);
  }
  const ArrayArgument<double>::Base numbers(array);
  return std::copy_n(numbers.data(), numbers.size(), to);
}

/// Copies observations of several environments, of `shape` each, in an array or a list of arrays,
/// to an array of float64 with a row for each environment. Returns None for anything else.
std::optional<py::array_t<double>> observation_rows(const py::object& observations,
                                                    const std::vector<py::ssize_t>& shape) {
  const auto n_variables =
      std::accumulate(shape.begin(), shape.end(), py::ssize_t{1}, std::multiplies<>());
  if (is_array_of(observations, 1, shape)) {
    const auto array = py::reinterpret_borrow<py::array>(observations);
    py::array_t<double> rows({array.shape(0), n_variables});
    copy_numbers(array, rows.mutable_data());
    return rows;
  }
  if (!py::isinstance<py::list>(observations)) return std::nullopt;
  const auto list = py::reinterpret_borrow<py::list>(observations);
  py::array_t<double> rows({static_cast<py::ssize_t>(list.size()), n_variables});
  double* to = rows.mutable_data();
  for (const py::handle observation : list) {
    if (!is_array_of(observation, 0, shape)) return std::nullopt;
    to = copy_numbers(observation, to);
  }
  return rows;
}

/// Binds a member function that takes a transition.
template <class Call>
void def_transition(py::class_<Controller>& type, const char* name, const char* doc,
                    const Call& call) {
  type.def(
      name,
      [call](Controller& self, const ArrayArgument<double>& observation,
             const ArrayArgument<double>& action, double reward,
             const ArrayArgument<double>& next_observation, bool terminated,
             std::size_t environment, const MaskArgument& next_mask, double dt) {
        call(self, bindings::flat(observation), bindings::flat(action), reward,
             bindings::flat(next_observation), terminated, environment, mask_of(next_mask), dt);
      },
      py::arg("observation"), py::arg("action"), py::arg("reward"), py::arg("next_observation"),
      py::arg("terminated"), py::arg("environment") = 0, py::arg("next_mask") = py::none(),
      py::arg("dt") = 1.0, doc);
}

}  // namespace

void bind_controller(py::module_& module) {
  bindings::bind_config<agents::ActionConfig>(module, "ActionConfig", "The actions of a task.");
  bindings::Class<Controller> type(module, "Controller", "An agent in the units of its task");
  type.attr("fields") = bindings::described_fields(bindings::fields_of(ControllerConfig{}));
  type.def(py::init([](const agents::AnyApproximatorConfig& approximator,
                       const agents::AnyLearningConfig& learning, std::uint64_t seed,
                       const agents::ObservationConfig& observation,
                       const agents::ActionConfig& action, int warm_up_steps,
                       const std::vector<ArrayArgument<std::int8_t>>& tables,
                       const std::optional<py::dict>& state) {
             ControllerConfig config{approximator, learning, seed,
                                     observation,  action,   warm_up_steps};
             if (state)
               return Controller::restored(std::move(config), bindings::state_from(*state));
             return Controller(std::move(config), bindings::tables_of(tables));
           }),
           py::kw_only(), py::arg("approximator"), py::arg("learning"), py::arg("seed"),
           py::arg("observation"), py::arg("action"),
           py::arg("warm_up_steps") = ControllerConfig{}.warm_up_steps,
           py::arg("tables") = std::vector<ArrayArgument<std::int8_t>>(),
           py::arg("state") = py::none(), "New, or as it was when `state` was taken")
      .def_property_readonly("approximator", &Controller::approximator)
      .def_property_readonly("is_warming_up", &Controller::is_warming_up)
      .def_property_readonly("n_learned", &Controller::n_learned)
      .def_property_readonly(
          "has_warm_up", [](const Controller& self) { return self.observations().needs_fit(); },
          "Whether there is, or was, a warm-up")
      .def_property_readonly("n_variables", &Controller::n_variables)
      .def_property_readonly(
          "history",
          [](const Controller& self) {
            const auto kind = static_cast<std::size_t>(self.history().kind());
            return std::string(words_of(agents::History())[kind]);
          },
          "The part of earlier observations in states; 'none' during the warm-up")
      .def_property_readonly("n_actions",
                             [](const Controller& self) { return self.actions().n_actions(); })
      .def_property_readonly(
          "ranges",
          [](const Controller& self) {
            return std::pair(array_of(self.observations().low()),
                             array_of(self.observations().high()));
          },
          "Lowest and highest values, (n_variables,) each")
      .def_property_readonly(
          "inputs",
          [](const Controller& self) {
            std::vector<std::pair<std::string, std::vector<std::size_t>>> inputs;
            for (const auto& input : self.observations().inputs()) {
              inputs.push_back(described(input));
            }
            return inputs;
          },
          "Of a state: kinds, and the variables that they are made of")
      .def_property_readonly(
          "networks",
          [](py::object& self) {
            auto& controller = self.cast<Controller&>();
            require_warm(controller);
            return bindings::networks_of(controller.agent(), self);
          },
          "Networks or rules of each dimension, or the readout of all; states are in [0, 1]")
      .def_property_readonly(
          "final_epsilon",
          [](const Controller& self) {
            require_warm(self);
            const auto* const agent = std::get_if<agents::QLambda>(&self.agent());
            return agent == nullptr ? std::nullopt : std::optional(agent->final_epsilon());
          },
          "Where epsilon goes with schedule_steps; None without Q(lambda)")
      .def_property("n_environments", &Controller::n_environments,
                    [](Controller& self, std::size_t n) {
                      bindings::wait_for_readers(self);
                      self.set_n_environments(n);
                    })
      .def_property("progress", &Controller::progress, &Controller::set_progress)
      .def_property("learning_rate", &Controller::learning_rate, &Controller::set_learning_rate)
      .def_property("epsilon", &Controller::epsilon, &Controller::set_epsilon)
      .def(
          "begin_episode",
          [](Controller& self, std::size_t environment) {
            bindings::wait_for_readers(self);
            self.begin_episode(environment);
          },
          py::arg("environment") = 0)
      .def("begin_greedy_episode", &Controller::begin_greedy_episode, py::arg("environment") = 0,
           "The next acts without `explore` hold no earlier readings")
      .def(
          "act",
          [](Controller& self, const ArrayArgument<double>& observation, bool explore,
             std::size_t environment, const MaskArgument& mask) {
            if (!explore) wait_for_changes(self);
            const auto variables = bindings::flat(observation);
            const bool is_reader = !explore && has_other_threads() && !self.is_warming_up() &&
                                   environment < self.n_environments();
            return array_of(is_reader ? best_action(self, variables, environment, mask_of(mask))
                                      : self.act(variables, explore, environment, mask_of(mask)));
          },
          py::arg("observation"), py::arg("explore") = true, py::arg("environment") = 0,
          py::arg("mask") = py::none())
      .def(
          "act_each",
          [](Controller& self, const ArrayArgument<double>& observations,
             const py::list& environments, const py::object& actions, const MaskArgument& masks) {
            core::require(py::isinstance<py::array>(actions), "actions",
                          "an array, which is written to", "something else");
            bindings::ActionRows rows(actions, self.n_dimensions());
            for (const py::handle environment : environments) {
              const auto i = environment.cast<std::size_t>();
              rows.write(i, self.act(row(observations, "observations", self.n_variables(), i), true,
                                     i, mask_of(masks, "masks", i)));
            }
          },
          py::arg("observations"), py::arg("environments"), py::arg("actions"),
          py::arg("masks") = py::none(),
          "Writes exploring actions in some environments, in order, to their rows of `actions`")
      .def(
          "learn_each", &learn_each, py::arg("observations"), py::arg("actions"),
          py::arg("rewards"), py::arg("next_observations"), py::arg("terminated"),
          py::arg("truncated"), py::arg("environments"), py::arg("most"), py::arg("n_steps"),
          py::arg("goal"), py::arg("next_masks") = py::none(), py::arg("dts") = py::none(),
          "Learns in environments in order: at most `most`, up to the end of an episode. After "
          "each "
          "but that last one, the progress becomes that of `goal` steps, if given, of which "
          "`n_steps` were learned before. Returns how many were learned: all before the first that "
          "cannot be, whose error is raised where it comes first")
      .def("values", &values, py::arg("observation"), py::arg("dimension") = 0,
           "Q of all actions of a dimension, as greedy actions follow it; of fuzzy rules the value "
           "of the observation alone, of an actor-critic the probabilities of the actions")
      .def(
          "state_value",
          [](Controller& self, const ArrayArgument<double>& observation) {
            require_warm(self);
            const auto state = self.state_of(bindings::flat(observation));
            return std::get<agents::ActorCritic>(self.agent()).value(state);
          },
          py::arg("observation"), "V(observation) of an actor-critic")
      .def(
          "state_of",
          [](Controller& self, const ArrayArgument<double>& observation) {
            return array_of(self.state_of(bindings::flat(observation)));
          },
          py::arg("observation"), "The agent's state, shape (n_inputs,)")
      .def(
          "action_of",
          [](const Controller& self, std::size_t index, std::size_t dimension) {
            return self.actions().of_index(index, dimension);
          },
          py::arg("index"), py::arg("dimension"))
      .def(
          "range_use",
          [](const Controller& self) {
            std::vector<std::optional<std::pair<double, double>>> use;
            for (const auto& variable : self.range_use()) {
              use.push_back(
                  variable ? std::optional(std::pair(variable->share_used, variable->share_beyond))
                           : std::nullopt);
            }
            return use;
          },
          "Of each variable: the share of its range that it used, and how often it was beyond")
      .def_property_readonly(
          "refused_reward", [](const Controller& self) { return self.reward_scale().refused(); },
          "The first reward that was too large to be learned, and its number from 1; or None")
      .def_property_readonly(
          "reward_size", [](const Controller& self) { return self.reward_scale().size(); },
          "The largest recent reward is 2 to this power, or up to twice that; or None");
  def_transition(type, "learn", nullptr, [](Controller& self, const auto&... transition) {
    bindings::wait_for_readers(self);
    self.learn(transition...);
  });
  def_transition(
      type, "check", "Raises what learn would; changes nothing",
      [](const Controller& self, const auto&... transition) { self.check(transition...); });
  type.def("end_warm_up_of_teacher", &Controller::end_warm_up_of_teacher,
           "Ends a warm-up in which a teacher acted; ranges reach beyond its path")
      .def(
          "imitate",
          [](Controller& self, const ArrayArgument<double>& observation,
             const ArrayArgument<double>& action, double value, double margin) {
            require_warm(self);
            bindings::wait_for_readers(self);
            self.imitate(bindings::flat(observation), bindings::flat(action), value, margin);
          },
          py::arg("observation"), py::arg("action"), py::arg("value"), py::arg("margin"),
          "Learns that a teacher chose an action whose return is `value`; values of others become "
          "lower by `margin` at least")
      .def(
          "follow_teacher",
          [](Controller& self, const ArrayArgument<double>& observation,
             const ArrayArgument<double>& action) {
            require_warm(self);
            bindings::wait_for_readers(self);
            self.follow_teacher(bindings::flat(observation), bindings::flat(action));
          },
          py::arg("observation"), py::arg("action"),
          "Continues an episode with a teacher's action, and learns nothing");
  bindings::def_state(type);
  module.def(
      "observation_rows", &observation_rows, py::arg("observations"), py::arg("shape"),
      "Observations of several environments, of a shape each, in an array or a list of arrays, as "
      "rows of float64; None where they are no such arrays of numbers");
}
