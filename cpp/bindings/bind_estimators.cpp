#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "arrays.hpp"
#include "bindings.hpp"
#include "sdnn/coding/selective_desensitization.hpp"
#include "sdnn/estimators/libsdnn.hpp"
#include "sdnn/estimators/online_layer.hpp"
#include "sdnn/estimators/parallel_perceptron.hpp"
#include "sdnn/estimators/trainer.hpp"

template <class Rule>
constexpr bool sdnn::bindings::kIsComposed<sdnn::estimators::Trainer<Rule>> = false;

namespace py = pybind11;
using namespace sdnn;
using bindings::ArrayArgument;
using bindings::copied;
using bindings::matrix;
using bindings::signs_of;

namespace {

using Bins = ArrayArgument<std::int32_t>;
using Matrix = py::array_t<std::int32_t>;

using estimators::ParallelPerceptron;

std::size_t n_rows(const Bins& bins) { return static_cast<std::size_t>(bins.shape(0)); }

/// Makes a layer with these weights and thresholds, or with random ones from `seed` if there are
/// none.
std::shared_ptr<ParallelPerceptron> make_layer(
    const std::shared_ptr<coding::SelectiveDesensitization>& code, std::size_t n_units,
    std::uint64_t seed, const std::optional<ArrayArgument<std::int32_t>>& weights,
    const std::optional<ArrayArgument<std::int32_t>>& thresholds, int initial_range) {
  core::require(weights.has_value() == thresholds.has_value(), "weights and thresholds",
                "given together or not at all", weights.has_value() ? "weights" : "thresholds");
  if (!weights) return std::make_shared<ParallelPerceptron>(code, n_units, seed, initial_range);
  return std::make_shared<ParallelPerceptron>(code, n_units,
                                              matrix(*weights, "weights", code->n_columns()),
                                              bindings::vector(*thresholds, "thresholds"));
}

Matrix weights_of(const ParallelPerceptron& layer) {
  return bindings::filled<std::int32_t>({layer.n_units(), layer.code().n_columns()},
                                        [&](auto out) { layer.copy_weights(out); });
}

py::array_t<std::int32_t> thresholds_of(const ParallelPerceptron& layer) {
  return bindings::array_of(layer.thresholds());
}

/// Computes the potentials of all units for each row of bins. Shape: (n_rows, n_units).
Matrix potentials_of(const ParallelPerceptron& layer, const Bins& bins, int n_threads) {
  const auto values = copied(matrix(bins, "bins", layer.code().n_inputs()));
  return bindings::filled<std::int32_t>({n_rows(bins), layer.n_units()}, [&](auto out) {
    const bindings::WithoutGIL unlocked(layer);
    layer.potentials(values, n_threads, out);
  });
}

/// Counts the firing units in each group for each row of bins. Shape: (n_rows, n_groups).
Matrix counts_of(const ParallelPerceptron& layer, const Bins& bins, std::size_t n_groups,
                 int n_threads) {
  const auto values = copied(matrix(bins, "bins", layer.code().n_inputs()));
  static_cast<void>(layer.group_size(n_groups));  // throws before an array is allocated
  return bindings::filled<std::int32_t>({n_rows(bins), n_groups}, [&](auto out) {
    const bindings::WithoutGIL unlocked(layer);
    layer.counts(values, n_groups, n_threads, out);
  });
}

/// Counts the firing units in several layers of one code, whose codes of samples are computed once
/// for all. Shape: (n_layers, n_rows, n_groups).
py::array_t<std::int32_t> counts_of_all(
    const std::vector<std::shared_ptr<ParallelPerceptron>>& layers, const Bins& bins,
    std::size_t n_groups, int n_threads) {
  std::vector<const ParallelPerceptron*> pointers;
  for (const auto& layer : layers) {
    core::require(layer != nullptr, "layers", "ParallelPerceptron objects", "None");
    pointers.push_back(layer.get());
  }
  core::require(!layers.empty(), "layers", "at least one layer", layers.size());
  const auto values = copied(matrix(bins, "bins", layers[0]->code().n_inputs()));
  static_cast<void>(layers[0]->group_size(n_groups));  // throws before an array is allocated
  return bindings::filled<std::int32_t>({layers.size(), n_rows(bins), n_groups}, [&](auto out) {
    const bindings::WithoutGIL unlocked(pointers);
    ParallelPerceptron::counts(pointers, values, n_groups, n_threads, out);
  });
}

/// Makes LIBSDNN's tables of patterns: two lists of arrays of signs, of modified inputs and
/// modifiers. Throws std::length_error before they are made if they are too large.
py::tuple libsdnn_tables(int n_units, const std::vector<std::pair<int, int>>& inputs,
                         const ArrayArgument<std::int32_t>& pairs,
                         const std::vector<std::uint32_t>& seed, const std::string& library) {
  estimators::LibsdnnRandom random(seed, estimators::standard_library_named(library));
  std::vector<coding::RandomInverseConfig> configs;
  for (const auto& [n_bins, n_flipped] : inputs) configs.push_back({n_units, n_bins, n_flipped});
  const auto input_pairs = bindings::pairs_of(pairs);
  double n_bins_of_all = 0.0;
  for (const auto& pair : input_pairs) {
    for (const std::size_t input : {pair.modified, pair.modifier}) {
      n_bins_of_all += input < configs.size() ? configs[input].n_bins : 0;
    }
  }
  bindings::require_room_for_signs(n_bins_of_all, n_units);
  const auto tables = estimators::libsdnn_tables(configs, input_pairs, random);
  py::list modified;
  py::list modifiers;
  for (const auto& table : tables.modified) modified.append(signs_of(table));
  for (const auto& table : tables.modifiers) modifiers.append(signs_of(table));
  return py::make_tuple(modified, modifiers);
}

py::tuple libsdnn_weights(std::size_t n_units, std::size_t n_columns, int low, int high,
                          const std::vector<std::uint32_t>& seed, const std::string& library) {
  estimators::LibsdnnRandom random(seed, estimators::standard_library_named(library));
  const auto drawn = estimators::libsdnn_weights(n_units, n_columns, low, high, random);
  const auto weights = bindings::filled<std::int32_t>(
      {n_units, n_columns}, [&](auto out) { std::ranges::copy(drawn.weights, out.begin()); });
  return py::make_tuple(weights, bindings::array_of<std::int32_t>(drawn.thresholds));
}

/// Returns the names of all of `values`.
template <class Values>
py::tuple names_of(const Values& values) {
  py::list names;
  for (const auto value : values) names.append(std::string(estimators::name_of(value)));
  return py::tuple(names);
}

estimators::PDeltaRule p_delta_rule(const ParallelPerceptron& layer,
                                    const ArrayArgument<double>& targets, double share) {
  return {layer.n_units(), matrix(targets, "targets"), static_cast<std::size_t>(targets.shape(1)),
          share};
}

estimators::PerceptronRule perceptron_rule(const ParallelPerceptron& layer,
                                           const ArrayArgument<std::int32_t>& labels,
                                           std::size_t n_classes, const std::string& scheme) {
  return {layer.n_units(), bindings::vector(labels, "labels"), n_classes,
          estimators::class_scheme_named(scheme)};
}

/// Computes the potentials of an online layer's units for each row of bins. Shape: (n_rows,
/// n_units).
Matrix online_potentials_of(const estimators::OnlineLayer& layer, const Bins& bins) {
  const auto values = copied(matrix(bins, "bins", layer.layer().code().n_inputs()));
  return bindings::filled<std::int32_t>({n_rows(bins), layer.layer().n_units()}, [&](auto out) {
    bindings::wait_for_changes(layer);
    const bindings::WithoutGIL unlocked(layer);
    layer.potentials(values, out);
  });
}

/// Lets a layer learn rows of bins; returns the numbers of corrected samples and units.
template <class Rule>
std::pair<std::size_t, std::size_t> present_online(estimators::OnlineLayer& layer, const Bins& bins,
                                                   Rule rule) {
  const auto values = copied(matrix(bins, "bins", layer.layer().code().n_inputs()));
  bindings::wait_for_readers(layer);
  const bindings::WithoutGIL unlocked(layer);
  const auto count = layer.present(values, rule);
  return {count.n_samples, count.n_units};
}

void bind_online_layer(py::module_& module) {
  using estimators::OnlineLayer;
  bindings::Class<OnlineLayer>(
      module, "OnlineLayer",
      "Weights in bytes, for samples that come one at a time; the layer lags behind")
      .def(py::init<std::shared_ptr<ParallelPerceptron>>(), py::arg("layer"))
      .def(
          "learn_counts",
          [](OnlineLayer& self, const Bins& bins, const ArrayArgument<double>& targets,
             double share) {
            return present_online(self, bins, p_delta_rule(self.layer(), targets, share));
          },
          py::arg("bins"), py::arg("targets"), py::arg("share") = 1.0,
          "The p-delta rule; how many samples and units were corrected. What raises changes "
          "nothing.")
      .def(
          "learn_labels",
          [](OnlineLayer& self, const Bins& bins, const ArrayArgument<std::int32_t>& labels,
             std::size_t n_classes, const std::string& scheme) {
            return present_online(self, bins,
                                  perceptron_rule(self.layer(), labels, n_classes, scheme));
          },
          py::arg("bins"), py::arg("labels"), py::arg("n_classes"), py::arg("scheme"),
          "Error correction; how many samples and units were corrected. What raises changes "
          "nothing.")
      .def("potentials", &online_potentials_of, py::arg("bins"))
      .def(
          "synchronize",
          [](OnlineLayer& self) {
            bindings::wait_for_changes(self);
            // It changes the layer, and only reads the weights of `self`, as `potentials` does.
            const bindings::WithoutGIL unlocked(std::as_const(self), self.layer());
            self.synchronize();
          },
          "Brings the layer up to date");
}

/// Binds a trainer. Its constructor takes a layer, bins, the arguments from which `rule_of` makes
/// the rule, called `names` in Python, and settings of training.
template <class Trainer, class Rule, class... Arguments, class... Names>
void bind_trainer(py::module_& module, const char* name, const char* doc,
                  Rule (*rule_of)(const ParallelPerceptron&, Arguments...), const Names&... names) {
  const auto make = [rule_of](std::shared_ptr<ParallelPerceptron> layer, const Bins& bins,
                              Arguments... arguments, const std::string& form,
                              std::size_t memory_limit, int n_threads, std::size_t n_epochs) {
    auto rule = rule_of(*layer, arguments...);
    const auto values = copied(matrix(bins, "bins", layer->code().n_inputs()));
    const auto chosen = estimators::training_form_named(form);
    const bindings::WithoutGIL unlocked(*layer);
    return std::make_shared<Trainer>(layer, values, std::move(rule), chosen, memory_limit,
                                     n_threads, n_epochs);
  };
  bindings::Class<Trainer, std::shared_ptr<Trainer>>(module, name, doc)
      .def(py::init(make), py::arg("layer"), py::arg("bins"), names..., py::arg("form") = "auto",
           py::arg("memory_limit") = estimators::kMemoryLimit, py::arg("n_threads") = 1,
           py::arg("n_epochs") = estimators::kExpectedEpochs)
      .def_property_readonly(
          "form", [](const Trainer& self) { return std::string(estimators::name_of(self.form())); })
      .def_property_readonly("memory", &Trainer::memory, "Bytes beside the layer")
      .def(
          "present",
          [](Trainer& self, const ArrayArgument<std::int32_t>& order) {
            const auto items = copied(bindings::vector(order, "order"));
            const bindings::WithoutGIL unlocked(self, self.layer());
            const auto count = self.present(items);
            return std::pair(count.n_samples, count.n_units);
          },
          py::arg("order"),
          "Presents samples in that order; returns how many corrected something, and how many "
          "units were corrected")
      .def(
          "synchronize",
          [](Trainer& self) {
            const bindings::WithoutGIL unlocked(self, self.layer());
            self.synchronize();
          },
          "Brings the layer's weights to those of plain training in the same order");
}

}  // namespace

