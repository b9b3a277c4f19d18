/// Conversions between NumPy arrays and spans: arguments become views, results are copies.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "sdnn/coding/pattern_table.hpp"
#include "sdnn/coding/selective_desensitization.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/detail/grid_cells.hpp"
#include "sdnn/core/detail/interruption.hpp"

namespace sdnn::bindings {

/// An argument that becomes a C-contiguous array of `T`, converted if need be. Unlike pybind11's
/// array_t, it makes no empty array before it is loaded.
template <class T>
class ArrayArgument
    : public pybind11::array_t<T, pybind11::array::c_style | pybind11::array::forcecast> {
 public:
  using Base = pybind11::array_t<T, pybind11::array::c_style | pybind11::array::forcecast>;

  ArrayArgument() : Base(pybind11::handle(), typename Base::stolen_t()) {}

  /// Takes a C-contiguous array of `T` as it is, or with `convert` makes one from another object.
  /// Returns false, without a Python error, if that is impossible.
  bool load(pybind11::handle source, bool convert) {
    const bool fits = Base::check_(source);
    if (!fits && !convert) return false;
    auto& self = static_cast<pybind11::object&>(*this);
    if (fits) {
      self = pybind11::reinterpret_borrow<pybind11::object>(source);
    } else {
      self = Base::ensure(source);
    }
    return static_cast<bool>(self);
  }
};

/// The items of an array, whatever its shape.
template <class T>
std::span<const T> flat(const ArrayArgument<T>& array) {
  return {array.data(), static_cast<std::size_t>(array.size())};
}

/// Returns a copy of an array's items, for work without the GIL, during which other threads may
/// change the array.
template <class T>
std::vector<T> copied(std::span<const T> items) {
  return {items.begin(), items.end()};
}

/// The items of a one-dimensional array. Throws std::invalid_argument naming the argument.
template <class T>
std::span<const T> vector(const ArrayArgument<T>& array, const char* name) {
  if (array.ndim() != 1) {
    throw std::invalid_argument(std::string(name) + " must have one dimension, got " +
                                std::to_string(array.ndim()));
  }
  return flat(array);
}

/// The items of a two-dimensional array, row by row. Throws std::invalid_argument naming the
/// argument if it has another number of dimensions, or of columns unless n_columns is 0.
template <class T>
std::span<const T> matrix(const ArrayArgument<T>& array, const char* name,
                          std::size_t n_columns = 0) {
  core::require(array.ndim() == 2, name, "an array of two dimensions", array.ndim());
  core::require(n_columns == 0 || static_cast<std::size_t>(array.shape(1)) == n_columns, name,
                "an array of " + std::to_string(n_columns) + " columns", array.shape(1));
  return bindings::flat(array);
}

/// Returns a NumPy array with a copy of the numbers. Shape: (n,).
template <class T>
pybind11::array_t<T> array_of(std::span<const T> numbers) {
  return pybind11::array_t<T>(static_cast<pybind11::ssize_t>(numbers.size()), numbers.data());
}

/// Returns a new array of a shape, whose numbers fill(span) writes, row by row.
template <class T, class Fill>
pybind11::array_t<T> filled(const std::vector<std::size_t>& shape, const Fill& fill) {
  pybind11::array_t<T> array(shape);
  fill(std::span<T>(array.mutable_data(), static_cast<std::size_t>(array.size())));
  return array;
}

/// Throws std::length_error unless `n_bins` patterns of `n_units` signs fit into an array of 1 GiB.
/// Call it before the patterns are made. The numbers are doubles because they are not checked yet.
inline void require_room_for_signs(double n_bins, double n_units) {
  core::require_bytes("n_units or n_bins", "the patterns, a byte for each unit,", n_bins * n_units,
                      core::kDefaultMaxTableBytes);
}

/// Returns the patterns of a table as signs, +1 and -1. Shape: (n_bins, n_units).
inline pybind11::array_t<std::int8_t> signs_of(const coding::PatternTable& table) {
  return filled<std::int8_t>({table.n_bins(), table.n_units()}, [&](auto signs) {
    auto sign = signs.begin();
    for (std::size_t bin = 0; bin < table.n_bins(); ++bin) {
      core::interruption_point();
      for (std::size_t k = 0; k < table.n_units(); ++k) {
        *sign++ = static_cast<std::int8_t>(table.sign(bin, k));
      }
    }
  });
}

/// Makes a table of patterns from signs, +1 and -1. Shape: (n_bins, n_units).
inline coding::PatternTable table_of(const ArrayArgument<std::int8_t>& signs) {
  const auto values = matrix(signs, "patterns");
  return coding::PatternTable::from_signs(values, static_cast<std::size_t>(signs.shape(0)),
                                          static_cast<std::size_t>(signs.shape(1)));
}

/// Makes a table of patterns for each input. Shapes: (n_bins, n_units) each.
inline std::vector<coding::PatternTable> tables_of(
    const std::vector<ArrayArgument<std::int8_t>>& signs) {
  std::vector<coding::PatternTable> tables;
  for (const auto& input : signs) tables.push_back(table_of(input));
  return tables;
}

/// Reads pairs (modified, modifier) of inputs. Shape: (n_pairs, 2). Throws std::invalid_argument
/// for negative numbers.
inline std::vector<coding::InputPair> pairs_of(const ArrayArgument<std::int32_t>& pairs) {
  const auto inputs = matrix(pairs, "pairs", 2);
  std::vector<coding::InputPair> input_pairs;
  for (std::size_t p = 0; p < inputs.size(); p += 2) {
    core::require(inputs[p] >= 0 && inputs[p + 1] >= 0, "pairs", "inputs of 0 or more",
                  std::min(inputs[p], inputs[p + 1]));
    input_pairs.push_back(
        {static_cast<std::size_t>(inputs[p]), static_cast<std::size_t>(inputs[p + 1])});
  }
  return input_pairs;
}

}  // namespace sdnn::bindings

namespace pybind11::detail {

template <class T>
struct pyobject_caster<sdnn::bindings::ArrayArgument<T>> {
  PYBIND11_TYPE_CASTER(sdnn::bindings::ArrayArgument<T>,
                       handle_type_name<typename sdnn::bindings::ArrayArgument<T>::Base>::name);
  bool load(handle source, bool convert) { return value.load(source, convert); }
  static handle cast(const handle& array, return_value_policy, handle) { return array.inc_ref(); }
};

}  // namespace pybind11::detail
