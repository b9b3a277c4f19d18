#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include "arrays.hpp"
#include "bindings.hpp"
#include "sdnn/approximators/dynamic_sdnn_c.hpp"
#include "sdnn/approximators/fuzzy_rules.hpp"
#include "sdnn/approximators/rbf_network.hpp"

namespace py = pybind11;
using namespace sdnn;
using approximators::DynamicSdnnC;
using approximators::FuzzyRules;
using approximators::FuzzyRulesConfig;
using approximators::RbfNetwork;
using approximators::RbfNetworkConfig;
using approximators::SdnnCConfig;
using bindings::ArrayArgument;

namespace {

py::array_t<std::int8_t> code_book(const DynamicSdnnC& network, std::size_t input) {
  return network.visit([&](const auto& net) {
    const auto& book = net.state_code().book(input);
    py::array_t<std::int8_t> out({book.n_bins(), book.n_pattern_units()});
    auto view = out.mutable_unchecked<2>();
    for (std::size_t bin = 0; bin < book.n_bins(); ++bin) {
      for (std::size_t k = 0; k < book.n_pattern_units(); ++k) {
        view(static_cast<py::ssize_t>(bin), static_cast<py::ssize_t>(k)) =
            book[static_cast<coding::Bin>(bin)][k] ? 1 : -1;
      }
    }
    return out;
  });
}

py::array_t<std::uint32_t> permutation(const DynamicSdnnC& network, std::size_t mu,
                                       std::size_t nu) {
  return network.visit([&](const auto& net) {
    const auto& units = net.state_code().permutation(mu, nu);
    return py::array_t<std::uint32_t>(static_cast<py::ssize_t>(units.size()), units.data());
  });
}

py::array_t<std::int32_t> weights(const DynamicSdnnC& network) {
  return network.visit([](const auto& net) {
    const std::size_t n_units = net.perceptron().n_units();
    const std::size_t n_columns = net.perceptron().n_columns();
    py::array_t<std::int32_t> out({n_units, n_columns});
    auto view = out.mutable_unchecked<2>();
    for (std::size_t i = 0; i < n_units; ++i) {
      for (std::size_t j = 0; j < n_columns; ++j) {
        view(static_cast<py::ssize_t>(i), static_cast<py::ssize_t>(j)) = net.weight(i, j);
      }
    }
    return out;
  });
}

py::array_t<std::int32_t> thresholds(const DynamicSdnnC& network) {
  const auto& perceptron = network.perceptron();
  py::array_t<std::int32_t> out(static_cast<py::ssize_t>(perceptron.n_units()));
  for (std::size_t i = 0; i < perceptron.n_units(); ++i) {
    out.mutable_at(static_cast<py::ssize_t>(i)) = perceptron.threshold(i);
  }
  return out;
}

void bind_fuzzy_rules(py::module_& module) {
  const FuzzyRulesConfig defaults;
  py::class_<FuzzyRulesConfig>(module, "FuzzyRulesConfig", "The sizes of a table of fuzzy rules")
      .def(py::init([](int n_inputs, int n_sets, int n_actions, std::uint64_t max_table_bytes) {
             return FuzzyRulesConfig{n_inputs, n_sets, n_actions, max_table_bytes};
           }),
           py::kw_only(), py::arg("n_inputs") = defaults.n_inputs,
           py::arg("n_sets") = defaults.n_sets, py::arg("n_actions") = defaults.n_actions,
           py::arg("max_table_bytes") = defaults.max_table_bytes)
      .def_readonly("n_inputs", &FuzzyRulesConfig::n_inputs)
      .def_readonly("n_sets", &FuzzyRulesConfig::n_sets)
      .def_readonly("n_actions", &FuzzyRulesConfig::n_actions)
      .def_readonly("max_table_bytes", &FuzzyRulesConfig::max_table_bytes);

  py::class_<FuzzyRules>(module, "FuzzyRules", "Rules over a grid of triangular sets")
      .def(py::init<const FuzzyRulesConfig&>(), py::arg("config"))
      .def_property_readonly("config", [](const FuzzyRules& rules) { return rules.config(); })
      .def_property_readonly("n_rules", &FuzzyRules::n_rules)
      .def("fire",
           [](const FuzzyRules& rules, const ArrayArgument<double>& state) {
             approximators::FiredRules fired;
             rules.fire(bindings::vector(state, "state"), fired);
             const auto n = static_cast<py::ssize_t>(fired.size());
             return std::pair(py::array_t<std::size_t>(n, fired.rules.data()),
                              py::array_t<double>(n, fired.truth_values.data()));
           },
           py::arg("state"), "The rules that fire and their truth values")
      .def("values",
           [](const FuzzyRules& rules, std::size_t rule) {
             core::require(rule < rules.n_rules(), "rule",
                           "less than " + std::to_string(rules.n_rules()), rule);
             const auto row = rules.values(rule);
             return py::array_t<float>(static_cast<py::ssize_t>(row.size()), row.data());
           },
           py::arg("rule"), "A copy of v(rule, a) for every action: (n_actions,)");
}

void bind_rbf_network(py::module_& module) {
  const RbfNetworkConfig defaults;
  py::class_<RbfNetworkConfig>(module, "RbfNetworkConfig", "The sizes of an RBF network")
      .def(py::init([](int n_inputs, int n_bases, int n_actions, double width,
                       double gradient_rate, std::uint64_t max_table_bytes) {
             return RbfNetworkConfig{n_inputs, n_bases, n_actions, width, gradient_rate,
                                     max_table_bytes};
           }),
           py::kw_only(), py::arg("n_inputs") = defaults.n_inputs,
           py::arg("n_bases") = defaults.n_bases, py::arg("n_actions") = defaults.n_actions,
           py::arg("width") = defaults.width, py::arg("gradient_rate") = defaults.gradient_rate,
           py::arg("max_table_bytes") = defaults.max_table_bytes)
      .def_readonly("n_inputs", &RbfNetworkConfig::n_inputs)
      .def_readonly("n_bases", &RbfNetworkConfig::n_bases)
      .def_readonly("n_actions", &RbfNetworkConfig::n_actions)
      .def_readonly("width", &RbfNetworkConfig::width)
      .def_readonly("gradient_rate", &RbfNetworkConfig::gradient_rate)
      .def_readonly("max_table_bytes", &RbfNetworkConfig::max_table_bytes);

  py::class_<RbfNetwork>(module, "RbfNetwork", "Q(s, a) linear in normalized Gaussian bases")
      .def(py::init<const RbfNetworkConfig&>(), py::arg("config"))
      .def_property_readonly("config", [](const RbfNetwork& net) { return net.config(); })
      .def_property_readonly("n_inputs", &RbfNetwork::n_inputs)
      .def_property_readonly("n_actions", &RbfNetwork::n_actions)
      .def_property_readonly("n_joint_bases", &RbfNetwork::n_joint_bases)
      .def("values",
           [](RbfNetwork& net, const ArrayArgument<double>& state) {
             py::array_t<double> out(static_cast<py::ssize_t>(net.n_actions()));
             net.values(bindings::vector(state, "state"), {out.mutable_data(), net.n_actions()});
             return out;
           },
           py::arg("state"), "Q(state, a) for every action; shapes (d,) -> (n_actions,)")
      .def("values_plainly",
           [](RbfNetwork& net, const ArrayArgument<double>& state) {
             py::array_t<double> out(static_cast<py::ssize_t>(net.n_actions()));
             net.values_plainly(bindings::vector(state, "state"),
                                {out.mutable_data(), net.n_actions()});
             return out;
           },
           py::arg("state"), "The same as values, from every joint basis of every action")
      .def("value",
           [](RbfNetwork& net, const ArrayArgument<double>& state, std::size_t action) {
             return net.value(bindings::vector(state, "state"), action);
           },
           py::arg("state"), py::arg("action"))
      .def("correct",
           [](RbfNetwork& net, const ArrayArgument<double>& state, std::size_t action,
              double target) { net.correct(bindings::vector(state, "state"), action, target); },
           py::arg("state"), py::arg("action"), py::arg("target"),
           "One gradient step of Q(state, action) towards target")
      .def("weights",
           [](const RbfNetwork& net) {
             return py::array_t<double>(static_cast<py::ssize_t>(net.n_joint_bases()),
                                        net.weights().data());
           },
           "A copy, row-major over inputs and action: (n_bases^(d+1),)")
      .def("set_weights",
           [](RbfNetwork& net, const ArrayArgument<double>& new_weights) {
             net.set_weights(bindings::vector(new_weights, "weights"));
           },
           py::arg("weights"));
}

}  // namespace

