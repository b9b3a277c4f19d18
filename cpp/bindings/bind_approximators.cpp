#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <tuple>
#include <utility>
#include <vector>

#include "arrays.hpp"
#include "bind_config.hpp"
#include "bindings.hpp"
#include "sdnn/approximators/fuzzy_rules.hpp"
#include "sdnn/approximators/linear_sdnn.hpp"
#include "sdnn/approximators/rbf_network.hpp"
#include "sdnn/approximators/sdnn_c.hpp"
#include "workspaces.hpp"

namespace py = pybind11;
using namespace sdnn;
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

/// Binds members that describe the code of a network's states.
template <class Network>
void bind_code(py::class_<Network>& network) {
  network
      .def(
          "table",
          [](const Network& net, std::size_t input) {
            return bindings::signs_of(net.state_code().table(input));
          },
          py::arg("input"), "Patterns of an input: (n_bins, m) of -1, +1")
      .def_property_readonly(
          "pairs",
          [](const Network& net) {
            std::vector<std::pair<std::size_t, std::size_t>> pairs;
            for (const auto& pair : net.state_code().groups()) {
              pairs.emplace_back(pair.modified, pair.modifier);
            }
            return pairs;
          },
          "(mu, nu) of every group of x_SD, in its order")
      .def(
          "permutation",
          [](const Network& net, std::size_t mu, std::size_t nu) {
            return bindings::array_of(std::span(net.state_code().permutation(mu, nu)));
          },
          py::arg("mu"), py::arg("nu"), "sigma_mu_nu: (m,)");
}

/// Makes an array of number(unit, input), for all hidden units and units of x_SD. Shape: (n, D).
template <class Number>
py::array_t<std::int32_t> weight_matrix(const SDNNC& network, const Number& number) {
  const std::size_t n_units = network.hidden_layer().n_units();
  const std::size_t n_columns = network.state_code().n_columns();
  return bindings::filled<std::int32_t>({n_units, n_columns}, [&](auto out) {
    for (std::size_t k = 0; k < out.size(); ++k) out[k] = number(k / n_columns, k % n_columns);
  });
}

/// Makes an array of number(i), i = 0 .. n - 1. Shape: (n,).
template <class T, class Number>
py::array_t<T> numbers(std::size_t n, const Number& number) {
  return bindings::filled<T>({n}, [&](auto out) {
    for (std::size_t i = 0; i < n; ++i) out[i] = number(i);
  });
}

py::array_t<std::int32_t> weights(const SDNNC& network) {
  return weight_matrix(network, [&](std::size_t i, std::size_t j) { return network.weight(i, j); });
}

py::array_t<std::int32_t> thresholds(const SDNNC& network) {
  const auto& layer = network.hidden_layer();
  return numbers<std::int32_t>(layer.n_units(), [&](std::size_t i) { return layer.threshold(i); });
}

py::array_t<std::int32_t> averaged_weights(const SDNNC& network) {
  if (!network.has_average()) return weights(network);
  return weight_matrix(network,
                       [&](std::size_t i, std::size_t j) { return network.averaged_weight(i, j); });
}

py::array_t<std::int32_t> averaged_thresholds(const SDNNC& network) {
  if (!network.has_average()) return thresholds(network);
  return numbers<std::int32_t>(network.hidden_layer().n_units(),
                               [&](std::size_t i) { return network.averaged_threshold(i); });
}

/// Binds the members of all networks that give Q(s, a) for every action.
template <class Network>
py::class_<Network> bind_network(py::module_& module, const char* name, const char* doc) {
  return bindings::Class<Network>(module, name, doc)
      .def_property_readonly("config", [](const Network& net) { return net.config(); })
      .def_property_readonly("n_actions", &Network::n_actions)
      .def(
          "values",
          [](const Network& net, const ArrayArgument<double>& state) {
            return bindings::filled<double>({net.n_actions()}, [&](auto out) {
              net.values(bindings::vector(state, "state"), bindings::workspace_of(net), out);
            });
          },
          py::arg("state"), "Q(state, a) for every action; shapes (n_inputs,) -> (n_actions,)")
      .def(
          "update",
          [](Network& net, const ArrayArgument<double>& state, std::size_t action, double target,
             double rate) {
            bindings::wait_for_readers(net);
            net.update(bindings::vector(state, "state"), bindings::workspace_of(net), action,
                       target, rate);
          },
          py::arg("state"), py::arg("action"), py::arg("target"), py::arg("rate") = 1.0,
          "One correction of Q = Q(state, action) towards (1 - rate) Q + rate target");
}