void bind_estimators(py::module_& module) {
  bindings::Class<ParallelPerceptron, std::shared_ptr<ParallelPerceptron>>(
      module, "ParallelPerceptron", "Units over a code, with integer weights")
      .def(py::init(&make_layer), py::arg("code"), py::arg("n_units"), py::arg("seed") = 0,
           py::arg("weights") = py::none(), py::arg("thresholds") = py::none(),
           py::arg("initial_range") = 5)
      .def_property_readonly("n_units", &ParallelPerceptron::n_units)
      .def_property_readonly("weights", &weights_of)
      .def_property_readonly("thresholds", &thresholds_of)
      .def("potentials", &potentials_of, py::arg("bins"), py::arg("n_threads") = 1)
      .def("counts", &counts_of, py::arg("bins"), py::arg("n_groups") = 1, py::arg("n_threads") = 1,
           "How many units of each group fire")
      .def(
          "copy",
          [](const ParallelPerceptron& self) { return std::make_shared<ParallelPerceptron>(self); },
          "A layer of its own with the same weights");
  module.def("counts_of_all", &counts_of_all, py::arg("layers"), py::arg("bins"),
             py::arg("n_groups") = 1, py::arg("n_threads") = 1,
             "How many units of each group fire, in each of some layers of one code");
  bind_online_layer(module);

  module.attr("TRAINING_FORMS") = names_of(estimators::kTrainingForms);
  module.attr("CLASS_SCHEMES") = names_of(estimators::kClassSchemes);
  module.def(
      "n_units_for",
      [](const std::string& scheme, std::size_t n_classes) {
        return estimators::n_units_for(estimators::class_scheme_named(scheme), n_classes);
      },
      py::arg("scheme"), py::arg("n_classes"), "Units that separate so many classes");

  bind_trainer<estimators::PDeltaTrainer>(
      module, "PDeltaTrainer", "Trains groups of units to fire in given numbers", &p_delta_rule,
      py::arg("targets"), py::arg("share") = 1.0);
  bind_trainer<estimators::PerceptronTrainer>(
      module, "PerceptronTrainer", "Trains units to separate classes", &perceptron_rule,
      py::arg("labels"), py::arg("n_classes"), py::arg("scheme"));

  module.def("libsdnn_tables", &libsdnn_tables, py::arg("n_units"), py::arg("inputs"),
             py::arg("pairs"), py::arg("seed"), py::arg("library") = "libstdc++",
             "LIBSDNN's code tables, (modified, modifiers); inputs are (n_bins, n_flipped)");
  module.def("libsdnn_weights", &libsdnn_weights, py::arg("n_units"), py::arg("n_columns"),
             py::arg("low"), py::arg("high"), py::arg("seed"), py::arg("library") = "libstdc++",
             "LIBSDNN's first (weights, thresholds)");
}
