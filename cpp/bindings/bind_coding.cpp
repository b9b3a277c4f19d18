#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <cmath>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "arrays.hpp"
#include "bindings.hpp"
#include "sdnn/coding/action_code.hpp"
#include "sdnn/coding/anchor_patterns.hpp"
#include "sdnn/coding/correlation_matrix.hpp"
#include "sdnn/coding/detail/coded_samples.hpp"
#include "sdnn/coding/random_inverse.hpp"
#include "sdnn/coding/symbol_patterns.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/random.hpp"

namespace py = pybind11;
using namespace sdnn;
using bindings::ArrayArgument;
using bindings::copied;
using bindings::matrix;

namespace {

using Bins = ArrayArgument<coding::Bin>;
using Code = coding::SelectiveDesensitization;

std::shared_ptr<Code> make_code(const std::vector<ArrayArgument<std::int8_t>>& modified,
                                const std::vector<ArrayArgument<std::int8_t>>& modifiers,
                                const ArrayArgument<std::int32_t>& pairs) {
  return std::make_shared<Code>(bindings::tables_of(modified), bindings::tables_of(modifiers),
                                bindings::pairs_of(pairs));
}

/// Computes the codes of all rows of bins. Shape: (n_rows, n_columns), entries +1, 0 and -1.
py::array_t<std::int8_t> transform(const Code& code, const Bins& bins) {
  const auto values = matrix(bins, "bins", code.n_inputs());
  return bindings::filled<std::int8_t>({static_cast<std::size_t>(bins.shape(0)), code.n_columns()},
                                       [&](auto out) { coding::write_signs(code, values, out); });
}

/// Computes the inner products of the codes of all rows of `bins` and those of all rows of
/// `other_bins`, by default of `bins`. Shape: (n_rows, n_other_rows).
py::array_t<std::int32_t> gram(const Code& code, const Bins& bins,
                               const std::optional<Bins>& other_bins) {
  const auto values = copied(matrix(bins, "bins", code.n_inputs()));
  const auto others =
      other_bins ? copied(matrix(*other_bins, "other_bins", code.n_inputs())) : values;
  return bindings::filled<std::int32_t>(
      {values.size() / code.n_inputs(), others.size() / code.n_inputs()}, [&](auto out) {
        const bindings::WithoutGIL unlocked(code);
        coding::write_products(code, values, others, out);
      });
}

}  // namespace

void bind_coding(py::module_& module) {
  module.def(
      "action_value",
      [](std::size_t action, std::size_t n_actions, double low, double high) {
        core::require_below("action", action, n_actions);
        core::require(low <= high && std::isfinite(high - low), "high",
                      "at least low, and a finite distance from it", high);
        return coding::action_value(action, n_actions, low, high);
      },
      py::arg("action"), py::arg("n_actions"), py::arg("low"), py::arg("high"),
      "The value of an action in a range cut evenly");
  module.def(
      "random_inverse_patterns",
      [](int n_units, int n_bins, int n_flipped, std::uint64_t seed) {
        bindings::require_room_for_signs(n_bins, n_units);
        core::Random random(seed, core::Stream::code_books);
        return bindings::signs_of(
            coding::random_inverse_patterns({n_units, n_bins, n_flipped}, random));
      },
      py::arg("n_units"), py::arg("n_bins"), py::arg("n_flipped"), py::arg("seed"));
  module.def(
      "anchor_patterns",
      [](int n_units, int n_anchor_patterns, int n_interpolated, bool circular,
         std::uint64_t seed) {
        bindings::require_room_for_signs((n_anchor_patterns - 1.0) * (n_interpolated + 1.0),
                                         n_units);
        core::Random random(seed, core::Stream::code_books);
        return bindings::signs_of(coding::anchor_patterns({.n_units = n_units,
                                                           .n_anchor_patterns = n_anchor_patterns,
                                                           .n_interpolated = n_interpolated,
                                                           .circular = circular},
                                                          random));
      },
      py::arg("n_units"), py::arg("n_anchor_patterns"), py::arg("n_interpolated"),
      py::arg("circular"), py::arg("seed"));
  module.def(
      "symbol_patterns",
      [](int n_symbols, int n_units, std::uint64_t seed) {
        bindings::require_room_for_signs(n_symbols, n_units);
        core::Random random(seed, core::Stream::code_books);
        return bindings::signs_of(coding::symbol_patterns(n_symbols, n_units, true, random));
      },
      py::arg("n_symbols"), py::arg("n_units"), py::arg("seed"));
  module.def(
      "correlation_matrix_patterns",
      [](int n_units, const bindings::ArrayArgument<double>& correlations, std::uint64_t seed) {
        const auto values = bindings::matrix(correlations, "correlations");
        bindings::require_room_for_signs(static_cast<double>(correlations.shape(0)), n_units);
        core::Random random(seed, core::Stream::code_books);
        return bindings::signs_of(coding::correlation_matrix_patterns(
            n_units, values, static_cast<std::size_t>(correlations.shape(0)), random));
      },
      py::arg("n_units"), py::arg("correlations"), py::arg("seed"));
  bindings::Class<Code, std::shared_ptr<Code>>(module, "SelectiveDesensitization",
                                               "The desensitized code of a sample, from its bins")
      .def(py::init(&make_code), py::arg("modified"), py::arg("modifiers"), py::arg("pairs"))
      .def_property_readonly("n_inputs", &Code::n_inputs)
      .def_property_readonly("n_pairs", &Code::n_pairs)
      .def_property_readonly("n_units", &Code::n_units)
      .def_property_readonly("n_columns", &Code::n_columns)
      .def("transform", &transform, py::arg("bins"), "Entries +1, 0, -1, sample by sample")
      .def("gram", &gram, py::arg("bins"), py::arg("other_bins") = py::none(),
           "Inner products of codes");
}
