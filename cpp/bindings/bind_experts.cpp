#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <cstddef>
#include <cstdint>
#include <vector>

#include "arrays.hpp"
#include "bindings.hpp"
#include "sdnn/estimators/kernel_sums.hpp"
#include "sdnn/estimators/kernel_window.hpp"
#include "sdnn/estimators/prediction_mixture.hpp"
#include "sdnn/estimators/probability_mixture.hpp"
#include "sdnn/estimators/recursive_least_squares.hpp"
#include "states.hpp"

namespace py = pybind11;
using namespace sdnn;
using bindings::ArrayArgument;
using bindings::matrix;
using bindings::vector;

namespace {

using Numbers = ArrayArgument<double>;

/// Binds the members, without constructors, of a regression whose numbers of inputs and outputs may
/// grow.
template <class Model>
py::class_<Model> bind_regression(py::module_& module, const char* name, const char* doc) {
  auto model = bindings::Class<Model>(module, name, doc);
  model.def_property_readonly("n_outputs", &Model::n_outputs)
      .def(
          "predict",
          [](const Model& self, const Numbers& inputs) {
            return bindings::filled<double>(
                {self.n_outputs()}, [&](auto out) { self.predict(vector(inputs, "inputs"), out); });
          },
          py::arg("inputs"), "The outputs; NaN marks a missing input")
      .def(
          "learn",
          [](Model& self, const Numbers& inputs, const Numbers& targets) {
            self.learn(vector(inputs, "inputs"), vector(targets, "targets"));
          },
          py::arg("inputs"), py::arg("targets"))
      .def(
          "add_inputs",
          [](Model& self, const Numbers& low, const Numbers& high) {
            self.add_inputs(vector(low, "low"), vector(high, "high"));
          },
          py::arg("low"), py::arg("high"),
          "Adds inputs after the others, which all samples so far missed")
      .def("add_outputs", &Model::add_outputs, py::arg("n"),
           "Adds outputs after the others, whose targets so far were 0");
  bindings::def_state(model);
  return model;
}

void bind_least_squares(py::module_& module) {
  using estimators::RecursiveLeastSquares;
  bind_regression<RecursiveLeastSquares>(module, "RecursiveLeastSquares",
                                         "Linear regression that learns from one sample at a time")
      .def(py::init([](const Numbers& low, const Numbers& high, std::size_t n_outputs,
                       double forgetting, double error_limit) {
             return RecursiveLeastSquares(vector(low, "low"), vector(high, "high"), n_outputs,
                                          forgetting, error_limit);
           }),
           py::arg("low"), py::arg("high"), py::arg("n_outputs"), py::arg("forgetting"),
           py::arg("error_limit") = RecursiveLeastSquares::kUnlimited);
}

void bind_kernel_window(py::module_& module) {
  using estimators::KernelWindow;
  bind_regression<KernelWindow>(module, "KernelWindow",
                                "Kernel ridge regression on the last samples of a stream")
      .def(py::init([](const Numbers& low, const Numbers& high, std::size_t n_outputs,
                       std::size_t capacity, double length_scale, double ridge,
                       double target_limit) {
             return KernelWindow(vector(low, "low"), vector(high, "high"), n_outputs, capacity,
                                 length_scale, ridge, target_limit);
           }),
           py::arg("low"), py::arg("high"), py::arg("n_outputs"), py::arg("capacity"),
           py::arg("length_scale"), py::arg("ridge"),
           py::arg("target_limit") = KernelWindow::kUnlimited);
}

void bind_kernel_sums(py::module_& module) {
  using estimators::KernelSums;
  using Bins = ArrayArgument<std::int32_t>;
  bindings::Class<KernelSums>(
      module, "KernelSums",
      "The kernel of all pairs of inputs, between fixed samples and queries, and its sums")
      .def(py::init([](const std::vector<Numbers>& correlations, const Bins& bins,
                       std::size_t n_terms, int degree) {
             std::vector<estimators::InputCorrelations> inputs;
             for (const Numbers& values : correlations) {
               core::require(values.ndim() == 1 || values.ndim() == 2, "correlations",
                             "arrays of one or two dimensions", values.ndim());
               inputs.push_back({bindings::copied(bindings::flat(values)),
                                 static_cast<std::size_t>(values.shape(0))});
             }
             return KernelSums(std::move(inputs), matrix(bins, "bins", correlations.size()),
                               n_terms, degree);
           }),
           py::arg("correlations"), py::arg("bins"), py::arg("n_terms"), py::arg("degree") = 1)
      .def(
          "matrix",
          [](const KernelSums& self, const Bins& bins) {
            const auto queries = bindings::copied(matrix(bins, "bins", self.n_inputs()));
            return bindings::filled<double>(
                {static_cast<std::size_t>(bins.shape(0)), self.n_samples()}, [&](auto out) {
                  const bindings::WithoutGIL unlocked(self);
                  self.matrix(queries, out);
                });
          },
          py::arg("bins"), "The kernel of queries and samples")
      .def(
          "sums",
          [](const KernelSums& self, const Bins& bins, const Numbers& coefficients) {
            const auto queries = bindings::copied(matrix(bins, "bins", self.n_inputs()));
            const auto factors = bindings::copied(matrix(coefficients, "coefficients"));
            const auto n_outputs = static_cast<std::size_t>(coefficients.shape(1));
            return bindings::filled<double>({static_cast<std::size_t>(bins.shape(0)), n_outputs},
                                            [&](auto out) {
                                              const bindings::WithoutGIL unlocked(self);
                                              self.sums(queries, factors, n_outputs, out);
                                            });
          },
          py::arg("bins"), py::arg("coefficients"),
          "Sums over samples of kernel times coefficient");
}

void bind_mixtures(py::module_& module) {
  using estimators::PredictionMixture;
  using estimators::ProbabilityMixture;
  auto predictions =
      bindings::Class<PredictionMixture>(
          module, "PredictionMixture",
          "A weighted mean of predictions, whose weights follow their recent errors")
          .def(py::init([](const Numbers& priors) {
                 return PredictionMixture(bindings::copied(vector(priors, "priors")));
               }),
               py::arg("priors"))
          .def_property_readonly("weights",
                                 [](const PredictionMixture& self) {
                                   return bindings::array_of<double>(self.weights());
                                 })
          .def(
              "mix",
              [](const PredictionMixture& self, const Numbers& each) {
                return self.mix(vector(each, "predictions"));
              },
              py::arg("predictions"), "The weighted mean")
          .def(
              "learn",
              [](PredictionMixture& self, const Numbers& each, double target) {
                self.learn(vector(each, "predictions"), target);
              },
              py::arg("predictions"), py::arg("target"));
  bindings::def_state(predictions);

  auto probabilities =
      bindings::Class<ProbabilityMixture>(
          module, "ProbabilityMixture",
          "A weighted mean of probabilities, whose weights follow the likelihood of recent labels")
          .def(py::init<std::size_t>(), py::arg("n_scorers"))
          .def_property_readonly("weights",
                                 [](const ProbabilityMixture& self) {
                                   return bindings::array_of<double>(self.weights());
                                 })
          .def(
              "mix",
              [](const ProbabilityMixture& self, const Numbers& shares, const Numbers& scores) {
                const auto of_classes = vector(shares, "shares");
                return bindings::filled<double>({of_classes.size()}, [&](auto out) {
                  self.mix(of_classes, matrix(scores, "scores", of_classes.size()), out);
                });
              },
              py::arg("shares"), py::arg("scores"), "The probabilities of classes")
          .def(
              "learn",
              [](ProbabilityMixture& self, const Numbers& shares, const Numbers& scores,
                 std::size_t label) {
                self.learn(vector(shares, "shares"), matrix(scores, "scores"), label);
              },
              py::arg("shares"), py::arg("scores"), py::arg("label"));
  bindings::def_state(probabilities);
}

}  // namespace

void bind_experts(py::module_& module) {
  bind_least_squares(module);
  bind_kernel_window(module);
  bind_kernel_sums(module);
  bind_mixtures(module);
}
