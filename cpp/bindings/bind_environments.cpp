#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <tuple>
#include <vector>

#include "arrays.hpp"
#include "bind_config.hpp"
#include "bindings.hpp"
#include "sdnn/core/elementary.hpp"
#include "sdnn/environments/acrobot.hpp"
#include "sdnn/environments/acrobot_batch.hpp"
#include "sdnn/environments/acrobot_sensors.hpp"
#include "sdnn/environments/goal_schedule.hpp"

namespace py = pybind11;
using namespace sdnn;
using namespace sdnn::environments;
using bindings::ArrayArgument;

namespace {

Eigen::Vector4d state_vector(const ArrayArgument<double>& state) {
  const auto values = bindings::vector(state, "state");
  core::require(values.size() == 4, "state", "of 4 numbers", values.size());
  return {values[0], values[1], values[2], values[3]};
}

py::array_t<double> array(std::span<const double> values) {
  return py::array_t<double>(static_cast<py::ssize_t>(values.size()), values.data());
}

void bind_elementary(py::module_& module) {
  module.def(
      "sin_cos",
      [](const ArrayArgument<double>& x) {
        const auto in = bindings::flat(x);
        const std::vector<py::ssize_t> shape(x.shape(), x.shape() + x.ndim());
        py::array_t<double> sin(shape), cos(shape);
        double *sin_out = sin.mutable_data(), *cos_out = cos.mutable_data();
        for (std::size_t i = 0; i < in.size(); ++i) {
          const core::SinCos at = core::sin_cos(in[i]);
          sin_out[i] = at.sin;
          cos_out[i] = at.cos;
        }
        return py::make_tuple(sin, cos);
      },
      py::arg("x"), "(sin x, cos x), item by item");
  module.def("exp", py::vectorize([](double x) { return core::exp(x); }), py::arg("x"));
  module.def("log", py::vectorize([](double x) { return core::log(x); }), py::arg("x"));
  module.def("normal_quantile", py::vectorize([](double p) { return core::normal_quantile(p); }),
             py::arg("p"));
}

void bind_goal_schedule(py::module_& module) {
  py::enum_<GoalScheduleKind>(module, "GoalScheduleKind", "The formula of lambda(k)")
      .value("inverse_linear", GoalScheduleKind::inverse_linear)
      .value("inverse_sqrt", GoalScheduleKind::inverse_sqrt)
      .value("constant", GoalScheduleKind::constant);
  bindings::bind_config<GoalScheduleConfig>(module, "GoalScheduleConfig", "How lambda(k) falls");
  py::class_<GoalSchedule>(module, "GoalSchedule", "lambda as a function of the learning episode")
      .def(py::init<const GoalScheduleConfig&>(), py::arg("config"))
      .def("__call__", &GoalSchedule::operator(), py::arg("episode"));
}

void bind_acrobot(py::module_& module) {
  py::enum_<GoalTest>(module, "GoalTest", "When the goal is looked for")
      .value("every_step", GoalTest::every_step)
      .value("decision_instant", GoalTest::decision_instant);
  bindings::bind_config<AcrobotConfig>(module, "AcrobotConfig",
                                       "The numbers of the acrobot's task");

  py::class_<Acrobot>(module, "Acrobot", "Dynamics, reward and episode end of the acrobot")
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
          [](Acrobot& acrobot, double torque, double lambda) {
            const StepResult result = acrobot.step(torque, lambda);
            return std::make_tuple(result.reward, result.terminated, result.truncated);
          },
          py::arg("torque"), py::arg("lambda_"), "(reward, terminated, truncated)")
      .def("state",
           [](const Acrobot& acrobot) {
             const Eigen::Vector4d state = acrobot.state();
             return array({state.data(), 4});
           })
      .def("tip_height", &Acrobot::tip_height)
      .def("energy", &Acrobot::energy)
      .def("decisions", &Acrobot::decisions);
}

