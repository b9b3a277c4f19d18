/// The actions of several environments in one array, in the number type of their action space.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "arrays.hpp"
#include "sdnn/core/detail/check.hpp"

namespace sdnn::bindings {

/// An array with a row of `n_columns` numbers for each environment, whatever its shape and type.
/// The usual types are read and written in place, others by NumPy.
class ActionRows {
 public:
  /// Takes an array as it is, and copies a list. Throws std::invalid_argument for anything else.
  ActionRows(const pybind11::object& actions, std::size_t n_columns)
      : array_(pybind11::array::ensure(actions)), n_columns_(n_columns) {
    core::require(static_cast<bool>(array_), "actions", "an array of numbers", "something else");
    const pybind11::dtype type = array_.dtype();
    const bool is_plain =
        (array_.flags() & pybind11::array::c_style) != 0 && type.byteorder() == '=';
    if (is_plain) type_ = type.num();
  }

  /// Copies row i to `numbers`.
  void read(std::size_t i, std::vector<double>& numbers) const {
    core::require_below("environments", i, n_rows());
    numbers.resize(n_columns_);
    const bool is_read = with_type([&](auto zero) {
      const auto* const row = static_cast<const decltype(zero)*>(array_.data()) + n_columns_ * i;
      for (std::size_t d = 0; d < n_columns_; ++d) numbers[d] = static_cast<double>(row[d]);
    });
    if (is_read) return;
    const typename ArrayArgument<double>::Base converted(array_);
    std::copy_n(converted.data() + n_columns_ * i, n_columns_, numbers.begin());
  }

  /// Sets row i to `numbers`, which the array's type must be able to represent.
  void write(std::size_t i, std::span<const double> numbers) {
    core::require_below("environments", i, n_rows());
    const bool is_written = with_type([&](auto zero) {
      auto* const row = static_cast<decltype(zero)*>(array_.mutable_data()) + n_columns_ * i;
      for (std::size_t d = 0; d < n_columns_; ++d) row[d] = static_cast<decltype(zero)>(numbers[d]);
    });
    if (is_written) return;
    const pybind11::object row = array_[pybind11::int_(i)];
    array_[pybind11::int_(i)] = array_of(numbers).attr("reshape")(row.attr("shape"));
  }

 private:
  std::size_t n_rows() const { return static_cast<std::size_t>(array_.size()) / n_columns_; }

  /// Calls `use` with a zero of the array's number type, so that it can access the memory as this
  /// type. Returns false, without a call, if the memory cannot be accessed so.
  bool with_type(const auto& use) const {
    if (type_ == pybind11::dtype::num_of<double>()) return use(double()), true;
    if (type_ == pybind11::dtype::num_of<float>()) return use(float()), true;
    if (type_ == pybind11::dtype::num_of<std::int64_t>()) return use(std::int64_t()), true;
    return false;
  }

  pybind11::array array_;
  std::size_t n_columns_;
  int type_ = -1;  ///< NumPy's number of the type; -1 where memory cannot be read in place
};

}  // namespace sdnn::bindings
