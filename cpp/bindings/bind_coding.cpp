#include <pybind11/numpy.h>

#include "arrays.hpp"
#include "bindings.hpp"
#include "sdnn/coding/action_code.hpp"
#include "sdnn/coding/correlation_matrix.hpp"
#include "sdnn/coding/random_inverse.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/random.hpp"

namespace py = pybind11;
using namespace sdnn;

void bind_coding(py::module_& module) {
  py::class_<coding::ActionCode>(module, "ActionCode", "Windows of hidden units, one per action")
      .def(py::init<int, int, int>(), py::arg("n_hidden_units"), py::arg("n_active_units"),
           py::arg("n_actions") = 0)
      .def_property_readonly("n_actions", &coding::ActionCode::n_actions)
      .def(
          "first_unit",
          [](const coding::ActionCode& code, std::size_t action) {
            core::require(action < code.n_actions(), "action",
                          "less than " + std::to_string(code.n_actions()), action);
            return code.first_unit(action);
          },
          py::arg("action"));
  module.def(
      "action_value",
      [](std::size_t action, std::size_t n_actions, double low, double high) {
        core::require(action < n_actions, "action", "less than " + std::to_string(n_actions),
                      action);
        return coding::action_value(action, n_actions, low, high);
      },
      py::arg("action"), py::arg("n_actions"), py::arg("low"), py::arg("high"),
      "The value of an action in a range cut evenly");
  module.def(
      "random_inverse_patterns",
      [](int n_units, int n_bins, int n_flipped, std::uint64_t seed) {
        core::Random random(seed, core::Stream::code_books);
        return bindings::signs_of(
            coding::random_inverse_patterns({n_units, n_bins, n_flipped}, random));
      },
      py::arg("n_units"), py::arg("n_bins"), py::arg("n_flipped"), py::arg("seed"));
  module.def(
      "anchor_patterns",
      [](int n_units, int n_anchor_patterns, int n_interpolated, bool circular,
         std::uint64_t seed) {
        core::Random random(seed, core::Stream::code_books);
        return bindings::signs_of(coding::anchor_patterns(
            {n_units, n_anchor_patterns, n_interpolated, circular}, random));
      },
      py::arg("n_units"), py::arg("n_anchor_patterns"), py::arg("n_interpolated"),
      py::arg("circular"), py::arg("seed"));
  module.def(
      "correlation_matrix_patterns",
      [](int n_units, const bindings::ArrayArgument<double>& correlations, std::uint64_t seed) {
        const auto values = bindings::matrix(correlations, "correlations");
        core::Random random(seed, core::Stream::code_books);
        return bindings::signs_of(coding::correlation_matrix_patterns(
            n_units, values, static_cast<std::size_t>(correlations.shape(0)), random));
      },
      py::arg("n_units"), py::arg("correlations"), py::arg("seed"));
}
