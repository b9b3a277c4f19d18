#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <cstdint>
#include <span>
#include <string>
#include <tuple>
#include <vector>

#include "arrays.hpp"
#include "bind_config.hpp"
#include "bindings.hpp"
#include "sdnn/environments/acrobot.hpp"
#include "sdnn/environments/acrobot_batch.hpp"
#include "sdnn/environments/acrobot_config.hpp"
#include "sdnn/environments/acrobot_sensors.hpp"
#include "sdnn/environments/acrobot_state.hpp"
#include "sdnn/environments/goal_schedule.hpp"

namespace py = pybind11;
using namespace sdnn;
using namespace sdnn::environments;
using bindings::array_of;
using bindings::ArrayArgument;
using bindings::copied;
using bindings::filled;

namespace {

AcrobotState state_vector(const ArrayArgument<double>& state) {
  const auto values = bindings::vector(state, "state");
  core::require(values.size() == 4, "state", "of 4 numbers", values.size());
  return {values[0], values[1], values[2], values[3]};
}

std::span<const std::uint8_t> flags(const ArrayArgument<bool>& array, const char* name) {
  const auto items = bindings::vector(array, name);
  return {reinterpret_cast<const std::uint8_t*>(items.data()), items.size()};
}

std::span<std::uint8_t> flags(py::array_t<bool>& array) {
  return {reinterpret_cast<std::uint8_t*>(array.mutable_data()),
          static_cast<std::size_t>(array.size())};
}

std::span<double> items(py::array_t<double>& array) {
  return {array.mutable_data(), static_cast<std::size_t>(array.size())};
}

void bind_goal_schedule(py::module_& module) {
  bindings::bind_config<GoalScheduleConfig>(
      module, "GoalScheduleConfig",
      "How the goal tolerance lambda(k) falls with the learning episode k (section 4.1).");
  bindings::Class<GoalSchedule>(module, "GoalSchedule",
                                "lambda as a function of the learning episode")
      .def(py::init<const GoalScheduleConfig&>(), py::arg("config"))
      .def("__call__", &GoalSchedule::operator(), py::arg("episode"));
}

void bind_acrobot(py::module_& module) {
  bindings::bind_config<AcrobotConfig>(
      module, "AcrobotConfig",
      "The numbers of the acrobot's task; the defaults are the paper's (section 4.1).");

  bindings::Class<Acrobot>(module, "Acrobot", "Dynamics, reward and episode end of the acrobot")
      .def(py::init<const AcrobotConfig&>(), py::arg("config"))
      .def("reset", &Acrobot::reset)
      .def(
          "set_state",
          [](Acrobot& acrobot, const ArrayArgument<double>& state) {
            acrobot.set_state(state_vector(state));
          },
          py::arg("state"))
      .def(
          "step",
          [](Acrobot& acrobot, double torque, double goal_tolerance) {
            const StepResult result = acrobot.step(torque, goal_tolerance);
            return std::make_tuple(result.reward, result.terminated, result.truncated);
          },
          py::arg("torque"), py::arg("goal_tolerance"), "(reward, terminated, truncated)")
      .def("state",
           [](const Acrobot& acrobot) {
             const AcrobotState state = acrobot.state();
             return array_of<double>({state.data(), 4});
           })
      .def("tip_height", &Acrobot::tip_height)
      .def("decisions", &Acrobot::decisions);
}

void bind_acrobot_batch(py::module_& module) {
  using Mask = ArrayArgument<bool>;
  using Write = void (AcrobotBatch::*)(std::span<double>) const;
  const auto rows = [](Write write) {
    return [write](const AcrobotBatch& batch) {
      return filled<double>({batch.size(), 4}, [&](auto out) { (batch.*write)(out); });
    };
  };
  bindings::Class<AcrobotBatch>(module, "AcrobotBatch", "Many acrobots in step, in vector lanes")
      .def(py::init<const AcrobotConfig&, std::size_t>(), py::arg("config"), py::arg("n_acrobots"))
      .def("__len__", &AcrobotBatch::size)
      .def(
          "reset", [](AcrobotBatch& batch, const Mask& mask) { batch.reset(flags(mask, "mask")); },
          py::arg("mask"))
      .def(
          "set_state",
          [](AcrobotBatch& batch, std::size_t index, const ArrayArgument<double>& state) {
            batch.set_state(index, state_vector(state));
          },
          py::arg("index"), py::arg("state"))
      .def(
          "step",
          [](AcrobotBatch& batch, const ArrayArgument<double>& torques,
             const ArrayArgument<double>& goal_tolerances, const Mask& moving) {
            const auto size = static_cast<py::ssize_t>(batch.size());
            py::array_t<double> rewards(size);
            py::array_t<bool> terminated(size), truncated(size);
            const auto torque = copied(bindings::vector(torques, "torques"));
            const auto tolerance = copied(bindings::vector(goal_tolerances, "goal_tolerances"));
            const auto mask = copied(flags(moving, "moving"));
            const AcrobotBatchResults results{items(rewards), flags(terminated), flags(truncated)};
            {
              const bindings::WithoutGIL unlocked(batch);
              batch.step(torque, tolerance, mask, results);
            }
            return std::make_tuple(rewards, terminated, truncated);
          },
          py::arg("torques"), py::arg("goal_tolerances"), py::arg("moving"),
          "(rewards, terminated, truncated)")
      .def("states", rows(&AcrobotBatch::states))
      .def("observations", rows(&AcrobotBatch::observations), "s1..s4 of every state")
      .def("tip_heights",
           [](const AcrobotBatch& batch) {
             return filled<double>({batch.size()}, [&](auto out) { batch.tip_heights(out); });
           })
      .def("decisions", &AcrobotBatch::decisions, py::arg("index"));
}

void bind_sensors(py::module_& module) {
  module.def(
      "basic_observation",
      [](const ArrayArgument<double>& state) {
        const Eigen::Vector4d observation = basic_observation(state_vector(state));
        return array_of<double>({observation.data(), 4});
      },
      py::arg("state"), "s1..s4 of a state");
  module.def("energy_sensor", &energy_sensor, py::arg("s3"), py::arg("s4"));
  module.def("height_sensor", &height_sensor, py::arg("s1"), py::arg("s2"));
  bindings::Class<SensorNoise>(module, "SensorNoise", "Gaussian noise on every channel")
      .def(py::init<double, std::vector<SensorEdge>, std::uint64_t, core::Stream>(),
           py::arg("sigma"), py::arg("edges"), py::arg("seed"), py::arg("stream"))
      .def(
          "apply",
          [](SensorNoise& noise, const ArrayArgument<double>& values) {
            const auto clean = bindings::vector(values, "values");
            core::require(clean.size() == noise.n_channels(), "values",
                          "of " + std::to_string(noise.n_channels()) + " numbers", clean.size());
            std::vector<double> noisy(clean.begin(), clean.end());
            noise.apply(noisy);
            return array_of<double>(noisy);
          },
          py::arg("values"), "A noisy copy");
  bindings::bind_config<SensorConfig>(module, "SensorConfig",
                                      "What the agent observes (section 4.3).")
      .def_property_readonly("n_inputs", &SensorConfig::n_inputs, "Numbers in an observation.");
  bindings::Class<AcrobotSensors>(module, "AcrobotSensors", "s1..s4, s5 and s6 with their noise")
      .def(py::init<const SensorConfig&, std::uint64_t, core::Stream>(), py::arg("config"),
           py::arg("seed"), py::arg("stream"))
      .def(
          "observe",
          [](AcrobotSensors& sensors, const ArrayArgument<double>& state) {
            std::vector<double> out(sensors.n_inputs());
            sensors.observe(state_vector(state), out);
            return array_of<double>(out);
          },
          py::arg("state"));
}

}  // namespace

void bind_environments(py::module_& module) {
  bind_goal_schedule(module);
  bind_acrobot(module);
  bind_acrobot_batch(module);
  bind_sensors(module);
}