void bind_fuzzy_rules(py::module_& module) {
  bindings::bind_config<FuzzyRulesConfig>(
      module, "FuzzyRulesConfig",
      "The sizes of a table of fuzzy rules; the defaults are the paper's.");

  bindings::Class<FuzzyRules>(module, "FuzzyRules", "Rules over a grid of triangular sets")
      .def(py::init<const FuzzyRulesConfig&>(), py::arg("config"))
      .def_property_readonly("n_rules", &FuzzyRules::n_rules)
      .def(
          "fire",
          [](const FuzzyRules& rules, const ArrayArgument<double>& state) {
            approximators::FiredRules fired;
            rules.fire(bindings::vector(state, "state"), fired);
            return std::pair(
                bindings::array_of<std::size_t>(std::span(fired.rules).first(fired.size())),
                bindings::array_of<double>(std::span(fired.truth_values).first(fired.size())));
          },
          py::arg("state"), "The rules that fire and their truth values")
      .def(
          "values",
          [](const FuzzyRules& rules, std::size_t rule) {
            core::require_below("rule", rule, rules.n_rules());
            return bindings::array_of(rules.values(rule));
          },
          py::arg("rule"), "A copy of v(rule, a) for every action: (n_actions,)");
}

void bind_linear_sdnn(py::module_& module) {
  bindings::bind_config<LinearSDNNConfig>(
      module, "LinearSDNNConfig",
      "Everything that defines a linear readout of the SDNN code; not in the paper.");

  bindings::Class<LinearSDNN> linear(module, "LinearSDNN",
                                     "Q(s, a) linear in the SDNN code, in integers");
  bind_code(linear);
  linear
      .def(py::init([](const LinearSDNNConfig& config, const std::vector<std::size_t>& n_actions,
                       std::uint64_t seed) { return LinearSDNN(config, n_actions, seed); }),
           py::arg("config"), py::arg("n_actions"), py::arg("seed"))
      .def_property_readonly("config", [](const LinearSDNN& net) { return net.config(); })
      .def_property_readonly("n_inputs", &LinearSDNN::n_inputs)
      .def_property_readonly("n_dimensions", &LinearSDNN::n_dimensions)
      .def_property_readonly("exponent", &LinearSDNN::exponent,
                             "A unit of values is 2 to this power; None before any reward")
      .def(
          "code",
          [](const LinearSDNN& net, const ArrayArgument<double>& state) {
            auto& workspace = bindings::workspace_of(net);
            net.read(bindings::vector(state, "state"), workspace);
            return bindings::array_of<std::int8_t>(workspace.code().signs());
          },
          py::arg("state"), "The paired code of a state, -1, 0 or +1: (n_inputs,) -> (n_slots,)")
      .def(
          "values",
          [](const LinearSDNN& net, const ArrayArgument<double>& state, std::size_t dimension) {
            core::require_below("dimension", dimension, net.n_dimensions());
            return bindings::filled<double>({net.n_actions(dimension)}, [&](auto out) {
              net.values(bindings::vector(state, "state"), bindings::workspace_of(net), out,
                         dimension, true);
            });
          },
          py::arg("state"), py::arg("dimension") = 0,
          "A dimension's part of Q(state, a) for its actions, by averaged weights if there are any")
      .def(
          "weights",
          [](const LinearSDNN& net) {
            return bindings::filled<std::int32_t>({net.n_rows(), net.n_slots()}, [&](auto out) {
              std::ranges::copy(net.weights(), out.begin());
            });
          },
          "A copy, in units: (n_rows, n_slots), the units of one dimension after the other");
}

void bind_rbf_network(py::module_& module) {
  bindings::bind_config<RBFNetworkConfig>(
      module, "RBFNetworkConfig",
      "The sizes of an RBF network: normalized Gaussians on an even grid, linear in the weights. "
      "The paper gives 4 bases per dimension and 601 actions; the rest are assumptions.");

  bind_network<RBFNetwork>(module, "RBFNetwork", "Q(s, a) linear in normalized Gaussian bases")
      .def(py::init<const RBFNetworkConfig&>(), py::arg("config"))
      .def(
          "weights", [](const RBFNetwork& net) { return bindings::array_of(net.weights()); },
          "A copy, row-major over inputs and action: (n_bases^(d+1),)")
      .def(
          "set_weights",
          [](RBFNetwork& net, const ArrayArgument<double>& new_weights) {
            bindings::wait_for_readers(net);
            net.set_weights(bindings::vector(new_weights, "weights"));
          },
          py::arg("weights"));
}

}  // namespace