void bind_approximators(py::module_& module) {
  const SdnnCConfig defaults;
  py::enum_<approximators::InitialWeights>(module, "InitialWeights", "How the weights start")
      .value("ternary", approximators::InitialWeights::ternary)
      .value("uniform", approximators::InitialWeights::uniform);
  py::class_<SdnnCConfig>(module, "SdnnCConfig", "Everything that defines an SDNN-C")
      .def(py::init([](int n_inputs, int n_pattern_units, int n_anchor_patterns,
                       int n_interpolated, bool balanced_anchors, std::vector<bool> circular,
                       int n_hidden_units, int n_active_units, int n_actions, double q_low,
                       double q_high, std::optional<int> u_low, std::optional<int> u_high,
                       double learning_coefficient, int lattice, double initial_threshold,
                       approximators::InitialWeights initial_weights,
                       double initial_weight_limit) {
             return SdnnCConfig{n_inputs,         n_pattern_units,  n_anchor_patterns,
                                n_interpolated,   balanced_anchors, std::move(circular),
                                n_hidden_units,   n_active_units,   n_actions,
                                q_low,            q_high,           u_low,
                                u_high,           learning_coefficient, lattice,
                                initial_threshold, initial_weights, initial_weight_limit};
           }),
           py::kw_only(), py::arg("n_inputs") = defaults.n_inputs,
           py::arg("n_pattern_units") = defaults.n_pattern_units,
           py::arg("n_anchor_patterns") = defaults.n_anchor_patterns,
           py::arg("n_interpolated") = defaults.n_interpolated,
           py::arg("balanced_anchors") = defaults.balanced_anchors,
           py::arg("circular") = defaults.circular,
           py::arg("n_hidden_units") = defaults.n_hidden_units,
           py::arg("n_active_units") = defaults.n_active_units,
           py::arg("n_actions") = defaults.n_actions, py::arg("q_low") = defaults.q_low,
           py::arg("q_high") = defaults.q_high, py::arg("u_low") = defaults.u_low,
           py::arg("u_high") = defaults.u_high,
           py::arg("learning_coefficient") = defaults.learning_coefficient,
           py::arg("lattice") = defaults.lattice,
           py::arg("initial_threshold") = defaults.initial_threshold,
           py::arg("initial_weights") = defaults.initial_weights,
           py::arg("initial_weight_limit") = defaults.initial_weight_limit)
      .def_readonly("n_inputs", &SdnnCConfig::n_inputs)
      .def_readonly("n_pattern_units", &SdnnCConfig::n_pattern_units)
      .def_readonly("n_anchor_patterns", &SdnnCConfig::n_anchor_patterns)
      .def_readonly("n_interpolated", &SdnnCConfig::n_interpolated)
      .def_readonly("balanced_anchors", &SdnnCConfig::balanced_anchors)
      .def_readonly("circular", &SdnnCConfig::circular)
      .def_readonly("n_hidden_units", &SdnnCConfig::n_hidden_units)
      .def_readonly("n_active_units", &SdnnCConfig::n_active_units)
      .def_readonly("n_actions", &SdnnCConfig::n_actions)
      .def_readonly("q_low", &SdnnCConfig::q_low)
      .def_readonly("q_high", &SdnnCConfig::q_high)
      .def_readonly("u_low", &SdnnCConfig::u_low)
      .def_readonly("u_high", &SdnnCConfig::u_high)
      .def_readonly("learning_coefficient", &SdnnCConfig::learning_coefficient)
      .def_readonly("lattice", &SdnnCConfig::lattice)
      .def_readonly("initial_threshold", &SdnnCConfig::initial_threshold)
      .def_readonly("initial_weights", &SdnnCConfig::initial_weights)
      .def_readonly("initial_weight_limit", &SdnnCConfig::initial_weight_limit);

  py::class_<DynamicSdnnC>(module, "SdnnC", "A network that gives Q(s, a) for every action at once")
      .def(py::init<const SdnnCConfig&, std::uint64_t>(), py::arg("config"), py::arg("seed"))
      .def_property_readonly("config", [](const DynamicSdnnC& net) { return net.config(); })
      .def_property_readonly("n_inputs", &DynamicSdnnC::n_inputs)
      .def_property_readonly("n_actions", &DynamicSdnnC::n_actions)
      .def_property_readonly("u_low",
                             [](const DynamicSdnnC& net) { return net.output_scale().u_low(); })
      .def_property_readonly("u_high",
                             [](const DynamicSdnnC& net) { return net.output_scale().u_high(); })
      .def_property_readonly(
          "n_carries",
          [](const DynamicSdnnC& net) { return net.perceptron().n_carries(); })
      .def("first_unit",
           [](const DynamicSdnnC& net, std::size_t action) {
             core::require(action < net.n_actions(), "action",
                           "less than " + std::to_string(net.n_actions()), action);
             return net.action_code().first_unit(action);
           },
           py::arg("action"))
      .def("values",
           [](DynamicSdnnC& net, const ArrayArgument<double>& state) {
             py::array_t<double> out(static_cast<py::ssize_t>(net.n_actions()));
             net.values(bindings::vector(state, "state"), {out.mutable_data(), net.n_actions()});
             return out;
           },
           py::arg("state"), "Q(state, a) for every action; shapes (l,) -> (n_actions,)")
      .def("value",
           [](DynamicSdnnC& net, const ArrayArgument<double>& state, std::size_t action) {
             return net.value(bindings::vector(state, "state"), action);
           },
           py::arg("state"), py::arg("action"))
      .def("correct",
           [](DynamicSdnnC& net, const ArrayArgument<double>& state, std::size_t action,
              double target) { net.correct(bindings::vector(state, "state"), action, target); },
           py::arg("state"), py::arg("action"), py::arg("target"),
           "One step of error correction of Q(state, action) towards target")
      .def("potentials",
           [](const DynamicSdnnC& net, const ArrayArgument<double>& state) {
             py::array_t<std::int32_t> out(
                 static_cast<py::ssize_t>(net.perceptron().n_units()));
             net.potentials(bindings::vector(state, "state"),
                            {out.mutable_data(), net.perceptron().n_units()});
             return out;
           },
           py::arg("state"), "Inner potentials in lattice steps; shapes (l,) -> (n,)")
      .def("code_book", &code_book, py::arg("input"), "Patterns of an input: (n_bins, m) of -1, +1")
      .def("permutation", &permutation, py::arg("mu"), py::arg("nu"), "sigma_mu_nu: (m,)")
      .def("weights", &weights, "A copy, in lattice steps: (n, D)")
      .def("thresholds", &thresholds, "A copy, in lattice steps: (n,)")
      .def("set_parameters",
           [](DynamicSdnnC& net, const ArrayArgument<std::int32_t>& new_weights,
              const ArrayArgument<std::int32_t>& new_thresholds) {
             net.set_parameters(bindings::flat(new_weights), bindings::flat(new_thresholds));
           },
           py::arg("weights"), py::arg("thresholds"));

  bind_fuzzy_rules(module);
  bind_rbf_network(module);
}
