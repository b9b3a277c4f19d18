#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include "arrays.hpp"
#include "bind_config.hpp"
#include "bindings.hpp"
#include "sdnn/approximators/dynamic_sdnn_c.hpp"
#include "sdnn/approximators/fuzzy_rules.hpp"
#include "sdnn/approximators/rbf_network.hpp"

namespace py = pybind11;
using namespace sdnn;
using approximators::DynamicSDNNC;
using approximators::FuzzyRules;
using approximators::FuzzyRulesConfig;
using approximators::RBFNetwork;
using approximators::RBFNetworkConfig;
using approximators::SDNNCConfig;
using bindings::ArrayArgument;

namespace {

py::array_t<std::int8_t> code_book(const DynamicSDNNC& network, std::size_t input) {
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

py::array_t<std::uint32_t> permutation(const DynamicSDNNC& network, std::size_t mu,
                                       std::size_t nu) {
  return network.visit([&](const auto& net) {
    const auto& units = net.state_code().permutation(mu, nu);
    return py::array_t<std::uint32_t>(static_cast<py::ssize_t>(units.size()), units.data());
  });
}

py::array_t<std::int32_t> weights(const DynamicSDNNC& network) {
  return network.visit([](const auto& net) {
    const std::size_t n_units = net.hidden_layer().n_units();
    const std::size_t n_columns = net.hidden_layer().n_columns();
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

py::array_t<std::int32_t> thresholds(const DynamicSDNNC& network) {
  const auto& hidden_layer = network.hidden_layer();
  py::array_t<std::int32_t> out(static_cast<py::ssize_t>(hidden_layer.n_units()));
  for (std::size_t i = 0; i < hidden_layer.n_units(); ++i) {
    out.mutable_at(static_cast<py::ssize_t>(i)) = hidden_layer.threshold(i);
  }
  return out;
}

void bind_fuzzy_rules(py::module_& module) {
  bindings::bind_config<FuzzyRulesConfig>(module, "FuzzyRulesConfig",
                                          "The sizes of a table of fuzzy rules");

  py::class_<FuzzyRules>(module, "FuzzyRules", "Rules over a grid of triangular sets")
      .def(py::init<const FuzzyRulesConfig&>(), py::arg("config"))
      .def_property_readonly("config", [](const FuzzyRules& rules) { return rules.config(); })
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

void bind_rbf_network(py::module_& module) {
  bindings::bind_config<RBFNetworkConfig>(module, "RBFNetworkConfig",
                                          "The sizes of an RBF network");

  py::class_<RBFNetwork>(module, "RBFNetwork", "Q(s, a) linear in normalized Gaussian bases")
      .def(py::init<const RBFNetworkConfig&>(), py::arg("config"))
      .def_property_readonly("config", [](const RBFNetwork& net) { return net.config(); })
      .def_property_readonly("n_inputs", &RBFNetwork::n_inputs)
      .def_property_readonly("n_actions", &RBFNetwork::n_actions)
      .def_property_readonly("n_joint_bases", &RBFNetwork::n_joint_bases)
      .def(
          "values",
          [](RBFNetwork& net, const ArrayArgument<double>& state) {
            py::array_t<double> out(static_cast<py::ssize_t>(net.n_actions()));
            net.values(bindings::vector(state, "state"), {out.mutable_data(), net.n_actions()});
            return out;
          },
          py::arg("state"), "Q(state, a) for every action; shapes (d,) -> (n_actions,)")
      .def(
          "values_plainly",
          [](RBFNetwork& net, const ArrayArgument<double>& state) {
            py::array_t<double> out(static_cast<py::ssize_t>(net.n_actions()));
            net.values_plainly(bindings::vector(state, "state"),
                               {out.mutable_data(), net.n_actions()});
            return out;
          },
          py::arg("state"), "The same as values, from every joint basis of every action")
      .def(
          "value",
          [](RBFNetwork& net, const ArrayArgument<double>& state, std::size_t action) {
            return net.value(bindings::vector(state, "state"), action);
          },
          py::arg("state"), py::arg("action"))
      .def(
          "correct",
          [](RBFNetwork& net, const ArrayArgument<double>& state, std::size_t action,
             double target) { net.correct(bindings::vector(state, "state"), action, target); },
          py::arg("state"), py::arg("action"), py::arg("target"),
          "One gradient step of Q(state, action) towards target")
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
            net.set_weights(bindings::vector(new_weights, "weights"));
          },
          py::arg("weights"));
}

}  // namespace

void bind_approximators(py::module_& module) {
  py::enum_<approximators::InitialWeights>(module, "InitialWeights", "How the weights start")
      .value("ternary", approximators::InitialWeights::ternary)
      .value("uniform", approximators::InitialWeights::uniform);
  bindings::bind_config<SDNNCConfig>(module, "SDNNCConfig", "Everything that defines an SDNN-C");

  py::class_<DynamicSDNNC>(module, "SDNNC", "A network that gives Q(s, a) for every action at once")
      .def(py::init<const SDNNCConfig&, std::uint64_t>(), py::arg("config"), py::arg("seed"))
      .def_property_readonly("config", [](const DynamicSDNNC& net) { return net.config(); })
      .def_property_readonly("n_inputs", &DynamicSDNNC::n_inputs)
      .def_property_readonly("n_actions", &DynamicSDNNC::n_actions)
      .def_property_readonly("u_low",
                             [](const DynamicSDNNC& net) { return net.output_scale().u_low(); })
      .def_property_readonly("u_high",
                             [](const DynamicSDNNC& net) { return net.output_scale().u_high(); })
      .def_property_readonly("n_carries",
                             [](const DynamicSDNNC& net) { return net.hidden_layer().n_carries(); })
      .def(
          "first_unit",
          [](const DynamicSDNNC& net, std::size_t action) {
            core::require(action < net.n_actions(), "action",
                          "less than " + std::to_string(net.n_actions()), action);
            return net.action_code().first_unit(action);
          },
          py::arg("action"))
      .def(
          "values",
          [](DynamicSDNNC& net, const ArrayArgument<double>& state) {
            py::array_t<double> out(static_cast<py::ssize_t>(net.n_actions()));
            net.values(bindings::vector(state, "state"), {out.mutable_data(), net.n_actions()});
            return out;
          },
          py::arg("state"), "Q(state, a) for every action; shapes (l,) -> (n_actions,)")
      .def(
          "value",
          [](DynamicSDNNC& net, const ArrayArgument<double>& state, std::size_t action) {
            return net.value(bindings::vector(state, "state"), action);
          },
          py::arg("state"), py::arg("action"))
      .def(
          "correct",
          [](DynamicSDNNC& net, const ArrayArgument<double>& state, std::size_t action,
             double target) { net.correct(bindings::vector(state, "state"), action, target); },
          py::arg("state"), py::arg("action"), py::arg("target"),
          "One step of error correction of Q(state, action) towards target")
      .def(
          "potentials",
          [](const DynamicSDNNC& net, const ArrayArgument<double>& state) {
            py::array_t<std::int32_t> out(static_cast<py::ssize_t>(net.hidden_layer().n_units()));
            net.potentials(bindings::vector(state, "state"),
                           {out.mutable_data(), net.hidden_layer().n_units()});
            return out;
          },
          py::arg("state"), "Inner potentials in lattice steps; shapes (l,) -> (n,)")
      .def("code_book", &code_book, py::arg("input"), "Patterns of an input: (n_bins, m) of -1, +1")
      .def("permutation", &permutation, py::arg("mu"), py::arg("nu"), "sigma_mu_nu: (m,)")
      .def("weights", &weights, "A copy, in lattice steps: (n, D)")
      .def("thresholds", &thresholds, "A copy, in lattice steps: (n,)")
      .def(
          "set_parameters",
          [](DynamicSDNNC& net, const ArrayArgument<std::int32_t>& new_weights,
             const ArrayArgument<std::int32_t>& new_thresholds) {
            net.set_parameters(bindings::flat(new_weights), bindings::flat(new_thresholds));
          },
          py::arg("weights"), py::arg("thresholds"));

  bind_fuzzy_rules(module);
  bind_rbf_network(module);
}