void bind_approximators(py::module_& module) {
  bindings::bind_config<SDNNCConfig>(
      module, "SDNNCConfig",
      "Everything that defines an SDNN-C; the defaults are the paper's values.")
      .def_property_readonly(
          "n_pairs",
          [](const SDNNCConfig& config) { return config.n_inputs * coding::n_partners_of(config); },
          "Pairs of inputs that are formed; the code has n_pattern_units for each.")
      .def_property_readonly(
          "n_code_bytes",
          [](const SDNNCConfig& config) {
            return static_cast<std::uint64_t>(
                coding::pattern_bytes_of(config, coding::n_bins_of(config)));
          },
          "Bytes of the patterns, by anchors and of symbols, plain and permuted.");

  auto sdnn_c =
      bind_network<SDNNC>(module, "SDNNC", "A network that gives Q(s, a) for every action at once");
  bind_code(sdnn_c);
  sdnn_c.def(py::init<const SDNNCConfig&, std::uint64_t>(), py::arg("config"), py::arg("seed"))
      .def(py::init([](const SDNNCConfig& config, std::uint64_t seed,
                       const std::vector<ArrayArgument<std::int8_t>>& tables) {
             return SDNNC(config, bindings::tables_of(tables), seed);
           }),
           py::arg("config"), py::arg("seed"), py::arg("tables"),
           "With the patterns of each input: (n_bins, m) of -1, +1")
      .def_property_readonly("n_inputs", &SDNNC::n_inputs)
      .def_property_readonly("u_low", [](const SDNNC& net) { return net.output_scale().u_low(); })
      .def_property_readonly("u_high", [](const SDNNC& net) { return net.output_scale().u_high(); })
      .def(
          "value",
          [](const SDNNC& net, const ArrayArgument<double>& state, std::size_t action) {
            return net.value(bindings::vector(state, "state"), bindings::workspace_of(net), action);
          },
          py::arg("state"), py::arg("action"))
      .def(
          "potentials",
          [](const SDNNC& net, const ArrayArgument<double>& state) {
            return bindings::filled<std::int32_t>({net.hidden_layer().n_units()}, [&](auto out) {
              net.potentials(bindings::vector(state, "state"), out);
            });
          },
          py::arg("state"), "Inner potentials in lattice steps; shapes (l,) -> (n,)")
      .def("weights", &weights, "A copy, in lattice steps: (n, D)")
      .def("thresholds", &thresholds, "A copy, in lattice steps: (n,)")
      .def(
          "averaged_values",
          [](const SDNNC& net, const ArrayArgument<double>& state) {
            return bindings::filled<double>({net.n_actions()}, [&](auto out) {
              net.averaged_values(bindings::vector(state, "state"), bindings::workspace_of(net),
                                  out);
            });
          },
          py::arg("state"), "As values, by the average of the weights: (l,) -> (n_actions,)")
      .def("averaged_weights", &averaged_weights, "Their average, or the weights: (n, D)")
      .def("averaged_thresholds", &averaged_thresholds, "Their average, or the thresholds: (n,)")
      .def(
          "first_units",
          [](const SDNNC& net) {
            const auto& actions = net.action_code();
            return numbers<std::uint32_t>(actions.n_actions(), [&](std::size_t action) {
              return static_cast<std::uint32_t>(actions.first_unit(action));
            });
          },
          "Where the window of every action begins: (n_actions,)")
      .def(
          "output_values",
          [](const SDNNC& net) {
            return numbers<double>(net.action_code().n_active_units() + 1, [&](std::size_t u) {
              return net.output_scale()(static_cast<int>(u));
            });
          },
          "g(u) of u = 0 .. n' active units: (n' + 1,)")
      .def_property_readonly(
          "output_range",
          [](const SDNNC& net) {
            const auto& scale = net.output_scale();
            return std::pair(scale.q_low(), scale.q_high());
          },
          "(q_low, q_high) as they are now")
      .def_property_readonly(
          "value_step", [](const SDNNC& net) { return net.output_scale().step(); },
          "What one active unit more is worth")
      .def_property_readonly(
          "mean_error", [](const SDNNC& net) { return net.correction_counts().mean_error; },
          "How far targets, clipped to the range, were from values: of the last thousand or so")
      .def_property_readonly(
          "correction_counts",
          [](const SDNNC& net) {
            const auto& counts = net.correction_counts();
            return std::tuple(counts.changed, counts.rounded_away, counts.out_of_range,
                              counts.asked);
          },
          "Corrections that changed units, that were rounded to no change, "
          "that wanted values outside the range, and all of them")
      .def(
          "set_parameters",
          [](SDNNC& net, const ArrayArgument<std::int32_t>& new_weights,
             const ArrayArgument<std::int32_t>& new_thresholds) {
            bindings::wait_for_readers(net);
            net.set_parameters(bindings::flat(new_weights), bindings::flat(new_thresholds));
          },
          py::arg("weights"), py::arg("thresholds"));

  bind_fuzzy_rules(module);
  bind_rbf_network(module);
  bind_linear_sdnn(module);
}