void bind_acrobot_batch(py::module_& module) {
  using Mask = ArrayArgument<bool>;
  // A row of numbers for each acrobot, shape (size, width).
  const auto rows = [](const AcrobotBatch& batch, py::ssize_t width, auto&& row_of) {
    const auto size = static_cast<py::ssize_t>(batch.size());
    py::array_t<double> result({size, width});
    double* out = result.mutable_data();
    for (std::size_t i = 0; i < batch.size(); ++i) {
      const auto row = row_of(batch.state(i));
      out = std::copy_n(row.data(), width, out);
    }
    return result;
  };
  const auto checked = [](const AcrobotBatch& batch, const Mask& mask, const char* name) {
    const auto items = bindings::vector(mask, name);
    core::require(items.size() == batch.size(), name,
                  "of " + std::to_string(batch.size()) + " items", items.size());
    return items;
  };
  py::class_<AcrobotBatch>(module, "AcrobotBatch", "Many acrobots in step, in vector lanes")
      .def(py::init<const AcrobotConfig&, std::size_t>(), py::arg("config"), py::arg("n_acrobots"))
      .def("__len__", &AcrobotBatch::size)
      .def(
          "reset",
          [checked](AcrobotBatch& batch, const Mask& mask) {
            const auto chosen = checked(batch, mask, "mask");
            for (std::size_t i = 0; i < chosen.size(); ++i) {
              if (chosen[i]) batch.reset(i);
            }
          },
          py::arg("mask"))
      .def(
          "set_state",
          [](AcrobotBatch& batch, std::size_t index, const ArrayArgument<double>& state) {
            batch.set_state(index, state_vector(state));
          },
          py::arg("index"), py::arg("state"))
      .def(
          "step",
          [checked](AcrobotBatch& batch, const ArrayArgument<double>& torques,
                    const ArrayArgument<double>& lambdas, const Mask& moving) {
            const auto chosen = checked(batch, moving, "moving");
            const std::vector<std::uint8_t> mask(chosen.begin(), chosen.end());
            std::vector<StepResult> results(batch.size());
            {
              const auto torque = bindings::vector(torques, "torques");
              const auto lambda = bindings::vector(lambdas, "lambdas");
              const py::gil_scoped_release unlocked;
              batch.step(torque, lambda, mask, results);
            }
            const auto size = static_cast<py::ssize_t>(batch.size());
            py::array_t<double> rewards(size);
            py::array_t<bool> terminated(size), truncated(size);
            for (py::ssize_t i = 0; i < size; ++i) {
              const StepResult& result = results[static_cast<std::size_t>(i)];
              rewards.mutable_at(i) = result.reward;
              terminated.mutable_at(i) = result.terminated;
              truncated.mutable_at(i) = result.truncated;
            }
            return std::make_tuple(rewards, terminated, truncated);
          },
          py::arg("torques"), py::arg("lambdas"), py::arg("moving"),
          "(rewards, terminated, truncated)")
      .def("states",
           [rows](const AcrobotBatch& batch) {
             return rows(batch, 4, [](const Eigen::Vector4d& state) { return state; });
           })
      .def(
          "observations",
          [rows](const AcrobotBatch& batch) { return rows(batch, 4, basic_observation); },
          "s1..s4 of every state")
      .def("tip_heights",
           [](const AcrobotBatch& batch) {
             std::vector<double> heights(batch.size());
             for (std::size_t i = 0; i < heights.size(); ++i) heights[i] = batch.tip_height(i);
             return array(heights);
           })
      .def("decisions", &AcrobotBatch::decisions, py::arg("index"));
}

void bind_sensors(py::module_& module) {
  py::enum_<SensorEdge>(module, "SensorEdge", "What noise does at the ends of a sensor's range")
      .value("wrap", SensorEdge::wrap)
      .value("saturate", SensorEdge::saturate);
  module.def(
      "basic_observation",
      [](const ArrayArgument<double>& state) {
        return array(basic_observation(state_vector(state)));
      },
      py::arg("state"), "s1..s4 of a state");
  module.def("energy_sensor", &energy_sensor, py::arg("s3"), py::arg("s4"));
  module.def("height_sensor", &height_sensor, py::arg("s1"), py::arg("s2"));
  py::class_<SensorNoise>(module, "SensorNoise", "Gaussian noise on every channel")
      .def(py::init<double, std::vector<SensorEdge>, std::uint64_t, core::Stream>(),
           py::arg("sigma"), py::arg("edges"), py::arg("seed"), py::arg("stream"))
      .def(
          "apply",
          [](SensorNoise& noise, const ArrayArgument<double>& values) {
            const auto clean = bindings::vector(values, "values");
            core::require(clean.size() == static_cast<std::size_t>(noise.n_channels()), "values",
                          "of " + std::to_string(noise.n_channels()) + " numbers", clean.size());
            std::vector<double> noisy(clean.begin(), clean.end());
            noise.apply(noisy);
            return array(noisy);
          },
          py::arg("values"), "A noisy copy");
  bindings::bind_config<SensorConfig>(module, "SensorConfig",
                                      "Which sensors there are and how noisy");
  py::class_<AcrobotSensors>(module, "AcrobotSensors", "s1..s4, s5 and s6 with their noise")
      .def(py::init<const SensorConfig&, std::uint64_t, core::Stream>(), py::arg("config"),
           py::arg("seed"), py::arg("stream"))
      .def(
          "observe",
          [](AcrobotSensors& sensors, const ArrayArgument<double>& state) {
            std::vector<double> out(static_cast<std::size_t>(sensors.n_sensors()));
            sensors.observe(state_vector(state), out);
            return array(out);
          },
          py::arg("state"));
}

}  // namespace

void bind_environments(py::module_& module) {
  bind_elementary(module);
  bind_goal_schedule(module);
  bind_acrobot(module);
  bind_acrobot_batch(module);
  bind_sensors(module);
}
