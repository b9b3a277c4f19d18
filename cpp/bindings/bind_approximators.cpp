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

/// Binds the read access to the code of a network's states.
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
            const auto& units = net.state_code().permutation(mu, nu);
            return py::array_t<std::uint32_t>(static_cast<py::ssize_t>(units.size()), units.data());
          },
          py::arg("mu"), py::arg("nu"), "sigma_mu_nu: (m,)");
}

/// weight(i, j) of all units and inputs: (n, D).
template <class Weight>
py::array_t<std::int32_t> matrix(const SDNNC& network, const Weight& weight) {
  const std::size_t n_units = network.hidden_layer().n_units();
  const std::size_t n_columns = network.state_code().n_columns();
  py::array_t<std::int32_t> out({n_units, n_columns});
  std::int32_t* to = out.mutable_data();
  for (std::size_t i = 0; i < n_units; ++i) {
    for (std::size_t j = 0; j < n_columns; ++j) *to++ = weight(i, j);
  }
  return out;
}

/// threshold(i) of all units: (n,).
template <class Threshold>
py::array_t<std::int32_t> vector_of_units(const SDNNC& network, const Threshold& threshold) {
  const std::size_t n_units = network.hidden_layer().n_units();
  py::array_t<std::int32_t> out(static_cast<py::ssize_t>(n_units));
  std::int32_t* to = out.mutable_data();
  for (std::size_t i = 0; i < n_units; ++i) *to++ = threshold(i);
  return out;
}

py::array_t<std::int32_t> weights(const SDNNC& network) {
  return matrix(network, [&](std::size_t i, std::size_t j) { return network.weight(i, j); });
}

py::array_t<std::int32_t> thresholds(const SDNNC& network) {
  return vector_of_units(network,
                         [&](std::size_t i) { return network.hidden_layer().threshold(i); });
}

py::array_t<std::int32_t> averaged_weights(const SDNNC& network) {
  if (!network.has_average()) return weights(network);
  return matrix(network,
                [&](std::size_t i, std::size_t j) { return network.averaged_weight(i, j); });
}

py::array_t<std::int32_t> averaged_thresholds(const SDNNC& network) {
  if (!network.has_average()) return thresholds(network);
  return vector_of_units(network, [&](std::size_t i) { return network.averaged_threshold(i); });
}

py::array_t<std::uint32_t> first_units(const SDNNC& network) {
  const auto& actions = network.action_code();
  py::array_t<std::uint32_t> out(static_cast<py::ssize_t>(actions.n_actions()));
  std::uint32_t* unit = out.mutable_data();
  for (std::size_t action = 0; action < actions.n_actions(); ++action) {
    *unit++ = static_cast<std::uint32_t>(actions.first_unit(action));
  }
  return out;
}

py::array_t<double> output_values(const SDNNC& network) {
  const std::size_t n_counts = network.action_code().n_active_units() + 1;
  py::array_t<double> out(static_cast<py::ssize_t>(n_counts));
  double* value = out.mutable_data();
  for (std::size_t u = 0; u < n_counts; ++u) {
    *value++ = network.output_scale()(static_cast<int>(u));
  }
  return out;
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
            py::array_t<double> out(static_cast<py::ssize_t>(net.n_actions()));
            net.values(bindings::vector(state, "state"), bindings::workspace_of(net),
                       {out.mutable_data(), net.n_actions()});
            return out;
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
            const auto n = static_cast<py::ssize_t>(fired.size());
            return std::pair(py::array_t<std::size_t>(n, fired.rules.data()),
                             py::array_t<double>(n, fired.truth_values.data()));
          },
          py::arg("state"), "The rules that fire and their truth values")
      .def(
          "values",
          [](const FuzzyRules& rules, std::size_t rule) {
            core::require(rule < rules.n_rules(), "rule",
                          "less than " + std::to_string(rules.n_rules()), rule);
            const auto row = rules.values(rule);
            return py::array_t<float>(static_cast<py::ssize_t>(row.size()), row.data());
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
            py::array_t<std::int8_t> out(static_cast<py::ssize_t>(net.n_slots()));
            std::ranges::copy(workspace.code().signs(), out.mutable_data());
            return out;
          },
          py::arg("state"), "The paired code of a state, -1, 0 or +1: (n_inputs,) -> (n_slots,)")
      .def(
          "values",
          [](const LinearSDNN& net, const ArrayArgument<double>& state, std::size_t dimension) {
            core::require(dimension < net.n_dimensions(), "dimension",
                          "less than " + std::to_string(net.n_dimensions()), dimension);
            py::array_t<double> out(static_cast<py::ssize_t>(net.n_actions(dimension)));
            net.values(bindings::vector(state, "state"), bindings::workspace_of(net),
                       {out.mutable_data(), net.n_actions(dimension)}, dimension, true);
            return out;
          },
          py::arg("state"), py::arg("dimension") = 0,
          "A dimension's part of Q(state, a) for its actions, by averaged weights if there are any")
      .def(
          "weights",
          [](const LinearSDNN& net) {
            py::array_t<std::int32_t> out({net.n_rows(), net.n_slots()});
            std::ranges::copy(net.weights(), out.mutable_data());
            return out;
          },
          "A copy, in units: (n_rows, n_slots), the units of one dimension after the other");
}

void bind_rbf_network(py::module_& module) {
  bindings::bind_config<RBFNetworkConfig>(
      module, "RBFNetworkConfig",
      "The sizes of an RBF network: normalized Gaussians on an even grid, linear in the weights. "
      "The "
      "paper gives 4 bases per dimension and 601 actions; the rest are assumptions.");

  bind_network<RBFNetwork>(module, "RBFNetwork", "Q(s, a) linear in normalized Gaussian bases")
      .def(py::init<const RBFNetworkConfig&>(), py::arg("config"))
      .def_property_readonly("n_joint_bases", &RBFNetwork::n_joint_bases)
      .def(
          "weights",
          [](const RBFNetwork& net) {
            return py::array_t<double>(static_cast<py::ssize_t>(net.n_joint_bases()),
                                       net.weights().data());
          },
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
            py::array_t<std::int32_t> out(static_cast<py::ssize_t>(net.hidden_layer().n_units()));
            net.potentials(bindings::vector(state, "state"),
                           {out.mutable_data(), net.hidden_layer().n_units()});
            return out;
          },
          py::arg("state"), "Inner potentials in lattice steps; shapes (l,) -> (n,)")
      .def("weights", &weights, "A copy, in lattice steps: (n, D)")
      .def("thresholds", &thresholds, "A copy, in lattice steps: (n,)")
      .def(
          "averaged_values",
          [](const SDNNC& net, const ArrayArgument<double>& state) {
            py::array_t<double> out(static_cast<py::ssize_t>(net.n_actions()));
            net.averaged_values(bindings::vector(state, "state"), bindings::workspace_of(net),
                                {out.mutable_data(), net.n_actions()});
            return out;
          },
          py::arg("state"), "As values, by the average of the weights: (l,) -> (n_actions,)")
      .def("averaged_weights", &averaged_weights, "Their average, or the weights: (n, D)")
      .def("averaged_thresholds", &averaged_thresholds, "Their average, or the thresholds: (n,)")
      .def("first_units", &first_units, "Where the window of every action begins: (n_actions,)")
      .def("output_values", &output_values, "g(u) of u = 0 .. n' active units: (n' + 1,)")
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
